-- Returns {size, etag, npz} of the result of a job, without npz if it has more than `most` bytes, and makes it the most
-- recently used one. Returns nil if there is no result (any more). Arguments: id, most.
local name = result_key(args.id)
if get(args.id, 'status') ~= 'successful' or redis.call('EXISTS', name) == 0 then
  return nil
end
local clock = redis.pcall('INCR', key('clock'))
if type(clock) == 'number' then -- else Redis refuses writes, as on a full disk, and the order stays
  redis.pcall('ZADD', key('results', class_of(args.id)), 'XX', clock, name)
end
local size, etag = unpack(redis.call('HMGET', key('job', args.id), 'size', 'etag'))
return { size, etag, tonumber(size) <= args.most and redis.call('GET', name) or nil }
