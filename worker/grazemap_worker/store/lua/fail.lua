-- ARGV: prefix, id, problem, seconds to keep the tiles. Returns 1 when this ended the job.
local status = get(ARGV[2], 'status')
if not (status and unfinished(status)) then
  return 0
end
redis.call('HSET', key('job', ARGV[2]), 'problem', ARGV[3])
finish(ARGV[2], 'failed', tonumber(ARGV[4]))
return 1
