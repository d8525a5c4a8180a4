-- Returns the answer of `seen` for a job, or nil if there is none. Renews the subscription of an asker who has one.
-- Arguments: id, asker ('': none), interest (seconds of a subscription), longest (bytes of a request that is returned;
-- left out: any number).
local id = args.id
if redis.call('EXISTS', key('job', id)) == 0 then
  return nil
end
if args.asker ~= '' and unfinished(get(id, 'status')) then
  redis.pcall('ZADD', key('job', id, 'askers'), 'XX', tonumber(now()) + args.interest, args.asker)
end
return seen(id, args.longest)
