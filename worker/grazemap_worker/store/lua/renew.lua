-- Registers a worker, or renews its lease. Arguments: holder, lease (milliseconds), description {fingerprint,
-- core_version, ...}, remembered (seconds for which fingerprint and core version are remembered), job (that the worker
-- computes; '': none).
-- Returns 1 while the job is unfinished, or if there is none; 0 when the job is over, so that the worker can stop.
renew(args.holder, args.lease)
redis.call('HSET', key('workers'), args.holder, cjson.encode(args.description))
redis.call('SET', key('fingerprint', args.description.fingerprint), 1, 'EX', args.remembered)
redis.call('SET', key('version', args.description.core_version), 1, 'EX', args.remembered)
return args.job ~= '' and redis.call('HEXISTS', key('unfinished'), args.job) or 1
