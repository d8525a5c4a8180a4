-- ARGV: prefix, holder, '1' to give its claims back uncounted. A worker that is gone for certain.
redis.call('DEL', key('worker', ARGV[2]))
redis.call('HDEL', key('workers'), ARGV[2])
if ARGV[3] == '1' then
  for _, id in ipairs(redis.call('HKEYS', key('unfinished'))) do
    local claims = redis.call('HGETALL', key('job', id, 'claims'))
    for i = 1, #claims, 2 do
      if split_claim(claims[i + 1]) == ARGV[2] then
        redis.call('HDEL', key('job', id, 'claims'), claims[i])
      end
    end
  end
end
return 1
