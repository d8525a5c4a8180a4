"""Types of the arrays that the core takes and returns. Shapes are given in the docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Complexes = NDArray[np.complex128]
Booleans = NDArray[np.bool_]
