-- ARGV: prefix, holder, lease in milliseconds, seconds a fingerprint is remembered. Returns 0 when the lease ran out,
-- or did once so that the worker was forgotten (a claim takes the lease again): it has to register.
local fingerprint = redis.call('GET', key('worker', ARGV[2]))
local description = redis.call('HGET', key('workers'), ARGV[2])
if not (fingerprint and description) then
  return 0
end
redis.call('PEXPIRE', key('worker', ARGV[2]), ARGV[3])
redis.call('SET', key('fingerprint', fingerprint), 1, 'EX', ARGV[4])
redis.call('SET', key('version', cjson.decode(description).core_version), 1, 'EX', ARGV[4])
return 1
