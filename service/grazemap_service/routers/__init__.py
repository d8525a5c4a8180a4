"""One router per process, and those of jobs, results and health."""
