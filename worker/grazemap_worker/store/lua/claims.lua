-- Returns id, tile, holder, ... of the claims of a holder or, if `holder` is '', of every holder that no longer renews
-- its lease. Argument: holder.
local holders = { args.holder }
if args.holder == '' then
  holders = redis.call('SMEMBERS', key('holders'))
end
local triples = {}
for _, holder in ipairs(holders) do
  if args.holder ~= '' or not alive(holder) then
    local claims = claims_of(holder)
    for _, claim in ipairs(claims) do
      triples[#triples + 1] = claim[1]
      triples[#triples + 1] = claim[2]
      triples[#triples + 1] = holder
    end
    if #claims == 0 then
      redis.call('SREM', key('holders'), holder)
    end
  end
end
return triples
