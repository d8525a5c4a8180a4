"""RQ: entries that wake workers, the worker that takes them, the clean-up after killed workers. It imports nothing."""
