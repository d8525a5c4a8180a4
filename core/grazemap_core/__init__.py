"""The impact core: numerics only (numpy, scipy, numba); no I/O, no HTTP, no Redis."""
