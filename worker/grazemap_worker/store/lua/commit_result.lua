-- ARGV: prefix, id, data, fingerprint, etag, byte budget, seconds to keep the tiles, processor seconds.
-- Returns 1, or 0 when the job is not waiting for this result. Evicts the least recently used results over budget.
local id, size = ARGV[2], string.len(ARGV[3])
local status = get(id, 'status')
if not (status and unfinished(status)) or get(id, 'fingerprint') ~= ARGV[4] then
  return 0
end
local name = result_key(id)
if redis.call('EXISTS', name) == 1 then
  drop_result(name)
end
-- Results are evicted first, so that Redis never holds more than the budget.
while tonumber(redis.call('GET', key('results', 'bytes')) or 0) + size > tonumber(ARGV[6]) do
  local oldest = redis.call('ZRANGE', key('results'), 0, 0)[1]
  if not oldest then
    break
  end
  drop_result(oldest)
end
redis.call('SET', name, ARGV[3])
redis.call('ZADD', key('results'), redis.call('INCR', key('clock')), name)
redis.call('HSET', key('results', 'sizes'), name, size)
redis.call('INCRBY', key('results', 'bytes'), size)
local total = number(id, 'total')
redis.call('HSET', key('job', id), 'size', size, 'etag', ARGV[5], 'done', total)
if get(id, 'unit') == 'steps' then
  redis.call('HSET', key('job', id), 'steps_done', number(id, 'steps_total'))
end
redis.call('HDEL', key('job', id), 'eta')
redis.call('HINCRBYFLOAT', key('job', id), 'cpu_seconds', ARGV[8])
progress_event(id)
finish(id, 'successful', tonumber(ARGV[7]))
return 1
