-- Arguments: holder ('': every holder that no longer renews its lease). Returns id, tile, holder, ... of its claims.
local holders = { given.holder }
if given.holder == '' then
  holders = redis.call('SMEMBERS', key('holders'))
end
local found = {}
for _, holder in ipairs(holders) do
  if given.holder ~= '' or not alive(holder) then
    local claims = claims_of(holder)
    for _, claim in ipairs(claims) do
      found[#found + 1] = claim[1]
      found[#found + 1] = claim[2]
      found[#found + 1] = holder
    end
    if #claims == 0 then
      redis.call('SREM', key('holders'), holder)
    end
  end
end
return found
