-- Stores the progress of a job that counts steps. Arguments: id, done, total.
-- Returns 1 while the job is unfinished, else 0.
local id, total = args.id, args.total
if not unfinished(get(id, 'status')) then
  return 0
end
-- The stored progress never decreases: a worker that repeats a lost step reports less than before. The last step is
-- done only when the result is stored.
local done = math.max(math.min(args.done, total - 1), number(id, 'steps_done'))
redis.call('HSET', key('job', id), 'unit', 'steps', 'steps_done', done, 'steps_total', total)
-- Remaining time: each step takes as long as the steps since the start or, in the assembly, since it was claimed.
local before, since, _ = 0, get(id, 'started'), nil
if redis.call('HEXISTS', key('job', id, 'claims'), ASSEMBLY) == 1 then
  before = number(id, 'total')
  _, since = claimed_by(id, ASSEMBLY)
end
if since and done > before then
  local eta = (tonumber(now()) - tonumber(since)) * (total - done) / (done - before)
  redis.call('HSET', key('job', id), 'eta', string.format('%.3f', math.max(0, eta)))
end
progress_event(id)
return 1
