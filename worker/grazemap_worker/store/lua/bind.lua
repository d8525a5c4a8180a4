-- Binds unfinished jobs of a core version to a fingerprint: jobs that are bound to none, or to one that no live worker
-- has had for `remembered` seconds (then their tiles are computed again). Arguments: fingerprint, core_version,
-- remembered, ids.
-- Returns {ids that were bound, ids of jobs whose core version no worker has had for `remembered` seconds}.
local bound_now, outdated = {}, {}

local function bind(id)
  local status, version, created, bound =
    unpack(redis.call('HMGET', key('job', id), 'status', 'core_version', 'created', 'fingerprint'))
  if not unfinished(status) then
    return
  end
  if version ~= args.core_version then
    local young = tonumber(now()) - (tonumber(created) or 0) < args.remembered
    if not young and not lasts(key('version', version), 1000 * args.remembered) then
      outdated[#outdated + 1] = id
    end
    return
  end
  if bound == args.fingerprint then
    offer(id)
    return
  end
  if bound ~= '' and lasts(key('fingerprint', bound), 1000 * args.remembered) then
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
  bind_to(id, args.fingerprint)
  offer(id)
  bound_now[#bound_now + 1] = id
end

for _, id in ipairs(args.ids) do
  bind(id)
end
return { bound_now, outdated }
