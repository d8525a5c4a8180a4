-- ARGV: prefix, index, first score (ZREVRANGEBYSCORE's), most jobs, process ('' = any), longest request.
-- Returns, for each job of a page, newest first: {id, sequence number, names and values of its record}. Longer requests
-- are left out, so that a page is never large. One job more than asked for says that there is a next page.
local most, process, longest = tonumber(ARGV[4]), ARGV[5], tonumber(ARGV[6])
local found, offset, chunk = {}, 0, most
while #found < most do
  local ids = redis.call('ZREVRANGEBYSCORE', ARGV[2], ARGV[3], '-inf', 'LIMIT', offset, chunk)
  for _, id in ipairs(ids) do
    local record = key('job', id)
    if #found < most and (process == '' or get(id, 'process') == process) then
      local fields = redis.call('HSTRLEN', record, 'request') <= longest and { 'request', get(id, 'request') } or {}
      for _, name in ipairs(redis.call('HKEYS', record)) do
        if name ~= 'request' then
          fields[#fields + 1] = name
          fields[#fields + 1] = get(id, name)
        end
      end
      found[#found + 1] = { id, get(id, 'seq'), fields }
    end
  end
  if #ids < chunk then
    break
  end
  offset = offset + chunk
end
return found
