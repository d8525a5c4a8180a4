-- Starts a job, unless it exists already. Arguments: id, process, core_version, estimate, tiles, after (steps of the
-- assembly; 0: only tiles are counted), lane, long_tiles (whether each tile is long), kernels, asker, priority, weights
-- (by lane), cost (seconds of a tile), interest (seconds of a subscription), group ('': none). Limits: most_seconds (processor
-- time of the job; left out: none), most_tiles (unfinished tiles of all jobs), asker_tiles (unfinished tiles of this
-- asker), most_small and most_large (records of finished jobs), most_bytes (of all requests). Bytes: request, plan.
-- Returns {'there' or 'started', the answer of `seen`}, {'full', number of unfinished tiles}, or {'quota', number of
-- unfinished tiles of the asker}.
local MAX_GROUPS = 8
local id, total, request, plan = args.id, args.tiles, ARGV[3], ARGV[4]

-- Subscribes the asker to the unfinished job, whose priority rises to that of the asker if it was lower.
local function join()
  local joined = redis.call('ZADD', key('job', id, 'askers'), 'CH', tonumber(now()) + args.interest, args.asker)
  local before = tonumber(get(id, 'priority') or 0)
  if joined == 1 and args.priority > before then
    withdraw(id)
    redis.call('HSET', key('job', id), 'priority', args.priority, 'weights', cjson.encode(args.weights))
    move(id, get(id, 'lane'), get(id, 'long_tiles') == '1')
  end
end

-- The last groups of the job, as "|a|b|".
local function groups()
  local before, name = get(id, 'groups') or '|', '|' .. args.group .. '|'
  if args.group == '' or string.find(before, name, 1, true) then
    return before
  end
  local _, number = string.gsub(before, '|', '|')
  return (number > MAX_GROUPS and string.gsub(before, '^|[^|]*', '') or before) .. args.group .. '|'
end

local status = get(id, 'status')
if status and args.group ~= '' then
  redis.pcall('HSET', key('job', id), 'groups', groups()) -- stays as it is if Redis refuses writes
end
if unfinished(status) then
  join()
  return { 'there', seen(id) }
end
if status == 'successful' and not get(id, 'passing') and redis.call('EXISTS', result_key(id)) == 1 then
  return { 'there', seen(id) }
end

local tile_milliseconds = math.ceil(1000 * args.cost)

-- The candidates: fingerprints of the live workers of the core version. Each has the number of workers that take the
-- tiles of this lane, whether one of them is ready, as it has the kernels, and the milliseconds per worker until all
-- work with this fingerprint, with this job, is done.
local function candidates()
  local by_name = {}
  for _, worker in ipairs(live_workers()) do
    local described = cjson.decode(worker[2])
    if described.core_version == args.core_version then
      local name = described.fingerprint
      local candidate = by_name[name] or { name = name, workers = 0, ready = false }
      candidate.workers = candidate.workers + (described.small == (args.lane == 'small') and 1 or 0)
      candidate.ready = candidate.ready or contains(described.kernels, args.kernels)
      by_name[name] = candidate
    end
  end
  for name, candidate in pairs(by_name) do
    local load = tonumber(redis.call('HGET', key('load'), name) or 0) + total * tile_milliseconds
    candidate.after = load / math.max(1, candidate.workers)
  end
  return by_name
end

local function better(a, b)
  if (a.workers > 0) ~= (b.workers > 0) then
    return a.workers > 0
  elseif a.ready ~= b.ready then
    return a.ready
  elseif a.after ~= b.after then
    return a.after < b.after
  elseif a.workers ~= b.workers then
    return a.workers > b.workers
  end
  return a.name < b.name
end

-- The fingerprint for the job: `before`, that of its kept tiles, if live workers have it; else the best candidate; ''
-- if no worker is alive.
local function choose_fingerprint(before)
  local all, best = candidates(), nil
  if all[before] then
    return before
  end
  for _, candidate in pairs(all) do
    if not best or better(candidate, best) then
      best = candidate
    end
  end
  return best and best.name or ''
end

