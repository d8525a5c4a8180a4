-- Moves the oldest records of an older layout here, without results, tiles and events: they belong to another core.
-- Unfinished jobs fail. Arguments: old (prefix of that layout), most (jobs), problem (of unfinished jobs).
-- Returns {jobs moved, unfinished ones among them, jobs that remain}.
local old, moved, ended = given.old, 0, 0

local function adopt(id)
  local fields = redis.call('HGETALL', old .. 'job:' .. id)
  if #fields == 0 or redis.call('EXISTS', key('job', id)) == 1 then
    return
  end
  redis.call('HSET', key('job', id), unpack(fields))
  redis.call('HDEL', key('job', id), 'size', 'etag', 'eta')
  local seq = redis.call('INCR', key('sequence'))
  redis.call('HSET', key('job', id), 'seq', seq, 'fingerprint', '')
  local status = get(id, 'status')
  if unfinished(status) then
    redis.call('HSET', key('job', id), 'status', 'failed', 'finished', now(), 'problem', given.problem)
    status, ended = 'failed', ended + 1
  end
  redis.call('ZADD', key('jobs'), seq, id)
  redis.call('ZADD', key('status', status), seq, id)
  redis.call('ZADD', key('over', 'large'), seq, id)
  add_bytes('requests', redis.call('HSTRLEN', key('job', id), 'request'))
  moved = moved + 1
end

for _, id in ipairs(redis.call('ZRANGE', old .. 'jobs', 0, given.most - 1)) do
  adopt(id)
  redis.call('DEL', old .. 'job:' .. id)
  redis.call('ZREM', old .. 'jobs', id)
end
return { moved, ended, redis.call('ZCARD', old .. 'jobs') }
