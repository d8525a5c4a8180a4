-- Ends an unfinished job: it fails (arguments id, problem, kept), or is dismissed (arguments id, asker, everyone). A
-- dismissal removes the subscription of the asker; the job goes on while other askers are subscribed to it.
-- Returns 1 if this call ended the job, 2 if the job goes on for others, 0 if it was over or does not exist.
local id = args.id
if not unfinished(get(id, 'status')) then
  return 0
end
if args.problem then
  fail(id, args.problem, args.kept)
  return 1
end
local askers = key('job', id, 'askers')
redis.call('ZREM', askers, args.asker)
if not args.everyone and redis.call('ZCOUNT', askers, now(), '+inf') > 0 then
  return 2
end
finish(id, 'dismissed', 0)
return 1
