"""How slow this machine is: its pace, by which limits of time are longer than on the reference machine.

Each of the two cores of the reference machine compiles a fixed program with plain numba in REFERENCE_SECONDS.
"""

from __future__ import annotations

import subprocess
import sys

# What numba compiles here has nothing to do with the kernels, so its time tells the machine's pace alone.
_FIXED_WORK = """
import time
import numpy as np
from numba import njit

def made(k):
    def work(a, b):
        total = 0.0
        for i in range(a.shape[0]):
            for j in range(a.shape[1]):
                if a[i, j] > b[j]:
                    total += np.sqrt(a[i, j] * a[i, j] + k) - np.exp(-b[j])
                elif a[i, j] < -b[j]:
                    b[j] = max(a[i, j], b[j]) + np.sin(total) / (1.0 + abs(a[i, j]))
                else:
                    total *= 1.0 + 1e-3 * np.cos(b[j] * k)
        return total
    return njit(work)

functions = [made(float(k)) for k in range(16)]
functions[0](np.ones((2, 2)), np.ones(2))
began = time.perf_counter()
for function in functions[1:]:
    function(np.ones((2, 2)), np.ones(2))
print(time.perf_counter() - began)
"""
# The pace at which 0.3.4 answered with a first map after 44.8 s, a trajectory after 16.0 s.
REFERENCE_SECONDS = 1.3


def pace() -> float:
    """Return how many times as long as the reference machine this one takes, at least 1: the quickest of three runs."""
    runs = [subprocess.run([sys.executable, "-c", _FIXED_WORK], capture_output=True, check=True) for _ in range(3)]
    return max(1.0, min(float(run.stdout) for run in runs) / REFERENCE_SECONDS)
