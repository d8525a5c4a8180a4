-- Arguments: index, before (ZREVRANGEBYSCORE's first score), most (jobs), process, group, class (small, large;
-- '': any), longest (request).
-- Returns, for each job of a page, newest first: {id, sequence number, names and values of its record}. Longer requests
-- are left out, so that a page is never large. One job more than asked for says that there is a next page.
local found, offset = {}, 0

local function listed(id)
  local process, groups = unpack(redis.call('HMGET', key('job', id), 'process', 'groups'))
  return (given.process == '' or process == given.process)
    and (given.group == '' or string.find(groups or '', '|' .. given.group .. '|', 1, true))
    and (given.class_ == '' or class_of(id) == given.class_)
end

while #found < given.most do
  local ids = redis.call('ZREVRANGEBYSCORE', given.index, given.before, '-inf', 'WITHSCORES', 'LIMIT', offset, given.most)
  for i = 1, #ids, 2 do
    local id = ids[i]
    if #found < given.most and listed(id) then
      found[#found + 1] = { id, ids[i + 1], record(id, given.longest) }
    end
  end
  if #ids < 2 * given.most then
    break
  end
  offset = offset + given.most
end
return found
