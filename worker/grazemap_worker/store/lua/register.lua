-- ARGV: prefix, holder, fingerprint, lease in milliseconds, seconds a fingerprint is remembered, description,
--       core version.
redis.call('SET', key('worker', ARGV[2]), ARGV[3], 'PX', ARGV[4])
redis.call('SET', key('fingerprint', ARGV[3]), 1, 'EX', ARGV[5])
redis.call('SET', key('version', ARGV[7]), 1, 'EX', ARGV[5])
redis.call('HSET', key('workers'), ARGV[2], ARGV[6])
return 1
