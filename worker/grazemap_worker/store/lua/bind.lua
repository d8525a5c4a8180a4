-- Binds unfinished jobs of a core version to the numerics that will compute them, when they are bound to none, or to
-- some whose workers are all long gone (their tiles are then computed again). Arguments: fingerprint, core_version,
-- remembered (seconds for which a version is), ids.
-- Returns {ids that were bound, ids that nobody can compute any more: no worker had their core version for as long as
-- it is remembered}.
local bound_now, outdated = {}, {}

local function bind(id)
  local status, version, created, bound =
    unpack(redis.call('HMGET', key('job', id), 'status', 'core_version', 'created', 'fingerprint'))
  if not (status and unfinished(status)) then
    return
  end
  if version ~= given.core_version then
    local young = tonumber(now()) - (tonumber(created) or 0) < given.remembered
    if not young and not lasts(key('version', version), 1000 * given.remembered) then
      outdated[#outdated + 1] = id
    end
    return
  end
  if bound == given.fingerprint then
    offer(id)
    return
  end
  if bound ~= '' and lasts(key('fingerprint', bound), 1000 * given.remembered) then
    return
  end
  if bound ~= '' then
    withdraw(id)
    drop_tiles(id)
    redis.call('DEL', key('job', id, 'claims'), key('job', id, 'again'))
    redis.call('HSET', key('job', id), 'done', 0, 'cpu_seconds', 0, 'next', 0)
    set_remaining(id, number(id, 'total'))
    progress_event(id)
  end
  bind_to(id, given.fingerprint)
  offer(id)
  bound_now[#bound_now + 1] = id
end

for _, id in ipairs(given.ids) do
  bind(id)
end
return { bound_now, outdated }
