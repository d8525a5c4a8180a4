-- Gives a role to a holder, unless another holder has it. A holder keeps the role for so many milliseconds after each
-- call. Arguments: role, holder, milliseconds. Returns 1 if the holder has the role.
local name = key('lead', args.role)
if redis.call('GET', name) ~= args.holder and lasts(name, args.milliseconds) then
  return 0
end
redis.call('SET', name, args.holder, 'PX', args.milliseconds)
return 1
