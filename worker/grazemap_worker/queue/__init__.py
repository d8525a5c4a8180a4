"""RQ: entries for tiles, the worker that performs them, and what killed workers leave; nothing is imported here."""
