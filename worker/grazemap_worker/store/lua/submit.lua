-- Starts a job, unless it is there already. Arguments: id, process, core_version, estimate, tiles, after (steps of
-- putting the tiles together; 0: only tiles are counted), lane, long_tiles (whether each of them is long), kernels, asker,
-- priority, weight, cost (seconds of a tile), and the limits: most_seconds (of processor time of the job; left out: none), most_tiles, asker_tiles (of this
-- asker), most_small, most_large (records), most_bytes (of requests), interest (seconds); group ('': none). Bytes:
-- request, plan.
-- Returns {'there' or 'started', what `seen` does} or {'full', unfinished tiles} or {'quota', unfinished tiles of the asker}.
local MOST_GROUPS = 8
local id, total, request, plan = given.id, given.tiles, ARGV[3], ARGV[4]

local function join()
  local joined = redis.call('ZADD', key('job', id, 'askers'), 'CH', tonumber(now()) + given.interest, given.asker)
  local before = tonumber(get(id, 'priority') or 0)
  if joined == 1 and given.priority > before then
    withdraw(id)
    redis.call('HSET', key('job', id), 'priority', given.priority, 'weight', given.weight)
    offer(id)
  end
end

-- The last groups that it belongs to, as "|a|b|".
local function groups()
  local before, name = get(id, 'groups') or '|', '|' .. given.group .. '|'
  if given.group == '' or string.find(before, name, 1, true) then
    return before
  end
  local _, number = string.gsub(before, '|', '|')
  return (number > MOST_GROUPS and string.gsub(before, '^|[^|]*', '') or before) .. given.group .. '|'
end

local status = get(id, 'status')
if status and given.group ~= '' then
  redis.pcall('HSET', key('job', id), 'groups', groups()) -- where writes are refused it stays as it is
end
if status and unfinished(status) then
  join()
  return { 'there', seen(id) }
end
if status == 'successful' and not get(id, 'passing') and redis.call('EXISTS', result_key(id)) == 1 then
  return { 'there', seen(id) }
end

local tile_milliseconds = math.ceil(1000 * given.cost)

-- The numerics of the live workers of that core version, by fingerprint: how many workers take the tiles of this lane,
-- whether one has the kernels, and after how long all work there would be done, this job's included.
local function numerics()
  local found = {}
  for _, worker in ipairs(live_workers()) do
    local described = cjson.decode(worker[2])
    if described.core_version == given.core_version then
      local name = described.fingerprint
      local one = found[name] or { name = name, workers = 0, ready = false }
      one.workers = one.workers + (takes(described, given.lane) and 1 or 0)
      one.ready = one.ready or contains(described.kernels, given.kernels)
      found[name] = one
    end
  end
  for name, one in pairs(found) do
    local load = tonumber(redis.call('HGET', key('load'), name) or 0) + total * tile_milliseconds
    one.after = load / math.max(1, one.workers)
  end
  return found
end

local function better(one, other)
  if (one.workers > 0) ~= (other.workers > 0) then
    return one.workers > 0
  elseif one.ready ~= other.ready then
    return one.ready
  elseif one.after ~= other.after then
    return one.after < other.after
  elseif one.workers ~= other.workers then
    return one.workers > other.workers
  end
  return one.name < other.name
end

-- The numerics that will compute it: those that did before, where its tiles are kept, else the best; '' when no worker
-- is alive.
local function numerics_for_it(before)
  local all, best = numerics(), nil
  if all[before] then
    return before
  end
  for _, one in pairs(all) do
    if not best or better(one, best) then
      best = one
    end
  end
  return best and best.name or ''
end

-- Forgets the oldest job that is over, a small one if there is one. Returns whether there was one.
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
local function bytes_after()
  return bytes_of('requests') + string.len(request) - redis.call('HSTRLEN', key('job', id), 'request')
end
while bytes_after() > given.most_bytes do
  if not forget_oldest() then
    return { 'full', waiting }
  end
end
status = get(id, 'status') -- it may have been the oldest itself

-- A failed job goes on from the tiles that it has, as long as the same numerics will do the rest.
local before = status == 'failed' and redis.call('EXISTS', key('job', id, 'tiles')) == 1 and get(id, 'fingerprint')
local fingerprint, kept = numerics_for_it(before or ''), 0
if before and fingerprint ~= '' and fingerprint == before then
  kept = redis.call('HLEN', key('job', id, 'tiles'))
end
if waiting + total - kept > given.most_tiles then
  return { 'full', waiting }
end
local own = tonumber(redis.call('HGET', key('unfinished', 'askers'), given.asker) or 0)
if given.asker_tiles and own > 0 and own + total - kept > given.asker_tiles then
  return { 'quota', own }
end

local more = {}
if kept > 0 then
  more = { 'cpu_seconds', get(id, 'cpu_seconds') or 0, 'tile_bytes', number(id, 'tile_bytes') }
  redis.call('ZREM', key('tiles', 'kept'), id)
else
  drop_tiles(id)
end
-- the tag of a result that is computed again, for clients that have it
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
redis.call('HSET', key('job', id), 'seq', seq, 'process', given.process, 'request', request, 'plan', plan,
  'core_version', given.core_version, 'estimate', given.estimate, 'total', total, 'done', kept, 'unit', 'tiles',
  'fingerprint', fingerprint, 'lane', given.lane, 'long_tiles', given.long_tiles and 1 or 0, 'kernels', given.kernels,
  'asker', given.asker, 'priority', given.priority, 'weight', given.weight, 'cost', given.cost, 'tile_milliseconds',
  tile_milliseconds, 'created', now(), unpack(more))
if given.after > 0 then
  redis.call('HSET', key('job', id), 'unit', 'steps', 'steps_done', kept, 'steps_total', total + given.after)
end
if given.most_seconds then
  -- what was spent before counted for the job that failed
  redis.call('HSET', key('job', id), 'most_seconds', number(id, 'cpu_seconds') + given.most_seconds)
end
set_status(id, 'accepted')
redis.call('ZADD', key('jobs'), seq, id)
redis.call('ZADD', key('job', id, 'askers'), tonumber(now()) + given.interest, given.asker)
set_remaining(id, total - kept)
if kept == total then
  redis.call('SADD', key('job', id, 'again'), ASSEMBLY)
  redis.call('HSET', key('job', id), 'next', total)
end
progress_event(id)
offer(id)

-- And when there are too many records of a class, some at a time.
for _, class in ipairs({ 'small', 'large' }) do
  local most = class == 'small' and given.most_small or given.most_large
  for _ = 1, math.min(10, redis.call('ZCARD', key('over', class)) - most) do
    forget(redis.call('ZRANGE', key('over', class), 0, 0)[1])
  end
end
return { 'started', seen(id) }
