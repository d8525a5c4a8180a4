"""Products of matrices with vectors of `Pair`, of about 32 digits."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import Pair, add, scale


def exact(values: Floats) -> Pair[Floats]:
    """Return doubles as pairs."""
    return Pair(values, np.zeros_like(values))


def transformed(matrix: Floats, vectors: Pair[Floats]) -> Pair[Floats]:
    """Return ``matrix @ vectors`` for a matrix (m, n) of doubles and pairs (n, k), shape (m, k)."""
    result = exact(np.zeros((len(matrix), vectors.high.shape[1])))
    for j in range(matrix.shape[1]):
        result = add(result, scale(Pair(vectors.high[None, j], vectors.low[None, j]), matrix[:, j, None]))
    return result
