-- ARGV: prefix, id, fingerprint, core version, seconds a version is remembered. Binds a job of that core version to the
-- numerics that will compute it, when it is bound to none, or to one whose workers are all long gone (its tiles are
-- then computed again).
-- Returns 1 when it was bound by this call, 2 when nobody can compute it any more: no worker had its core version for
-- as long as it is remembered.
local id, fingerprint = ARGV[2], ARGV[3]
local status = get(id, 'status')
if not (status and unfinished(status)) then
  return 0
end
local version = get(id, 'core_version')
if version ~= ARGV[4] then
  local young = tonumber(now()) - tonumber(get(id, 'created')) < tonumber(ARGV[5])
  return (young or redis.call('EXISTS', key('version', version)) == 1) and 0 or 2
end
local bound = get(id, 'fingerprint')
if bound == fingerprint or (bound ~= '' and redis.call('EXISTS', key('fingerprint', bound)) == 1) then
  return 0
end
if bound ~= '' then
  redis.call('DEL', key('job', id, 'tiles'), key('job', id, 'claims'))
  redis.call('HSET', key('job', id), 'done', 0)
  redis.call('HSET', key('unfinished'), id, number(id, 'total'))
  progress_event(id)
end
redis.call('HSET', key('job', id), 'fingerprint', fingerprint)
return 1
