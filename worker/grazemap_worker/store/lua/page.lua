-- Arguments: index, before (ZREVRANGEBYSCORE's first score), most (jobs), examined (jobs), process, group, class (small,
-- large; '': any), longest (request).
-- Returns the jobs that fit among the next ones, newest first, as {id, sequence number, names and values of its record},
-- and the sequence number of the last job that was examined if there may be others after it. Longer requests are left
-- out, so that a page is never large.
local found = {}

local function listed(id)
  local process, groups = unpack(redis.call('HMGET', key('job', id), 'process', 'groups'))
  return (given.process == '' or process == given.process)
    and (given.group == '' or string.find(groups or '', '|' .. given.group .. '|', 1, true))
    and (given.class_ == '' or class_of(id) == given.class_)
end

local ids = redis.call('ZREVRANGEBYSCORE', given.index, given.before, '-inf', 'WITHSCORES', 'LIMIT', 0, given.examined)
for i = 1, #ids, 2 do
  local id, seq = ids[i], ids[i + 1]
  if listed(id) then
    found[#found + 1] = { id, seq, record(id, given.longest) }
  end
  if #found == given.most then
    return { found, seq }
  end
end
return { found, #ids == 2 * given.examined and ids[#ids] }
