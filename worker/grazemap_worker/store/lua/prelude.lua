-- Functions that all scripts share. ARGV[1] is the key prefix, ARGV[2] the named arguments as JSON; the following ones
-- are bytes. The scripts compute the names of their keys, so all keys must be in one Redis (no cluster). A job is
-- "unfinished" while its status is accepted or running. An "asker" is a requester: who asked for a job.
local prefix = ARGV[1]
local args = cjson.decode(ARGV[2])

-- Seconds for which the events of a finished job are kept; later only its record says how it ended.
local EVENTS_KEPT = 3600
-- The number of the step that assembles a map once its tiles are done.
local ASSEMBLY = '-1'

local function key(...)
  return prefix .. table.concat({ ... }, ':')
end

local function now()
  local time = redis.call('TIME')
  return string.format('%d.%06d', time[1], time[2])
end

local function contains(list, value)
  for _, item in ipairs(list) do
    if item == value then
      return true
    end
  end
  return false
end

local function unfinished(status)
  return status == 'accepted' or status == 'running'
end

local function get(id, field)
  return redis.call('HGET', key('job', id), field)
end

local function number(id, field)
  return tonumber(get(id, field) or 0) or 0
end

local function count(name)
  redis.call('HINCRBY', key('counts'), name, 1)
end

-- Number of stored bytes of a kind: requests, tiles, results:small, results:large.
local function bytes_of(kind)
  return tonumber(redis.call('HGET', key('bytes'), kind) or 0)
end

local function add_bytes(kind, bytes)
  redis.call('HINCRBY', key('bytes'), kind, string.format('%d', bytes)) -- "%d" avoids "-0", which Redis 6.2 refuses
end

-- Publishes an event to those who listen now. Events of jobs that are not small are also kept for later listeners.
local function event(id, name, data)
  local number = ''
  if get(id, 'lane') ~= 'small' then
    number = redis.call('XADD', key('job', id, 'events'), 'MAXLEN', '~', 50000, '*', 'name', name, 'data', data)
  elseif name ~= 'done' then
    return
  end
  redis.call('PUBLISH', key('events'), table.concat({ id, number, name, data }, '\n'))
end

local function progress_event(id)
  if get(id, 'lane') == 'small' then
    return -- nobody would get the event
  end
  local unit = get(id, 'unit')
  local eta = get(id, 'eta')
  local steps = unit == 'steps'
  event(id, 'progress', cjson.encode({
    done = number(id, steps and 'steps_done' or 'done'),
    total = number(id, steps and 'steps_total' or 'total'),
    unit = unit,
    eta_seconds = eta and tonumber(eta) or cjson.null,
  }))
end

local function set_status(id, status)
  local old = get(id, 'status')
  if old then
    redis.call('ZREM', key('status', old), id)
  end
  redis.call('HSET', key('job', id), 'status', status)
  redis.call('ZADD', key('status', status), number(id, 'seq'), id)
end

-- Whether a key exists that was set to expire after so many milliseconds. If it has more than twice that time left, it
-- is stale: the clock was set back after it was written.
local function lasts(name, milliseconds)
  local left = redis.call('PTTL', name)
  return left >= 0 and left <= 2 * milliseconds
end

-- Whether a worker still renews its lease; the value of the lease is its length.
local function alive(holder)
  local name = key('worker', holder)
  return lasts(name, tonumber(redis.call('GET', name)) or 0)
end

-- Renews the lease of a worker. The first write takes no memory; after it Redis lets the script write although its
-- memory is full. So a worker keeps its claims.
local function renew(holder, milliseconds)
  redis.call('PEXPIRE', key('worker', holder), milliseconds)
  redis.call('SET', key('worker', holder), milliseconds, 'PX', milliseconds)
end

-- The holder of a tile and the time of its claim, which are one value, "holder|seconds"; nil where there is no claim.
local function claimed_by(id, tile)
  local claim = redis.call('HGET', key('job', id, 'claims'), tile) or ''
  local holder, since = string.match(claim, '^(.*)|([^|]*)$')
  return holder, tonumber(since)
end

