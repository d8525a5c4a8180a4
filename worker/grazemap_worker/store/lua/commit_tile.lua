-- ARGV: prefix, id, tile, data, fingerprint, data of the event, processor seconds. First writer wins.
-- Returns the number of tiles that remain, or -1 when the job no longer wants this tile.
local id, tile = ARGV[2], ARGV[3]
local status = get(id, 'status')
if not (status and unfinished(status)) or get(id, 'fingerprint') ~= ARGV[5] then
  return -1
end
local total = number(id, 'total')
if tonumber(tile) < 0 or tonumber(tile) >= total then
  return -1
end
local claims = key('job', id, 'claims')
if redis.call('HSETNX', key('job', id, 'tiles'), tile, ARGV[4]) == 1 then
  local done = redis.call('HINCRBY', key('job', id), 'done', 1)
  set_remaining(id, total - done)
  redis.call('HINCRBYFLOAT', key('job', id), 'cpu_seconds', ARGV[7])
  local _, since = claimed_by(id, tile)
  if since then
    -- Time to go: mean time of the tiles so far, shared among those that now work on this job.
    redis.call('HINCRBYFLOAT', key('job', id), 'tile_seconds', math.max(0, tonumber(now()) - since))
    redis.call('HINCRBY', key('job', id), 'tiles_timed', 1)
    local mean = number(id, 'tile_seconds') / number(id, 'tiles_timed')
    local eta = mean * (total - done) / math.max(1, redis.call('HLEN', claims))
    if get(id, 'unit') == 'steps' then
      -- Putting them together is one worker's, and counts as many steps as tiles would take so long.
      eta = eta + mean * (number(id, 'steps_total') - total)
    end
    redis.call('HSET', key('job', id), 'eta', string.format('%.3f', eta))
  end
  if get(id, 'unit') == 'steps' then
    redis.call('HSET', key('job', id), 'steps_done', done)
  end
  event(id, 'tile', ARGV[6])
  progress_event(id)
end
redis.call('HDEL', claims, tile)
return total - number(id, 'done')
