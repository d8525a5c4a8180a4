-- ARGV: prefix, id, done, total, unit. Returns 1 when the job is still wanted.
local id, done, total = ARGV[2], tonumber(ARGV[3]), tonumber(ARGV[4])
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
redis.call('HSET', key('job', id), 'unit', ARGV[5], 'steps_done', done, 'steps_total', total)
local started = get(id, 'started')
if started and done > 0 then
  local eta = (tonumber(now()) - tonumber(started)) * (total - done) / done
  redis.call('HSET', key('job', id), 'eta', string.format('%.3f', math.max(0, eta)))
end
progress_event(id)
return 1