-- Adds tiles of a job to the load of its fingerprint: the estimated milliseconds of all unfinished tiles.
local function add_load(id, tiles)
  local fingerprint, milliseconds = unpack(redis.call('HMGET', key('job', id), 'fingerprint', 'tile_milliseconds'))
  if not fingerprint or fingerprint == '' then
    return
  end
  local more = string.format('%d', tiles * (tonumber(milliseconds) or 0))
  if redis.call('HINCRBY', key('load'), fingerprint, more) <= 0 then
    redis.call('HDEL', key('load'), fingerprint)
  end
end

-- Sets the number of tiles that remain of a job (0: the assembly remains; nil: the job is over). Updates the sums over
-- all jobs, over the jobs of its asker, and over the jobs of its fingerprint.
local function set_remaining(id, tiles)
  local before = tonumber(redis.call('HGET', key('unfinished'), id) or 0)
  if tiles then
    redis.call('HSET', key('unfinished'), id, tiles)
  else
    redis.call('HDEL', key('unfinished'), id)
  end
  redis.call('INCRBY', key('unfinished', 'tiles'), (tiles or 0) - before)
  local asker = get(id, 'asker') or ''
  if redis.call('HINCRBY', key('unfinished', 'askers'), asker, (tiles or 0) - before) <= 0 then
    redis.call('HDEL', key('unfinished', 'askers'), asker)
  end
  add_load(id, (tiles or 0) - before)
end

-- Binds an unfinished job to a fingerprint.
local function bind_to(id, fingerprint)
  local remaining = tonumber(redis.call('HGET', key('unfinished'), id) or 0)
  add_load(id, -remaining)
  redis.call('HSET', key('job', id), 'fingerprint', fingerprint)
  add_load(id, remaining)
end

-- Fairness. Jobs with tiles to claim are in flows. There is one flow for each combination of lane, kernels, priority
-- and asker; jobs with long tiles have separate flows. Each flow has a virtual time, and so has each job in a flow. The
-- flow with the least virtual time is served next, and in it the job with the least. Then both virtual times advance by
-- the seconds of the tile divided by the weight. A new flow, or one that returns, begins at the virtual time of the
-- others.
local function flow_of(id)
  local lane, long_tiles, kernels, priority, asker =
    unpack(redis.call('HMGET', key('job', id), 'lane', 'long_tiles', 'kernels', 'priority', 'asker'))
  local place = (lane or '') .. (long_tiles == '1' and ':tiles' or '')
  return table.concat({ place, kernels or '', priority or '', asker or '' }, '|')
end

local function withdraw(id)
  local fingerprint, flow, lane = unpack(redis.call('HMGET', key('job', id), 'fingerprint', 'flow', 'lane'))
  redis.call('ZREM', key('waiting', lane or ''), id)
  if not flow or flow == '' then
    return
  end
  local jobs = key('flow', fingerprint, flow)
  redis.call('ZREM', jobs, id)
  if redis.call('EXISTS', jobs) == 0 then
    redis.call('ZREM', key('flows', fingerprint), flow)
  end
  redis.call('HSET', key('job', id), 'flow', '')
end

-- The name of the clock of a flow: small jobs, which have their own workers, have their own clock.
local function clock_of(fingerprint, flow)
  return fingerprint .. (string.match(flow, '^small|') and ':small' or '')
end

-- Records that an unfinished job with tiles to claim waits from now on, and puts it into its flow if it is bound to a
-- fingerprint.
local function offer(id)
  local status, fingerprint, present, lane =
    unpack(redis.call('HMGET', key('job', id), 'status', 'fingerprint', 'flow', 'lane'))
  if not unfinished(status) or (present and present ~= '') then
    return
  end
  if redis.call('EXISTS', key('job', id, 'again')) == 0 and number(id, 'next') >= number(id, 'total') then
    return
  end
  redis.call('ZADD', key('waiting', lane or ''), 'NX', now(), id)
  if not fingerprint or fingerprint == '' then
    return
  end
  local flow = flow_of(id)
  local jobs = key('flow', fingerprint, flow)
  local first = redis.call('ZRANGE', jobs, 0, 0, 'WITHSCORES')
  local served = math.max(tonumber(first[2] or 0), number(id, 'served'))
  -- of jobs with equal virtual times, the one that was submitted first is served first
  redis.call('ZADD', jobs, served + 1e-9 * number(id, 'seq'), id)
  local reached = redis.call('HGET', key('clocks'), clock_of(fingerprint, flow))
  redis.call('ZADD', key('flows', fingerprint), 'NX', reached or 0, flow)
  redis.call('HSET', key('job', id), 'flow', flow)
