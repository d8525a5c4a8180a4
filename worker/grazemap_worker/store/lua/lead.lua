-- Arguments: role, holder, milliseconds. Returns 1 to the one that has the role, for that long after each call.
local name = key('lead', given.role)
if redis.call('GET', name) ~= given.holder and lasts(name, given.milliseconds) then
  return 0
end
redis.call('SET', name, given.holder, 'PX', given.milliseconds)
return 1
