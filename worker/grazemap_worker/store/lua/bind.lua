-- ARGV: prefix, fingerprint, core version, seconds a version is remembered, ids ... Binds jobs of that core version to
-- the numerics that will compute them, when they are bound to none, or to some whose workers are all long gone (their
-- tiles are then computed again).
-- Returns {ids that were bound, ids that nobody can compute any more: no worker had their core version for as long as
-- it is remembered}.
local fingerprint, bound_now, outdated = ARGV[2], {}, {}

local function bind(id)
  local status, version, created, bound =
    unpack(redis.call('HMGET', key('job', id), 'status', 'core_version', 'created', 'fingerprint'))
  if not (status and unfinished(status)) then
    return
  end
  if version ~= ARGV[3] then
    local young = tonumber(now()) - tonumber(created) < tonumber(ARGV[4])
    if not young and redis.call('EXISTS', key('version', version)) == 0 then
      outdated[#outdated + 1] = id
    end
    return
  end
  if bound == fingerprint or (bound ~= '' and redis.call('EXISTS', key('fingerprint', bound)) == 1) then
    return
  end
  if bound ~= '' then
    redis.call('DEL', key('job', id, 'tiles'), key('job', id, 'claims'))
    redis.call('HSET', key('job', id), 'done', 0, 'cpu_seconds', 0)
    set_remaining(id, number(id, 'total'))
    progress_event(id)
  end
  redis.call('HSET', key('job', id), 'fingerprint', fingerprint)
  bound_now[#bound_now + 1] = id
end

for i = 5, #ARGV do
  bind(ARGV[i])
end
return { bound_now, outdated }
