-- Returns {name, description} of each live worker, and removes the others.
return live_workers()
