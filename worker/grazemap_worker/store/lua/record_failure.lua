-- Counts a failed attempt at a tile, frees the tile, and fails the job when it was one too many. Arguments: id, tile,
-- kind, most (failures of that kind; 0: nothing is counted, the tile is given back), holder ('': whoever holds it),
-- problem, kept (seconds for the tiles).
-- Returns 1 when the tile may be tried again, 0 when the job is over.
local id, tile = given.id, tostring(given.tile)
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
if given.holder ~= '' and claimed_by(id, tile) ~= given.holder then
  return 1 -- somebody else has it by now, or has finished it: nothing was lost
end
redis.call('HDEL', key('job', id, 'claims'), tile)
if given.most > 0 then
  count('failures:' .. given.kind)
  if redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':' .. given.kind, 1) >= given.most then
    fail(id, given.problem, given.kept)
    return 0
  end
  if get(id, 'lane') == 'small' then
    move(id, 'short') -- it is computed in a process of its own from now on
  end
end
again(id, tile)
return 1
