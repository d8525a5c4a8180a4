"""RQ jobs that run the core; nothing is imported here, so that the service can import the store alone."""
