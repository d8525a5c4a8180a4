-- Registers a worker or renews its lease. Arguments: holder, lease (milliseconds), description {fingerprint,
-- core_version, ...}, remembered (seconds for which fingerprint and version are), job ('': none).
-- Returns 1 while the job is wanted, 0 when it is over, so that a worker that computes it can stop.
renew(given.holder, given.lease)
redis.call('HSET', key('workers'), given.holder, cjson.encode(given.description))
redis.call('SET', key('fingerprint', given.description.fingerprint), 1, 'EX', given.remembered)
redis.call('SET', key('version', given.description.core_version), 1, 'EX', given.remembered)
return given.job ~= '' and redis.call('HEXISTS', key('unfinished'), given.job) or 1
