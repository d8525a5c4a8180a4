-- ARGV: prefix. Returns name, description, ... of the live workers and forgets the others.
local live = {}
local all = redis.call('HGETALL', key('workers'))
for i = 1, #all, 2 do
  if alive(all[i]) then
    live[#live + 1] = all[i]
    live[#live + 1] = all[i + 1]
  else
    redis.call('HDEL', key('workers'), all[i])
  end
end
return live