-- Removes the oldest finished job, a small one if there is one. Returns whether there was a finished job.
local function forget_oldest()
  for _, class in ipairs({ 'small', 'large' }) do
    local oldest = redis.call('ZRANGE', key('over', class), 0, 0)[1]
    if oldest then
      forget(oldest)
      return true
    end
  end
  return false
end

local waiting = tonumber(redis.call('GET', key('unfinished', 'tiles')) or 0)
-- The bytes of all requests once this one is stored.
local function bytes_after()
  return bytes_of('requests') + string.len(request) - redis.call('HSTRLEN', key('job', id), 'request')
end
while bytes_after() > args.most_bytes do
  if not forget_oldest() then
    return { 'full', waiting }
  end
end
status = get(id, 'status') -- this job may have been the oldest one

-- A failed job goes on from its finished tiles, if the same fingerprint computes the rest.
local before = status == 'failed' and redis.call('EXISTS', key('job', id, 'tiles')) == 1 and get(id, 'fingerprint')
local fingerprint, kept = choose_fingerprint(before or ''), 0
if before and fingerprint ~= '' and fingerprint == before then
  kept = redis.call('HLEN', key('job', id, 'tiles'))
end
if waiting + total - kept > args.most_tiles then
  return { 'full', waiting }
end
local asker_waiting = tonumber(redis.call('HGET', key('unfinished', 'askers'), args.asker) or 0)
if args.asker_tiles and asker_waiting > 0 and asker_waiting + total - kept > args.asker_tiles then
  return { 'quota', asker_waiting }
end

local more = {}
if kept > 0 then
  more = { 'cpu_seconds', get(id, 'cpu_seconds') or 0, 'tile_bytes', number(id, 'tile_bytes') }
  redis.call('ZREM', key('tiles', 'kept'), id)
else
  drop_tiles(id)
end
-- the entity tag of a result that is computed again is kept, for clients that have this result
local etag = get(id, 'etag')
if etag then
  more[#more + 1] = 'etag'
  more[#more + 1] = etag
end
if groups() ~= '|' then
  more[#more + 1] = 'groups'
  more[#more + 1] = groups()
end
add_bytes('requests', bytes_after() - bytes_of('requests'))
if status then
  redis.call('ZREM', key('status', status), id)
  redis.call('ZREM', key('over', 'small'), id)
  redis.call('ZREM', key('over', 'large'), id)
end
redis.call('DEL', key('job', id), key('job', id, 'events'), key('job', id, 'again'))
local seq = redis.call('INCR', key('sequence'))
redis.call('HSET', key('job', id), 'seq', seq, 'process', args.process, 'request', request, 'plan', plan,
  'core_version', args.core_version, 'estimate', args.estimate, 'total', total, 'done', kept, 'unit', 'tiles',
  'fingerprint', fingerprint, 'lane', args.lane, 'long_tiles', args.long_tiles and 1 or 0, 'kernels', args.kernels,
  'asker', args.asker, 'priority', args.priority, 'weights', cjson.encode(args.weights), 'weight',
  args.weights[args.lane], 'cost', args.cost, 'tile_milliseconds',
  tile_milliseconds, 'created', now(), unpack(more))
if args.after > 0 then
  redis.call('HSET', key('job', id), 'unit', 'steps', 'steps_done', kept, 'steps_total', total + args.after)
end
if args.most_seconds then
  -- the time that the failed job has spent does not count for the job that goes on
  redis.call('HSET', key('job', id), 'most_seconds', number(id, 'cpu_seconds') + args.most_seconds)
end
set_status(id, 'accepted')
redis.call('ZADD', key('jobs'), seq, id)
redis.call('ZADD', key('job', id, 'askers'), tonumber(now()) + args.interest, args.asker)
set_remaining(id, total - kept)
if kept == total then
  redis.call('SADD', key('job', id, 'again'), ASSEMBLY)
  redis.call('HSET', key('job', id), 'next', total)
end
progress_event(id)
offer(id)

-- When there are too many records of a class, some are removed at a time.
for _, class in ipairs({ 'small', 'large' }) do
  local most = class == 'small' and args.most_small or args.most_large
  for _ = 1, math.min(10, redis.call('ZCARD', key('over', class)) - most) do
    forget(redis.call('ZRANGE', key('over', class), 0, 0)[1])
  end
end
return { 'started', seen(id) }
