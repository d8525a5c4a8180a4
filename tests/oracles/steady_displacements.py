"""Amplitudes of all displacements in the steady motion of the first harmonic, as the core computes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.errors import checked_omega
from grazemap_core.model.harmonic_response import harmonic_amplitudes, require_damped
from grazemap_core.model.oscillator import Oscillator


def forced_response(oscillator: Oscillator, omega: ArrayLike) -> np.ndarray[Any, np.dtype[np.complex128]]:
    """``(K - w^2 M + i w C)^{-1} f``, (n, N), damped or not."""
    return harmonic_amplitudes(oscillator, checked_omega(omega), oscillator.forces[0])[:, :-1]


def contact_amplitude(oscillator: Oscillator, omega: float) -> float:
    """That of mass 1 of a chain, damped or not."""
    return float(abs(forced_response(oscillator, np.array([omega]))[0, 0]))


def steady_response(oscillator: Oscillator, omega: ArrayLike) -> np.ndarray[Any, np.dtype[np.complex128]]:
    """The same of an oscillator whose modes are all damped."""
    require_damped(oscillator)
    return forced_response(oscillator, omega)
