-- Returns a page of a list of jobs. Arguments: index (the sorted set of jobs), before (the first score of
-- ZREVRANGEBYSCORE), most (jobs on the page), examined (jobs to look at), process, group, class_ (small, large; '':
-- any), longest (bytes of a request that is returned; longer ones are left out, so that a page is never large).
-- Returns {jobs that are selected, newest first, each {id, sequence number, names and values of its record}; the
-- sequence number of the last job that was looked at, if there may be jobs after it}.
local page = {}

local function listed(id)
  local process, groups = unpack(redis.call('HMGET', key('job', id), 'process', 'groups'))
  return (args.process == '' or process == args.process)
    and (args.group == '' or string.find(groups or '', '|' .. args.group .. '|', 1, true))
    and (args.class_ == '' or class_of(id) == args.class_)
end

local ids = redis.call('ZREVRANGEBYSCORE', args.index, args.before, '-inf', 'WITHSCORES', 'LIMIT', 0, args.examined)
for i = 1, #ids, 2 do
  local id, seq = ids[i], ids[i + 1]
  if listed(id) then
    page[#page + 1] = { id, seq, record(id, args.longest) }
  end
  if #page == args.most then
    return { page, seq }
  end
end
return { page, #ids == 2 * args.examined and ids[#ids] }
