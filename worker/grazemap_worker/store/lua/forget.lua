-- Forgets a job whose record cannot be read, and counts it. Argument: id.
forget(given.id)
count('poisoned:records')
return 1
