-- ARGV: prefix, id. Ends an unfinished job and frees its tiles; anything else is left as it is.
local status = get(ARGV[2], 'status')
if status and unfinished(status) then
  finish(ARGV[2], 'dismissed', 0)
end
return status
