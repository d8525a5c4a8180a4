-- Stores finished tiles and results; the first commit of a tile or a result wins. Arguments: fingerprint, budget (bytes
-- of all results and tiles), kept (seconds for which the tiles of a finished job are kept), items: {id, tile, whole
-- (whether it is the result of the job), lasting (whether the result also answers later requests), event, etag, seconds
-- (of processor time), size}. Bytes: the npz files of the items, one after another.
-- Returns for each item a number, which `Results.commit` describes.

local function store_tile(item, data)
  local id, tile, total = item.id, tostring(item.tile), number(item.id, 'total')
  local claims, size = key('job', id, 'claims'), string.len(data)
  if item.tile < 0 or item.tile >= total then
    return -1
  end
  if redis.call('HEXISTS', key('job', id, 'tiles'), tile) == 0 then
    if not make_room(size, args.budget) then
      return -2
    end
    redis.call('HSET', key('job', id, 'tiles'), tile, data)
    redis.call('SREM', key('job', id, 'again'), tile)
    redis.call('HINCRBY', key('job', id), 'tile_bytes', size)
    add_bytes('tiles', size)
    local done = redis.call('HINCRBY', key('job', id), 'done', 1)
    set_remaining(id, total - done)
    charge(id, item.seconds)
    local _, since = claimed_by(id, tile)
    if since then
      -- Remaining time: the mean time of the finished tiles, divided by the number of workers on this job.
      redis.call('HINCRBYFLOAT', key('job', id), 'tile_seconds', math.max(0, tonumber(now()) - since))
      redis.call('HINCRBY', key('job', id), 'tiles_timed', 1)
      local mean = number(id, 'tile_seconds') / number(id, 'tiles_timed')
      local eta = mean * (total - done) / math.max(1, redis.call('HLEN', claims))
      if get(id, 'unit') == 'steps' then
        -- The assembly is done by one worker. Each of its steps takes about the time of a tile.
        eta = eta + mean * (number(id, 'steps_total') - total)
      end
      redis.call('HSET', key('job', id), 'eta', string.format('%.3f', eta))
    end
    if get(id, 'unit') == 'steps' then
      redis.call('HSET', key('job', id), 'steps_done', done)
    end
    event(id, 'tile', item.event)
    progress_event(id)
    if done == total then
      again(id, ASSEMBLY)
    end
  end
  redis.call('HDEL', claims, tile)
  if left_of(id) < 0 then
    return -3
  end
  return total - number(id, 'done')
end

local function store_result(item, data)
  local id, size, class = item.id, string.len(data), class_of(item.id)
  local name = result_key(id)
  drop_result(name)
  if not make_room(size, args.budget) then
    return -2
  end
  redis.call('SET', name, data)
  redis.call('ZADD', key('results', class), redis.call('INCR', key('clock')), name)
  redis.call('HSET', key('results', 'sizes'), name, class .. ' ' .. size)
  add_bytes('results:' .. class, size)
  redis.call('HSET', key('job', id), 'size', size, 'etag', item.etag, 'done', number(id, 'total'))
  if get(id, 'unit') == 'steps' then
    redis.call('HSET', key('job', id), 'steps_done', number(id, 'steps_total'))
  end
  redis.call('HDEL', key('job', id), 'eta')
  if not item.lasting then
    redis.call('HSET', key('job', id), 'passing', 1)
  end
  charge(id, item.seconds)
  progress_event(id)
  finish(id, 'successful', args.kept)
  return 0
end

local answers, position = {}, 0
for i, item in ipairs(args.items) do
  if not unfinished(get(item.id, 'status')) or get(item.id, 'fingerprint') ~= args.fingerprint then
    answers[i] = -1
  else
    local data = #args.items == 1 and ARGV[3] or string.sub(ARGV[3], position + 1, position + item.size)
    answers[i] = (item.whole and store_result or store_tile)(item, data)
  end
  position = position + item.size
end
return answers
