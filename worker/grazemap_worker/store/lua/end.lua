-- Ends an unfinished job: it fails (arguments id, problem, kept), or is dismissed (arguments id, asker, everyone). An
-- asker takes back his own interest; the job goes on for the others whose interest has not run out.
-- Returns 1 when this ended the job, 2 when it goes on for others, 0 when it was over or is not there.
local id = given.id
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
if given.problem then
  fail(id, given.problem, given.kept)
  return 1
end
local askers = key('job', id, 'askers')
redis.call('ZREM', askers, given.asker)
if not given.everyone and redis.call('ZCOUNT', askers, now(), '+inf') > 0 then
  return 2
end
finish(id, 'dismissed', 0)
return 1
