-- ARGV: prefix, role, holder, milliseconds. Returns 1 to the one that has the role, for that long after each call.
local name = key('lead', ARGV[2])
local leader = redis.call('GET', name)
if leader and leader ~= ARGV[3] then
  return 0
end
redis.call('SET', name, ARGV[3], 'PX', ARGV[4])
return 1
