-- ARGV: prefix, id, tile, kind, most failures of that kind, holder ('' = whoever holds it), problem, seconds to keep
--       the tiles. Counts the failure of one try at a tile, frees the tile, fails the job when it was one too many.
-- Returns 1 when the tile may be tried again, 0 when the job is over.
local id, tile, kind, holder = ARGV[2], ARGV[3], ARGV[4], ARGV[6]
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
local held_by = claimed_by(id, tile)
if holder ~= '' and held_by ~= holder then
  return 1 -- somebody else has it by now, or has finished it: nothing was lost
end
redis.call('HDEL', key('job', id, 'claims'), tile)
local count = redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':' .. kind, 1)
if count < tonumber(ARGV[5]) then
  return 1
end
redis.call('HSET', key('job', id), 'problem', ARGV[7])
finish(id, 'failed', tonumber(ARGV[8]))
return 0
