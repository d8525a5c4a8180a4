-- Arguments: id, most (bytes up to which they are wanted). Returns {size, etag} or {size, etag, npz}, or nil when there is no
-- result (any more). It becomes the most recently used one.
local name = result_key(given.id)
if get(given.id, 'status') ~= 'successful' or redis.call('EXISTS', name) == 0 then
  return nil
end
touch(given.id)
local size, etag = unpack(redis.call('HMGET', key('job', given.id), 'size', 'etag'))
return { size, etag, tonumber(size) <= given.most and redis.call('GET', name) or nil }
