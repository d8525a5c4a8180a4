-- Removes a job whose record cannot be read, and counts it. Argument: id.
forget(args.id)
count('poisoned:records')