end

-- Marks a tile as one to be claimed again.
local function again(id, tile)
  redis.call('SADD', key('job', id, 'again'), tile)
  offer(id)
end

-- The claims of a holder, as {{id, tile}, ...}. The holder's index may still name claims that have ended or went to
-- another holder; only this function removes them from the index.
local function claims_of(holder)
  local claims = {}
  for _, entry in ipairs(redis.call('SMEMBERS', key('held', holder))) do
    local id, tile = string.match(entry, '^(.*)|([^|]*)$')
    if claimed_by(id, tile) == holder then
      claims[#claims + 1] = { id, tile }
    else
      redis.pcall('SREM', key('held', holder), entry) -- stays if Redis refuses writes
    end
  end
  return claims
end

local function result_key(id)
  return key('result', id, get(id, 'fingerprint') or '')
end

local function drop_result(name)
  local entry = redis.call('HGET', key('results', 'sizes'), name)
  if not entry then
    return
  end
  local class, size = string.match(entry, '^(%a+) (%d+)$')
  redis.call('DEL', name)
  redis.call('ZREM', key('results', class), name)
  redis.call('HDEL', key('results', 'sizes'), name)
  add_bytes('results:' .. class, -tonumber(size))
end

local function drop_tiles(id)
  add_bytes('tiles', -number(id, 'tile_bytes'))
  redis.call('HDEL', key('job', id), 'tile_bytes')
  redis.call('DEL', key('job', id, 'tiles'))
  redis.call('ZREM', key('tiles', 'kept'), id)
end

-- Makes room for so many bytes within the budget. Drops tiles of finished jobs first, then the least recently used
-- results: small ones while they take more than a quarter of the budget, else large ones. Tiles of unfinished jobs
-- stay.
-- Returns whether there is room now.
local function make_room(size, budget)
  while bytes_of('tiles') + bytes_of('results:small') + bytes_of('results:large') + size > budget do
    local kept = redis.call('ZRANGE', key('tiles', 'kept'), 0, 0)[1]
    if kept then
      drop_tiles(kept)
    elseif bytes_of('tiles') + size > budget then
      return false -- without any result there would be no room either
    else
      local class = bytes_of('results:small') > budget / 4 and 'small' or 'large'
      local oldest = redis.call('ZRANGE', key('results', class), 0, 0)[1]
        or redis.call('ZRANGE', key('results', 'small'), 0, 0)[1]
      if not oldest then
        return false
      end
      drop_result(oldest)
    end
  end
  return true
end

local function class_of(id)
  return get(id, 'lane') == 'small' and 'small' or 'large'
end

-- Ends a job with a status. tile_ttl: seconds for which its finished tiles are kept; 0: they are dropped at once.
local function finish(id, status, tile_ttl)
  withdraw(id)
  set_status(id, status)
  redis.call('HSET', key('job', id), 'finished', now())
  redis.call('HDEL', key('job', id), 'eta')
  set_remaining(id, nil)
  redis.call('ZADD', key('over', class_of(id)), number(id, 'seq'), id)
  redis.call('DEL', key('job', id, 'claims'), key('job', id, 'failures'), key('job', id, 'again'),
    key('job', id, 'askers'))
  if tile_ttl == 0 or redis.call('EXISTS', key('job', id, 'tiles')) == 0 then
    drop_tiles(id)
  else
    redis.call('ZADD', key('tiles', 'kept'), tonumber(now()) + tile_ttl, id)
  end
  event(id, 'done', cjson.encode({ status = status }))
  redis.call('EXPIRE', key('job', id, 'events'), EVENTS_KEPT)
end

-- Adds to the processor time of a job. Seconds beyond the estimate of a tile advance the virtual time of its flow.
local function charge(id, seconds)
  redis.call('HINCRBYFLOAT', key('job', id), 'cpu_seconds', string.format('%.9f', seconds))
  local flow = flow_of(id)
  local flows = key('flows', get(id, 'fingerprint') or '')
  local served = redis.call('ZSCORE', flows, flow)
  local more = (seconds - number(id, 'cost')) / math.max(1e-6, number(id, 'weight'))
  if served and more > 0 then
    redis.call('ZADD', flows, tonumber(served) + more, flow)
  end
end

-- Puts a job into a lane, with its weight there. The weights were not stored by the first versions of this layout.
local function move(id, lane, long_tiles)
  withdraw(id)
  local weights = cjson.decode(get(id, 'weights') or '{}')
  redis.call('HSET', key('job', id), 'lane', lane, 'long_tiles', long_tiles and 1 or 0, 'weight',
    weights[lane] or number(id, 'weight'))
  offer(id)
end

local function fail(id, problem, kept)
  redis.call('HSET', key('job', id), 'problem', problem)
  finish(id, 'failed', kept)
end

-- Removes a job and everything that belongs to it.
local function forget(id)
  withdraw(id)
  drop_result(result_key(id))
  drop_tiles(id)
  if redis.call('HEXISTS', key('unfinished'), id) == 1 then
    set_remaining(id, nil)
  end
  add_bytes('requests', -redis.call('HSTRLEN', key('job', id), 'request'))
  for _, list in ipairs({ 'jobs', 'over:small', 'over:large', 'status:accepted', 'status:running', 'status:successful',
    'status:failed', 'status:dismissed' }) do
    redis.call('ZREM', key(list), id)
  end
  redis.call('DEL', key('job', id), key('job', id, 'claims'), key('job', id, 'failures'), key('job', id, 'again'),
    key('job', id, 'askers'), key('job', id, 'events'))
end

-- The record of a job as names and values. A request that is longer than `longest` is left out.
local function record(id, longest)
  local fields = redis.call('HGETALL', key('job', id))
  if not longest or redis.call('HSTRLEN', key('job', id), 'request') <= longest then
    return fields
  end
  local shorter = {}
  for i = 1, #fields, 2 do
    if fields[i] ~= 'request' then
      shorter[#shorter + 1] = fields[i]
      shorter[#shorter + 1] = fields[i + 1]
    end
  end
  return shorter
end

-- Seconds of processor time that a job may still take.
local function left_of(id)
  return tonumber(get(id, 'most_seconds') or math.huge) - number(id, 'cpu_seconds')
end

-- {name, description as JSON} of the live workers; other workers are removed.
local function live_workers()
  local live = {}
  local all = redis.call('HGETALL', key('workers'))
  for i = 1, #all, 2 do
    if alive(all[i]) then
      live[#live + 1] = { all[i], all[i + 1] }
    else
      redis.pcall('HDEL', key('workers'), all[i]) -- stays if Redis refuses writes
    end
  end
  return live
end

-- Number of live workers that take the tiles of a job: workers for its lane that have its fingerprint or, if it is
-- bound to none, its core version.
local function workers_for(id)
  local bound, version, lane = unpack(redis.call('HMGET', key('job', id), 'fingerprint', 'core_version', 'lane'))
  local number = 0
  for _, worker in ipairs(live_workers()) do
    local described = cjson.decode(worker[2])
    local same = described.fingerprint == bound or (bound == '' and described.core_version == version)
    if same and described.small == (lane == 'small') then
      number = number + 1
    end
  end
  return number
end

-- Returns {record of a job, number of live workers that take its tiles, number of unfinished jobs, text on starting
-- workers, text on the compilation of its kernels}. For a finished job, the numbers are 0 and the texts are empty.
local function seen(id, longest)
  if not unfinished(get(id, 'status')) then
    return { record(id, longest), 0, 0, '', '' }
  end
  return {
    record(id, longest),
    workers_for(id),
    redis.call('HLEN', key('unfinished')),
    redis.call('GET', key('starting')) or '',
    redis.call('GET', key('compiling', get(id, 'kernels') or '')) or '',
  }
end
