-- Claims tiles, fairly among flows. Arguments: holder, fingerprint, lease (milliseconds), lanes, kernels, most (tiles),
-- seconds (of these tiles together), most_bytes (of their requests); stopped (a job whose tile is stopped meanwhile; left
-- out: none) and waited (seconds for which others must have waited then); or job and tile, to claim this one.
-- Returns {whether there is more to claim, {id, tile, attempts that lost their worker, process, request, core version,
-- plan, estimate, lane, seconds of processor time that the job may still take}, ...}.
local holder, fingerprint = given.holder, given.fingerprint
local MOST_HELD = 100
local flows, found, spent, bytes = key('flows', fingerprint), { 0 }, 0, 0

local function take(id, tile)
  local started = get(id, 'status') == 'running'
  redis.call('HSET', key('job', id, 'claims'), tile, holder .. '|' .. now())
  redis.call('SREM', key('job', id, 'again'), tile)
  redis.call('SADD', key('held', holder), id .. '|' .. tile)
  redis.call('SADD', key('holders'), holder)
  renew(holder, given.lease)
  if not started then
    redis.call('HSET', key('job', id), 'started', now())
    set_status(id, 'running')
    progress_event(id)
  end
  local lost = redis.call('HGET', key('job', id, 'failures'), tile .. ':lost') or '0'
  local fields = redis.call('HMGET', key('job', id), 'process', 'request', 'core_version', 'plan', 'estimate', 'lane')
  fields[#fields + 1] = tostring(left_of(id))
  found[#found + 1] = { id, tile, lost, unpack(fields) }
  bytes = bytes + string.len(fields[2] or '')
end

-- The next tile of a job that is neither done nor claimed, or nil.
local function next_tile(id)
  local tile = redis.call('SRANDMEMBER', key('job', id, 'again'))
  if tile then
    return tile
  end
  local number, total = number(id, 'next'), number(id, 'total')
  while number < total and (redis.call('HEXISTS', key('job', id, 'tiles'), number) == 1
    or redis.call('HEXISTS', key('job', id, 'claims'), number) == 1) do
    number = number + 1
  end
  redis.call('HSET', key('job', id), 'next', math.min(number + 1, total))
  return number < total and tostring(number) or nil
end

-- An asker with a small tile that took far too long gets his small tiles one by one from one worker at a time, so that
-- they hold up nobody else.
local function is_alone(asker)
  return redis.call('EXISTS', key('overran', asker)) == 1
end

local function may_take_alone()
  local other = redis.call('GET', key('alone', fingerprint))
  if #found > 1 or not other or other == holder or not alive(other) then
    return #found == 1
  end
  for _, claim in ipairs(claims_of(other)) do
    if is_alone(get(claim[1], 'asker') or '') then
      return false
    end
  end
  return true
end

-- Whether this worker may take a tile that is long by itself: such tiles leave one worker free, where there are several.
local function may_take_long()
  local others, with_long = 0, 0
  for _, worker in ipairs(live_workers()) do
    local described = cjson.decode(worker[2])
    if worker[1] ~= holder and described.fingerprint == fingerprint and not described.small then
      others = others + 1
      for _, claim in ipairs(claims_of(worker[1])) do
        if get(claim[1], 'long_tiles') == '1' then
          with_long = with_long + 1
          break
        end
      end
    end
  end
  return with_long < math.max(1, others)
end

-- Whether the job that is next in a flow may have a tile of a worker's time while a tile of another one is stopped: the
-- tile of a long job is stopped for everybody's short ones, any other tile only for those of other askers.
local function may_interrupt(flow, asker)
  local lane, other = unpack(redis.call('HMGET', key('job', given.stopped), 'lane', 'asker'))
  if lane ~= 'long' and other == asker then
    return false
  end
  local id = redis.call('ZRANGE', key('flow', fingerprint, flow), 0, 0)[1]
  local since = id and redis.call('ZSCORE', key('waiting', 'short'), id)
  return since and tonumber(now()) - tonumber(since) >= given.waited
end

local function claimable(flow)
  local place, kernels, _, asker = string.match(flow, '^([^|]*)|([^|]*)|([^|]*)|(.*)$')
  local lane, long_tiles = string.match(place, '^(%a+)(.*)$')
  return contains(given.lanes, lane)
    and contains(given.kernels, kernels)
    and (long_tiles == '' or may_take_long())
    and (lane ~= 'small' or not is_alone(asker) or may_take_alone())
    and (not given.stopped or may_interrupt(flow, asker))
end

-- Claims one tile of the job that is next in a flow; returns its seconds, or nil if the job had none.
local function serve(flow)
  local jobs = key('flow', fingerprint, flow)
  local id = redis.call('ZRANGE', jobs, 0, 0)[1]
  local status = get(id, 'status')
  local tile = status and unfinished(status) and next_tile(id)
  if not tile then
    withdraw(id)
    redis.call('ZREM', jobs, id)
    return nil
  end
  local cost = number(id, 'cost')
  local charged = cost / math.max(1e-6, number(id, 'weight'))
  local served = tonumber(redis.call('ZSCORE', flows, flow) or 0)
  local clock = clock_of(fingerprint, flow)
  local reached = tonumber(redis.call('HGET', key('clocks'), clock) or 0)
  redis.call('HSET', key('clocks'), clock, math.max(reached, served))
  redis.call('ZADD', flows, served + charged, flow)
  local own = tonumber(redis.call('ZSCORE', jobs, id)) + charged
  redis.call('ZADD', jobs, own, id)
  redis.call('HSET', key('job', id), 'served', own)
  take(id, tile)
  if get(id, 'lane') == 'small' and is_alone(get(id, 'asker') or '') then
    redis.call('SET', key('alone', fingerprint), holder)
    cost = given.seconds -- and nothing else with it
  end
  if redis.call('EXISTS', key('job', id, 'again')) == 0 and number(id, 'next') >= number(id, 'total') then
    withdraw(id)
  else
    redis.call('ZADD', key('waiting', get(id, 'lane')), 'XX', now(), id)
  end
  return cost
end

-- Claims a given tile of a job, unless it is done or held.
local function take_given(id, tile)
  local status, bound = unpack(redis.call('HMGET', key('job', id), 'status', 'fingerprint'))
  if not (status and unfinished(status)) or (bound ~= '' and bound ~= fingerprint) then
    return
  end
  local done, total = number(id, 'done'), number(id, 'total')
  if (tile == ASSEMBLY and done < total) or tonumber(tile) >= total
    or redis.call('HEXISTS', key('job', id, 'tiles'), tile) == 1 then
    return
  end
  local other = claimed_by(id, tile)
  if other and other ~= holder then
    if alive(other) then
      return
    end
    redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':lost', 1)
  end
  bind_to(id, fingerprint)
  take(id, tile)
  offer(id)
end

if given.job then
  take_given(given.job, given.tile)
  return found
end

-- the index of what a holder has grows by each claim
if redis.call('SCARD', key('held', holder)) > MOST_HELD then
  claims_of(holder)
end

local function next_flow()
  local start = 0
  while true do
    local some = redis.call('ZRANGE', flows, start, start + 99)
    for _, flow in ipairs(some) do
      if claimable(flow) then
        return flow
      end
    end
    if #some < 100 then
      return nil
    end
    start = start + 100
  end
end

local flow = next_flow()
while flow and #found <= given.most and spent < given.seconds and bytes < given.most_bytes do
  spent = spent + (serve(flow) or 0)
  if redis.call('EXISTS', key('flow', fingerprint, flow)) == 0 then
    redis.call('ZREM', flows, flow)
  end
  flow = next_flow()
end
found[1] = flow and 1 or 0
return found
