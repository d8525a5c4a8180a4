-- Counts a failed attempt at a tile and frees the tile. The job fails when `most` attempts have failed in the same way.
-- Arguments: id, tile, kind (of the failure), most (0: nothing is counted), holder (of the failed attempt; '': any),
-- problem (of a job that fails), kept (seconds for which its tiles are kept).
-- Returns 1 if the tile may be tried again, 0 if the job is over.
local id, tile = args.id, tostring(args.tile)
if not unfinished(get(id, 'status')) then
  return 0
end
if args.holder ~= '' and claimed_by(id, tile) ~= args.holder then
  return 1 -- another holder has claimed or finished the tile: nothing was lost
end
redis.call('HDEL', key('job', id, 'claims'), tile)
if args.most > 0 then
  count('failures:' .. args.kind)
  if redis.call('HINCRBY', key('job', id, 'failures'), tile .. ':' .. args.kind, 1) >= args.most then
    fail(id, args.problem, args.kept)
    return 0
  end
  if get(id, 'lane') == 'small' then
    move(id, 'short') -- from now on the tile is computed in a compute process
  end
end
again(id, tile)
return 1
