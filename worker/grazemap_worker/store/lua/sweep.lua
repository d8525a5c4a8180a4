-- Removes the tiles of finished jobs whose time is over. Argument: most. Returns how many jobs had them.
local over = redis.call('ZRANGEBYSCORE', key('tiles', 'kept'), '-inf', now(), 'LIMIT', 0, given.most)
for _, id in ipairs(over) do
  drop_tiles(id)
end
return #over
