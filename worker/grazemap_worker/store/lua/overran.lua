-- Frees a tile that took longer than its lane allows, and moves its job to the next lane. The processor time is charged
-- to the flow of its asker. After a small tile, the small tiles of this asker are claimed one by one for a while.
-- Arguments: id, tile, holder, seconds (of processor time), alone (seconds for which they are claimed one by one).
local id, tile = args.id, tostring(args.tile)
local status, lane, asker = unpack(redis.call('HMGET', key('job', id), 'status', 'lane', 'asker'))
if not unfinished(status) or claimed_by(id, tile) ~= args.holder then
  return
end
redis.call('HDEL', key('job', id, 'claims'), tile)
count('overran:' .. lane)
charge(id, args.seconds)
if lane == 'small' then
  redis.call('SET', key('overran', asker or ''), 1, 'EX', args.alone)
  move(id, 'short')
else
  move(id, 'long', true)
end
again(id, tile)
