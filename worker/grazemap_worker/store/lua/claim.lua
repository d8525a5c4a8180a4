-- Claims the next tiles, fairly among flows, or one named tile. Arguments: holder, fingerprint, lease (milliseconds).
-- For the next tiles: lanes, kernels, most (number of tiles), seconds (estimate of these tiles together), most_bytes
-- (of their requests). While a compute process is stopped also: stopped (the job of its tile) and waited (seconds for
-- which other jobs must have waited). For a named tile: job, tile.
-- Returns {{process, id} of a job with more tiles to claim, or {}; {id, tile, process, request, core version, plan,
-- estimate, lane, seconds of processor time that the job may still take}, ...}.
local holder, fingerprint = args.holder, args.fingerprint
local MAX_HELD = 100
local flows, answer, spent, bytes = key('flows', fingerprint), { {} }, 0, 0

local function take(id, tile)
  redis.call('HSET', key('job', id, 'claims'), tile, holder .. '|' .. now())
  redis.call('SREM', key('job', id, 'again'), tile)
  redis.call('SADD', key('held', holder), id .. '|' .. tile)
  redis.call('SADD', key('holders'), holder)
  renew(holder, args.lease)
  if get(id, 'status') ~= 'running' then
    redis.call('HSET', key('job', id), 'started', now())
    set_status(id, 'running')
    progress_event(id)
  end
  local fields = redis.call('HMGET', key('job', id), 'process', 'request', 'core_version', 'plan', 'estimate', 'lane')
  fields[#fields + 1] = tostring(left_of(id))
  answer[#answer + 1] = { id, tile, unpack(fields) }
  bytes = bytes + string.len(fields[2] or '')
end

-- The next tile of a job that is neither finished nor claimed; nil: there is none.
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

-- Whether a small tile of an asker took far too long lately. Then the small tiles of this asker are claimed one by one,
-- by one worker at a time, so that they do not delay the tiles of others.
local function is_alone(asker)
  return redis.call('EXISTS', key('overran', asker)) == 1
end

-- Whether this worker may claim a small tile of such an asker: it has claimed nothing else, and no other live worker
-- holds such a tile.
local function may_take_alone()
  local last_holder = redis.call('GET', key('alone', fingerprint))
  if #answer > 1 or not last_holder or last_holder == holder or not alive(last_holder) then
    return #answer == 1
  end
  for _, claim in ipairs(claims_of(last_holder)) do
    if is_alone(get(claim[1], 'asker') or '') then
      return false
    end
  end
  return true
end

-- Whether this worker may claim a long tile. If there are several workers, one of them is kept free of long tiles.
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

-- Whether a tile of the next job in a flow may be computed while the tile of the job `stopped` is stopped. The tile of
-- a long job is stopped for short tiles of any asker, another tile only for those of other askers. The next job must
-- have waited long enough.
local function may_interrupt(flow, asker)
  local lane, stopped_asker = unpack(redis.call('HMGET', key('job', args.stopped), 'lane', 'asker'))
  if lane ~= 'long' and stopped_asker == asker then
    return false
  end
  local id = redis.call('ZRANGE', key('flow', fingerprint, flow), 0, 0)[1]
  local since = id and redis.call('ZSCORE', key('waiting', 'short'), id)
  return since and tonumber(now()) - tonumber(since) >= args.waited
end

local function claimable(flow)
  local place, kernels, _, asker = string.match(flow, '^([^|]*)|([^|]*)|([^|]*)|(.*)$')
  if not place then
    return false -- another program wrote it
  end
  local lane, long_tiles = string.match(place, '^(%a+)(.*)$')
  return contains(args.lanes, lane)
    and contains(args.kernels, kernels)
    and (long_tiles == '' or may_take_long())
    and (lane ~= 'small' or not is_alone(asker) or may_take_alone())
    and (not args.stopped or may_interrupt(flow, asker))
end

-- Claims one tile of the next job in a flow; returns its estimated seconds, or nil if the job has no tile to claim.
local function serve(flow)
  local jobs = key('flow', fingerprint, flow)
  local id = redis.call('ZRANGE', jobs, 0, 0)[1]
  local tile = unfinished(get(id, 'status')) and next_tile(id)
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
  local job_served = tonumber(redis.call('ZSCORE', jobs, id)) + charged
  redis.call('ZADD', jobs, job_served, id)
  redis.call('HSET', key('job', id), 'served', job_served)
  take(id, tile)
  if get(id, 'lane') == 'small' and is_alone(get(id, 'asker') or '') then
    redis.call('SET', key('alone', fingerprint), holder)
    cost = args.seconds -- so that no other tile is claimed with this one
  end
  if redis.call('EXISTS', key('job', id, 'again')) == 0 and number(id, 'next') >= number(id, 'total') then
    withdraw(id)
  else
    redis.call('ZADD', key('waiting', get(id, 'lane')), 'XX', now(), id)
  end
  return cost
end

-- Claims a named tile of a job, unless it is finished or a live worker holds it.
local function take_named(id, tile)
  local status, bound = unpack(redis.call('HMGET', key('job', id), 'status', 'fingerprint'))
  if not unfinished(status) or (bound ~= '' and bound ~= fingerprint) then
    return
  end
  local done, total = number(id, 'done'), number(id, 'total')
  if (tile == ASSEMBLY and done < total) or tonumber(tile) >= total
    or redis.call('HEXISTS', key('job', id, 'tiles'), tile) == 1 then
    return
  end
  local previous = claimed_by(id, tile)
  if previous and previous ~= holder then
    if alive(previous) then
      return
    end
    redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':lost', 1)
  end
  bind_to(id, fingerprint)
  take(id, tile)
  offer(id)
end

if args.job then
  take_named(args.job, args.tile)
  return answer
end

-- the index of a holder's claims grows with each claim, and `claims_of` shortens it
if redis.call('SCARD', key('held', holder)) > MAX_HELD then
  claims_of(holder)
end

local function next_flow()
  local start = 0
  while true do
    local page = redis.call('ZRANGE', flows, start, start + 99)
    for _, flow in ipairs(page) do
      if claimable(flow) then
        return flow
      end
    end
    if #page < 100 then
      return nil
    end
    start = start + 100
  end
end

local flow = next_flow()
while flow and #answer <= args.most and spent < args.seconds and bytes < args.most_bytes do
  spent = spent + (serve(flow) or 0)
  if redis.call('EXISTS', key('flow', fingerprint, flow)) == 0 then
    redis.call('ZREM', flows, flow)
  end
  flow = next_flow()
end
if flow then
  local id = redis.call('ZRANGE', key('flow', fingerprint, flow), 0, 0)[1] or ''
  answer[1] = { get(id, 'process') or '', id }
end
return answer
