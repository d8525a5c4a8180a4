-- ARGV: prefix, holder, lease in milliseconds, seconds a fingerprint is remembered. Returns 0 when the lease ran out.
local fingerprint = redis.call('GET', key('worker', ARGV[2]))
if not fingerprint then
  return 0
end
redis.call('PEXPIRE', key('worker', ARGV[2]), ARGV[3])
redis.call('SET', key('fingerprint', fingerprint), 1, 'EX', ARGV[4])
return 1
