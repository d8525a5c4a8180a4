-- Starts a job, unless it is there already. Arguments: id, process, core_version, estimate, tiles, after (steps of
-- putting the tiles together; 0: only tiles are counted), lane, kernels, asker, priority, weight, cost (seconds of a
-- tile), and the limits: most_seconds (of processor time of the job; left out: none), most_tiles, asker_tiles (of this
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
if status == 'successful' and redis.call('EXISTS', result_key(id)) == 1 then
  return { 'there', seen(id) }
end

-- The numerics of most of the live workers of that core version; '' when there are none.
local function fingerprint_of_most()
  local counts, most, found = {}, 0, ''
  for _, worker in ipairs(live_workers()) do
    local described = cjson.decode(worker[2])
    if described.core_version == given.core_version then
      local name = described.fingerprint
      counts[name] = (counts[name] or 0) + 1
      if counts[name] > most or (counts[name] == most and name < found) then
        most, found = counts[name], name
      end
    end
  end
  return found
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
local fingerprint, kept = fingerprint_of_most(), 0
if status == 'failed' and fingerprint ~= '' and get(id, 'fingerprint') == fingerprint then
  kept = redis.call('HLEN', key('job', id, 'tiles'))
end
if waiting + total - kept > given.most_tiles then
  return { 'full', waiting }
end
local own = tonumber(redis.call('HGET', key('unfinished', 'askers'), given.asker) or 0)
if given.asker_tiles and own > 0 and own + total - kept > given.asker_tiles then
  return { 'quota', own }
end

local before = {}
if kept > 0 then
  before = { 'cpu_seconds', get(id, 'cpu_seconds') or 0, 'tile_bytes', number(id, 'tile_bytes') }
  redis.call('ZREM', key('tiles', 'kept'), id)
else
  drop_tiles(id)
end
-- the tag of a result that is computed again, for clients that have it
local etag = get(id, 'etag')
if etag then
  before[#before + 1] = 'etag'
  before[#before + 1] = etag
end
if groups() ~= '|' then
  before[#before + 1] = 'groups'
  before[#before + 1] = groups()
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
  'fingerprint', fingerprint, 'lane', given.lane, 'kernels', given.kernels, 'asker', given.asker, 'priority',
  given.priority, 'weight', given.weight, 'cost', given.cost, 'created', now(), unpack(before))
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
