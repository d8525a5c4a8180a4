-- ARGV: prefix. Returns id, tile, holder, ... of every claim whose holder no longer renews its lease.
local lost = {}
for _, id in ipairs(redis.call('HKEYS', key('unfinished'))) do
  local claims = redis.call('HGETALL', key('job', id, 'claims'))
  for i = 1, #claims, 2 do
    local holder = split_claim(claims[i + 1])
    if not alive(holder) then
      lost[#lost + 1] = id
      lost[#lost + 1] = claims[i]
      lost[#lost + 1] = holder
    end
  end
end
return lost
