-- ARGV: prefix, id. Returns {size, etag}, or nil when there is no result (any more).
if get(ARGV[2], 'status') ~= 'successful' or redis.call('EXISTS', result_key(ARGV[2])) == 0 then
  return nil
end
return redis.call('HMGET', key('job', ARGV[2]), 'size', 'etag')
