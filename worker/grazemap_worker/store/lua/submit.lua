-- ARGV: prefix, id, process, request, core version, plan, estimate, tiles, most unfinished tiles, fingerprint,
--       most records, most bytes of requests, steps of putting the tiles together (0: only tiles are counted).
-- Returns {0} when the job is there already, {1} when it was started, {2, unfinished tiles} when the queue is full.
local id, total, limit, fingerprint = ARGV[2], tonumber(ARGV[8]), tonumber(ARGV[9]), ARGV[10]
local status = get(id, 'status')
if status and unfinished(status) then
  return { 0 }
end
if status == 'successful' and redis.call('EXISTS', result_key(id)) == 1 then
  return { 0 }
end

local function forget(old)
  drop_result(result_key(old))
  redis.call('DECRBY', key('records', 'bytes'), redis.call('HSTRLEN', key('job', old), 'request'))
  redis.call('ZREM', key('status', get(old, 'status')), old)
  redis.call('ZREM', key('jobs'), old)
  redis.call('DEL', key('job', old), key('job', old, 'events'), key('job', old, 'tiles'))
end

-- Returns whether there was a finished job; what is unfinished stays.
local function forget_oldest()
  local oldest, least = nil, math.huge
  for _, finished in ipairs({ 'successful', 'failed', 'dismissed' }) do
    local first = redis.call('ZRANGE', key('status', finished), 0, 0, 'WITHSCORES')
    if first[1] and tonumber(first[2]) < least then
      oldest, least = first[1], tonumber(first[2])
    end
  end
  if oldest then
    forget(oldest)
  end
  return oldest ~= nil
end

-- Forget the oldest finished jobs when the requests take too many bytes.
local size = string.len(ARGV[4])
local function bytes_after()
  local bytes = tonumber(redis.call('GET', key('records', 'bytes')) or 0)
  return bytes + size - redis.call('HSTRLEN', key('job', id), 'request')
end
while bytes_after() > tonumber(ARGV[12]) do
  if not forget_oldest() then
    return { 2, tonumber(redis.call('GET', key('unfinished', 'tiles')) or 0) }
  end
end
status = get(id, 'status') -- it may have been the oldest itself

-- A failed job goes on from the tiles that it has, as long as the same numerics will do the rest.
local kept = 0
if status == 'failed' and fingerprint ~= '' and get(id, 'fingerprint') == fingerprint then
  kept = redis.call('HLEN', key('job', id, 'tiles'))
end
local waiting = tonumber(redis.call('GET', key('unfinished', 'tiles')) or 0)
if waiting + total - kept > limit then
  return { 2, waiting }
end

redis.call('SET', key('records', 'bytes'), bytes_after())
local seq = redis.call('INCR', key('sequence'))
if status then
  redis.call('ZREM', key('status', status), id)
end
local spent = kept > 0 and get(id, 'cpu_seconds') or 0
redis.call('DEL', key('job', id), key('job', id, 'events'), key('job', id, 'claims'), key('job', id, 'failures'))
if kept == 0 then
  redis.call('DEL', key('job', id, 'tiles'))
else
  redis.call('PERSIST', key('job', id, 'tiles'))
end
redis.call('HSET', key('job', id), 'seq', seq, 'process', ARGV[3], 'request', ARGV[4], 'core_version', ARGV[5],
  'plan', ARGV[6], 'estimate', ARGV[7], 'total', total, 'done', kept, 'unit', 'tiles', 'fingerprint', fingerprint,
  'cpu_seconds', spent, 'created', now())
if tonumber(ARGV[13]) > 0 then
  redis.call('HSET', key('job', id), 'unit', 'steps', 'steps_done', kept, 'steps_total', total + ARGV[13])
end
set_status(id, 'accepted')
redis.call('ZADD', key('jobs'), seq, id)
set_remaining(id, total - kept)
progress_event(id)

-- And when there are too many of them, some at a time.
for _ = 1, math.min(10, redis.call('ZCARD', key('jobs')) - tonumber(ARGV[11])) do
  if not forget_oldest() then
    break
  end
end
return { 1 }
