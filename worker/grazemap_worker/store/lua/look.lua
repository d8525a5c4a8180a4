-- Arguments: id, asker (whose interest goes on, if he has any; '': nobody), interest (seconds), longest (request that is
-- wanted; none: any).
-- Returns what `seen` does, or nil.
local id = given.id
if redis.call('EXISTS', key('job', id)) == 0 then
  return nil
end
if given.asker ~= '' and unfinished(get(id, 'status')) then
  redis.pcall('ZADD', key('job', id, 'askers'), 'XX', tonumber(now()) + given.interest, given.asker)
end
return seen(id, given.longest)
