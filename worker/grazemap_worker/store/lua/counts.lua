-- Returns as JSON what the store holds and what happens in it; an empty list is {}.
local counts = {
  jobs = {},
  pending_tiles = tonumber(redis.call('GET', key('unfinished', 'tiles')) or 0),
  results = redis.call('HLEN', key('results', 'sizes')),
  budget = tonumber(redis.call('GET', key('budget')) or nil),
  bytes = {},
  events = {},
  waiting = {},
  workers = {},
  claimed_seconds = 0,
}
for _, status in ipairs({ 'accepted', 'running', 'successful', 'failed', 'dismissed' }) do
  counts.jobs[status] = redis.call('ZCARD', key('status', status))
end
for _, name in ipairs({ 'bytes', 'counts' }) do
  local all = redis.call('HGETALL', key(name))
  for i = 1, #all, 2 do
    counts[name == 'counts' and 'events' or name][all[i]] = tonumber(all[i + 1])
  end
end

local function seconds_since(time)
  return math.max(0, tonumber(now()) - tonumber(time))
end

for _, lane in ipairs({ 'small', 'short', 'long' }) do
  local first = redis.call('ZRANGE', key('waiting', lane), 0, 0, 'WITHSCORES')
  counts.waiting[lane] = {
    jobs = redis.call('ZCARD', key('waiting', lane)),
    seconds = first[2] and seconds_since(first[2]) or 0,
  }
end

-- The claim that a holder has had for longest; nil: it has none.
local function computed_by(holder)
  local longest
  for _, claim in ipairs(claims_of(holder)) do
    local _, since = claimed_by(claim[1], claim[2])
    local seconds = since and seconds_since(since) or 0
    if not longest or seconds > longest.seconds then
      longest = { job = claim[1], tile = tonumber(claim[2]), seconds = seconds, process = get(claim[1], 'process') }
    end
  end
  return longest
end

local computed = {}
for _, holder in ipairs(redis.call('SMEMBERS', key('holders'))) do
  computed[holder] = computed_by(holder)
  counts.claimed_seconds = math.max(counts.claimed_seconds, computed[holder] and computed[holder].seconds or 0)
end
for _, worker in ipairs(live_workers()) do
  local described = cjson.decode(worker[2])
  counts.workers[#counts.workers + 1] = {
    small = described.small,
    core_version = described.core_version,
    computes = computed[worker[1]],
  }
end
return cjson.encode(counts)
