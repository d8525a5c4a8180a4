"""grazing."""
