-- ARGV: prefix, id. Returns the result's bytes and makes it the most recently used one, or nil.
if get(ARGV[2], 'status') ~= 'successful' then
  return nil
end
local name = result_key(ARGV[2])
local data = redis.call('GET', name)
if data then
  redis.call('ZADD', key('results'), 'XX', redis.call('INCR', key('clock')), name)
end
return data
