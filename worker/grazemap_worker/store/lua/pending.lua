-- ARGV: prefix, fingerprint, assembly tile number, most tiles of a job, ids ... Returns, for each id, the tiles that are
-- neither done nor held by a live worker, lowest numbers first; the assembly when all are done.
local assembly, most = tonumber(ARGV[3]), tonumber(ARGV[4])

local function pending(id)
  local status, fingerprint, done, total =
    unpack(redis.call('HMGET', key('job', id), 'status', 'fingerprint', 'done', 'total'))
  if not (status and unfinished(status)) or fingerprint ~= ARGV[2] then
    return {}
  end
  local taken = {}
  local claims = redis.call('HGETALL', key('job', id, 'claims'))
  for i = 1, #claims, 2 do
    if alive((split_claim(claims[i + 1]))) then
      taken[tonumber(claims[i])] = true
    end
  end
  if tonumber(done) >= tonumber(total) then
    return taken[assembly] and {} or { assembly }
  end
  for _, tile in ipairs(redis.call('HKEYS', key('job', id, 'tiles'))) do
    taken[tonumber(tile)] = true
  end
  local tiles = {}
  for tile = 0, tonumber(total) - 1 do
    if #tiles >= most then
      break
    end
    if not taken[tile] then
      tiles[#tiles + 1] = tile
    end
  end
  return tiles
end

local found = {}
for i = 5, #ARGV do
  found[#found + 1] = pending(ARGV[i])
end
return found
