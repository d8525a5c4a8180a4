-- ARGV: prefix, id, process, request, core version, plan, estimate, tiles, most unfinished tiles, fingerprint,
--       most records.
-- Returns {0} when the job is there already, {1} when it was started, {2, unfinished tiles} when the queue is full.
local id, total, limit, fingerprint = ARGV[2], tonumber(ARGV[8]), tonumber(ARGV[9]), ARGV[10]
local status = get(id, 'status')
if status and unfinished(status) then
  return { 0 }
end
if status == 'successful' and redis.call('EXISTS', result_key(id)) == 1 then
  return { 0 }
end

-- A failed job goes on from the tiles that it has, as long as the same numerics will do the rest.
local kept = 0
if status == 'failed' and fingerprint ~= '' and get(id, 'fingerprint') == fingerprint then
  kept = redis.call('HLEN', key('job', id, 'tiles'))
end
local waiting = tonumber(redis.call('GET', key('unfinished', 'tiles')) or 0)
if waiting + total - kept > limit then
  return { 2, waiting }
end

local seq = redis.call('INCR', key('sequence'))
if status then
  redis.call('ZREM', key('status', status), id)
end
redis.call('DEL', key('job', id), key('job', id, 'events'), key('job', id, 'claims'), key('job', id, 'failures'))
if kept == 0 then
  redis.call('DEL', key('job', id, 'tiles'))
else
  redis.call('PERSIST', key('job', id, 'tiles'))
end
redis.call('HSET', key('job', id), 'seq', seq, 'process', ARGV[3], 'request', ARGV[4], 'core_version', ARGV[5],
  'plan', ARGV[6], 'estimate', ARGV[7], 'total', total, 'done', kept, 'unit', 'tiles', 'fingerprint', fingerprint,
  'created', now())
set_status(id, 'accepted')
redis.call('ZADD', key('jobs'), seq, id)
set_remaining(id, total - kept)
progress_event(id)

-- Forget the oldest finished jobs when there are too many records, some of them at a time; what is unfinished stays.
local excess = math.min(10, redis.call('ZCARD', key('jobs')) - tonumber(ARGV[11]))
for _ = 1, excess do
  local old, old_status, oldest = nil, nil, math.huge
  for _, finished in ipairs({ 'successful', 'failed', 'dismissed' }) do
    local first = redis.call('ZRANGE', key('status', finished), 0, 0, 'WITHSCORES')
    if first[1] and tonumber(first[2]) < oldest then
      old, old_status, oldest = first[1], finished, tonumber(first[2])
    end
  end
  if not old then
    break
  end
  drop_result(result_key(old))
  redis.call('ZREM', key('status', old_status), old)
  redis.call('ZREM', key('jobs'), old)
  redis.call('DEL', key('job', old), key('job', old, 'events'), key('job', old, 'tiles'))
end
return { 1 }
