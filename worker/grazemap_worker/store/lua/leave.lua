-- A worker that is gone for certain. Arguments: holder, give_back (its claims, uncounted).
redis.call('DEL', key('worker', given.holder))
redis.call('HDEL', key('workers'), given.holder)
if given.give_back then
  for _, claim in ipairs(claims_of(given.holder)) do
    redis.call('HDEL', key('job', claim[1], 'claims'), claim[2])
    again(claim[1], claim[2])
  end
  redis.call('DEL', key('held', given.holder))
  redis.call('SREM', key('holders'), given.holder)
end
return 1
