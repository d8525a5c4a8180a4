-- ARGV: prefix, id, tile, holder. Gives a tile back without counting it as lost. Returns 1 when it was held.
local holder = claimed_by(ARGV[2], ARGV[3])
if holder ~= ARGV[4] then
  return 0
end
return redis.call('HDEL', key('job', ARGV[2], 'claims'), ARGV[3])
