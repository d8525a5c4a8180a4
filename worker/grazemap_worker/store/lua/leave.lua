-- ARGV: prefix, holder, '1' to give its claims back uncounted. A worker that is gone for certain.
redis.call('DEL', key('worker', ARGV[2]))
redis.call('HDEL', key('workers'), ARGV[2])
if ARGV[3] == '1' then
  for _, claim in ipairs(claims_of(ARGV[2])) do
    redis.call('HDEL', key('job', claim[1], 'claims'), claim[2])
  end
  redis.call('DEL', key('held', ARGV[2]))
  redis.call('SREM', key('holders'), ARGV[2])
end
return 1
