"""Types of the arrays that the core takes and returns, and arrays for vectors. Shapes are given in the docstrings."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Complexes = NDArray[np.complex128]
Booleans = NDArray[np.bool_]
Array = TypeVar("Array", Floats, Integers)

CACHE_LINE = 64
"""Bytes that a processor reads at once, and those of its longest vector."""


def aligned(array: Array) -> Array:
    """Return a copy of an array that begins with a cache line, in C order.

    A vector that lies in two lines takes two reads; numpy's own arrays begin anywhere.
    """
    room = np.zeros(array.nbytes + CACHE_LINE, dtype=np.uint8)
    first = -room.ctypes.data % CACHE_LINE
    copy = np.ndarray(array.shape, array.dtype, room, first)
    copy[...] = array
    return copy
