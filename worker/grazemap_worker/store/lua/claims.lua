-- ARGV: prefix, holder. Returns id, tile, holder, ... of every claim of that holder; without one ('') of every holder
-- that no longer renews its lease.
local found = {}
for _, id in ipairs(redis.call('HKEYS', key('unfinished'))) do
  local claims = redis.call('HGETALL', key('job', id, 'claims'))
  for i = 1, #claims, 2 do
    local holder = split_claim(claims[i + 1])
    if holder == ARGV[2] or (ARGV[2] == '' and not alive(holder)) then
      found[#found + 1] = id
      found[#found + 1] = claims[i]
      found[#found + 1] = holder
    end
  end
end
return found
