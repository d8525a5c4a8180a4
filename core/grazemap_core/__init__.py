"""The impact core: numerics only (numpy, scipy, numba); no I/O, no HTTP, no Redis.

Packages, each of which imports only those to its left:

    numerics < model < contact < simulation < grazing < orbits < continuation < maps < proofs

`errors`, `codes`, `arrays`, `records` and `tolerances` are shared by all of them. The compiled functions of
a package are in its `kernels`: they take arrays and numbers, return values and a status, and never raise.
"""

from grazemap_core.compiled_ahead import choose_processor

choose_processor()

from grazemap_core.kernel_folder import choose_cache  # noqa: E402  # it imports numba

choose_cache()
