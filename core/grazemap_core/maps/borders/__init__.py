"""borders."""
