"""The peak of one core of this machine, measured: fused multiply-adds in double precision a second.

Independent chains of ``y = a y + b`` in registers, enough of them to hide the latency, in vectors as wide as LLVM
finds for this machine. No kernel of the same machine can be faster, so this is the denominator of every share of peak.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit

from benchmarks.work import Floats

LANES = 256
CHAINS = 4
UNROLLED = 32


@njit(inline="always", error_model="numpy", fastmath={"contract"})
def _eight_steps(y: float, a: float, b: float) -> float:
    """Eight links of a chain."""
    y = y * a + b
    y = y * a + b
    y = y * a + b
    y = y * a + b
    y = y * a + b
    y = y * a + b
    y = y * a + b
    return y * a + b


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _multiply_add(p: Floats, q: Floats, r: Floats, s: Floats, a: float, b: float, repeats: int) -> None:
    """Carry 4 x lanes chains on by 32 links, `repeats` times."""
    for _ in range(repeats):
        for j in range(p.shape[0]):
            w, x, y, z = p[j], q[j], r[j], s[j]
            w, x, y, z = _eight_steps(w, a, b), _eight_steps(x, a, b), _eight_steps(y, a, b), _eight_steps(z, a, b)
            w, x, y, z = _eight_steps(w, a, b), _eight_steps(x, a, b), _eight_steps(y, a, b), _eight_steps(z, a, b)
            w, x, y, z = _eight_steps(w, a, b), _eight_steps(x, a, b), _eight_steps(y, a, b), _eight_steps(z, a, b)
            w, x, y, z = _eight_steps(w, a, b), _eight_steps(x, a, b), _eight_steps(y, a, b), _eight_steps(z, a, b)
            p[j], q[j], r[j], s[j] = w, x, y, z


def prepared(repeats: int) -> tuple[Callable[[], object], int]:
    """Return what is to be timed, compiled, and how many multiply-adds it is."""
    p, q, r, s = (np.linspace(0.1 * i, 1.0, LANES) for i in range(CHAINS))

    def run() -> None:
        _multiply_add(p, q, r, s, 0.5, 0.1, repeats)

    _multiply_add(p, q, r, s, 0.5, 0.1, 1)
    return run, repeats * LANES * CHAINS * UNROLLED
