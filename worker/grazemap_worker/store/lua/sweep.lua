-- Removes the tiles of finished jobs that have been kept long enough. Argument: most (jobs).
local over = redis.call('ZRANGEBYSCORE', key('tiles', 'kept'), '-inf', now(), 'LIMIT', 0, args.most)
for _, id in ipairs(over) do
  drop_tiles(id)
end
