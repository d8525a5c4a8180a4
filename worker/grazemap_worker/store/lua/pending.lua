-- ARGV: prefix, id, fingerprint, assembly tile number, most tiles. Returns the tiles that are neither done nor held by a live
-- worker, lowest numbers first; the assembly when all are done.
local id = ARGV[2]
local status = get(id, 'status')
if not (status and unfinished(status)) or get(id, 'fingerprint') ~= ARGV[3] then
  return {}
end
local taken = {}
local claims = redis.call('HGETALL', key('job', id, 'claims'))
for i = 1, #claims, 2 do
  local holder = split_claim(claims[i + 1])
  if alive(holder) then
    taken[tonumber(claims[i])] = true
  end
end
local total = number(id, 'total')
if number(id, 'done') >= total then
  return taken[tonumber(ARGV[4])] and {} or { tonumber(ARGV[4]) }
end
for _, tile in ipairs(redis.call('HKEYS', key('job', id, 'tiles'))) do
  taken[tonumber(tile)] = true
end
local tiles = {}
for tile = 0, total - 1 do
  if #tiles >= tonumber(ARGV[5]) then
    break
  end
  if not taken[tile] then
    tiles[#tiles + 1] = tile
  end
end
return tiles
