-- A tile took longer than its lane allows, and was stopped: its job goes on in the next lane. The time that it took counts
-- for its asker alone, whose small tiles are claimed one by one from now on. Arguments: id, tile, holder, seconds (of
-- processor time), alone (seconds for which the asker's small tiles are claimed so).
-- Returns 1, or 0 if the holder no longer has the tile.
local id, tile = given.id, tostring(given.tile)
local status, lane, asker = unpack(redis.call('HMGET', key('job', id), 'status', 'lane', 'asker'))
if not (status and unfinished(status)) or claimed_by(id, tile) ~= given.holder then
  return 0
end
redis.call('HDEL', key('job', id, 'claims'), tile)
count('overran:' .. lane)
charge(id, given.seconds)
if lane == 'small' then
  redis.call('SET', key('overran', asker or ''), 1, 'EX', given.alone)
  move(id, 'short')
else
  move(id, 'long', true)
end
again(id, tile)
return 1
