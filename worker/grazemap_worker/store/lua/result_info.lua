-- ARGV: prefix, id. Returns {size, etag} and makes the result the most recently used one, or nil when there is none
-- (any more).
local name = result_key(ARGV[2])
if get(ARGV[2], 'status') ~= 'successful' or redis.call('EXISTS', name) == 0 then
  return nil
end
redis.call('ZADD', key('results'), 'XX', redis.call('INCR', key('clock')), name)
return redis.call('HMGET', key('job', ARGV[2]), 'size', 'etag')
