-- Returns {name, description} of the live workers, and forgets the others.
return live_workers()
