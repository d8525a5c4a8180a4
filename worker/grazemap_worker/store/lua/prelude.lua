-- What every script shares. ARGV[1] is the key prefix; scripts name their keys themselves, so one Redis holds all
-- of them (no cluster). A job is "unfinished" while it is accepted or running.
local prefix = ARGV[1]

-- Seconds for which the events of a job that is over are there; later the record says how it ended.
local EVENTS_KEPT = 3600

local function key(...)
  return prefix .. table.concat({ ... }, ':')
end

local function now()
  local time = redis.call('TIME')
  return string.format('%d.%06d', time[1], time[2])
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

local function event(id, name, data)
  redis.call('XADD', key('job', id, 'events'), 'MAXLEN', '~', 50000, '*', 'name', name, 'data', data)
end

local function progress_event(id)
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
  redis.call('ZADD', key('status', status), get(id, 'seq'), id)
end

-- Whether the worker that holds something still renews its lease.
local function alive(holder)
  return redis.call('EXISTS', key('worker', holder)) == 1
end

-- The holder and the time of a claim are one value, "holder|seconds".
local function split_claim(claim)
  local holder, since = string.match(claim, '^(.*)|([^|]*)$')
  return holder, tonumber(since)
end

local function claimed_by(id, tile)
  local claim = redis.call('HGET', key('job', id, 'claims'), tile)
  if not claim then
    return nil
  end
  return split_claim(claim)
end

-- What remains of an unfinished job (0: its assembly; nil: it is over), and with it the sum over all jobs.
local function set_remaining(id, tiles)
  local before = tonumber(redis.call('HGET', key('unfinished'), id) or 0)
  if tiles then
    redis.call('HSET', key('unfinished'), id, tiles)
  else
    redis.call('HDEL', key('unfinished'), id)
  end
  redis.call('INCRBY', key('unfinished', 'tiles'), (tiles or 0) - before)
end

-- The claims of a holder, as {{id, tile}, ...}. Its index may name some that ended or went to another holder; those
-- are taken out of it here, and nowhere else.
local function claims_of(holder)
  local found = {}
  for _, entry in ipairs(redis.call('SMEMBERS', key('held', holder))) do
    local id, tile = string.match(entry, '^(.*)|([^|]*)$')
    if claimed_by(id, tile) == holder then
      found[#found + 1] = { id, tile }
    else
      redis.call('SREM', key('held', holder), entry)
    end
  end
  return found
end

local function result_key(id)
  return key('result', id, get(id, 'fingerprint') or '')
end

local function drop_result(name)
  local size = tonumber(redis.call('HGET', key('results', 'sizes'), name) or 0)
  redis.call('DEL', name)
  redis.call('ZREM', key('results'), name)
  redis.call('HDEL', key('results', 'sizes'), name)
  redis.call('DECRBY', key('results', 'bytes'), size)
end

-- tile_ttl: seconds for which the finished tiles are kept; 0: freed at once.
local function finish(id, status, tile_ttl)
  set_status(id, status)
  redis.call('HSET', key('job', id), 'finished', now())
  redis.call('HDEL', key('job', id), 'eta')
  set_remaining(id, nil)
  redis.call('DEL', key('job', id, 'claims'), key('job', id, 'failures'))
  if tile_ttl == 0 then
    redis.call('DEL', key('job', id, 'tiles'))
  else
    redis.call('EXPIRE', key('job', id, 'tiles'), tile_ttl)
  end
  event(id, 'done', cjson.encode({ status = status }))
  redis.call('EXPIRE', key('job', id, 'events'), EVENTS_KEPT)
end
