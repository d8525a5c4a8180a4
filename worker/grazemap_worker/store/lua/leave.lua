-- Removes a worker that has ended. Arguments: holder, give_back (whether its claims are freed without counting a
-- failure).
redis.call('DEL', key('worker', args.holder))
redis.call('HDEL', key('workers'), args.holder)
if args.give_back then
  for _, claim in ipairs(claims_of(args.holder)) do
    redis.call('HDEL', key('job', claim[1], 'claims'), claim[2])
    again(claim[1], claim[2])
  end
  redis.call('DEL', key('held', args.holder))
  redis.call('SREM', key('holders'), args.holder)
end
