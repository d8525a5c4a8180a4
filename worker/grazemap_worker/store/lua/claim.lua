-- ARGV: prefix, id, tile, holder, fingerprint, lease in milliseconds, assembly tile number,
--       core version ('' = any).
-- Returns {process, request, core version, plan, estimate} or nil.
local id, tile, holder, fingerprint, lease = ARGV[2], ARGV[3], ARGV[4], ARGV[5], ARGV[6]
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return nil
end
local bound = get(id, 'fingerprint')
if bound ~= '' and bound ~= fingerprint or ARGV[8] ~= '' and get(id, 'core_version') ~= ARGV[8] then
  return nil
end
if tile == ARGV[7] then
  if number(id, 'done') < number(id, 'total') then
    return nil
  end
elseif redis.call('HEXISTS', key('job', id, 'tiles'), tile) == 1 or tonumber(tile) >= number(id, 'total') then
  return nil
end
local other = claimed_by(id, tile)
if other and other ~= holder then
  if alive(other) then
    return nil
  end
  redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':lost', 1)
end
redis.call('HSET', key('job', id, 'claims'), tile, holder .. '|' .. now())
redis.call('SADD', key('held', holder), id .. '|' .. tile)
redis.call('SADD', key('holders'), holder)
redis.call('SET', key('worker', holder), fingerprint, 'PX', lease)
if bound == '' then
  redis.call('HSET', key('job', id), 'fingerprint', fingerprint)
end
if status == 'accepted' then
  redis.call('HSET', key('job', id), 'started', now())
  set_status(id, 'running')
  progress_event(id)
end
return redis.call('HMGET', key('job', id), 'process', 'request', 'core_version', 'plan', 'estimate')
