-- Arguments: id, done, total, unit. Returns 1 when the job is still wanted.
local id, total = given.id, given.total
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
-- A worker that repeats a lost step reports less than was reported before; all is done only with the result.
local done = math.max(math.min(given.done, total - 1), number(id, 'steps_done'))
redis.call('HSET', key('job', id), 'unit', given.unit, 'steps_done', done, 'steps_total', total)
-- Time to go: as long for each step as for those since the start, or since the tiles were done.
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
