"""RQ: entries for tiles, the worker that performs them, cleaning up after killed workers; nothing is imported here."""
