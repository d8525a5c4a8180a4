"""The cost of a forcing period of an oscillator, and the number of periods of a pixel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grazemap.wire import Oscillator
from grazemap_worker.planning.rates import (
    BRANCH_IMPACTS,
    BRANCH_SECONDS,
    PERIODS_TO_SETTLE,
    REFERENCE_STIFFNESS,
    UNSETTLED,
)


def spectral_bound(oscillator: Oscillator) -> float:
    """Return an upper bound of |lambda| over the eigenvalues of M x'' + C x' + K x = 0.

    With nu and mu the largest absolute row sums of M^-1 C and M^-1 K (Gershgorin), lambda^2 <= nu lambda + mu.
    Infinite where the numbers overflow.
    """
    masses = np.array(oscillator.masses)
    with np.errstate(over="ignore", invalid="ignore"):
        mu = float((_row_sums(np.array(oscillator.stiffnesses)) / masses).max())
        if isinstance(oscillator.damping, list):
            factor = 2.0 if oscillator.units == "nondimensional" else 1.0
            nu = float((factor * _row_sums(np.array(oscillator.damping)) / masses).max())
        else:
            nu = 2.0 * oscillator.damping * mu
    bound = 0.5 * (nu + math.hypot(nu, 2.0 * math.sqrt(mu)))
    return math.inf if math.isnan(bound) else bound


def period_costs(oscillator: Oscillator, omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cost of a forcing period at each omega, shape (n,), in periods of the default oscillator, >= 1."""
    with np.errstate(over="ignore"):
        stiffness = spectral_bound(oscillator) * 2.0 * math.pi / omega
    return np.maximum(1.0, stiffness / REFERENCE_STIFFNESS)


def _row_sums(links: NDArray[np.float64]) -> NDArray[np.float64]:
    """Absolute row sums of a chain's matrix: link i joins mass i to mass i + 1, the last one to ground."""
    before = np.concatenate(([0.0], links[:-1]))
    after = np.concatenate((links[:-1], [0.0]))
    return 2.0 * (before + after) + np.concatenate((np.zeros(len(links) - 1), links[-1:]))


def expected_periods(max_periods: int) -> float:
    """Return the forcing periods that a pixel is expected to take on average."""
    return min(float(max_periods), PERIODS_TO_SETTLE + UNSETTLED * max_periods)


def period_cost(oscillator: Oscillator, omega: float) -> float:
    """Return the cost of a forcing period at one omega, as `period_costs`."""
    return float(period_costs(oscillator, np.array([omega]))[0])


def branch_point_seconds(oscillator: Oscillator, impacts: float) -> float:
    """Return the seconds for a point of the branch of an orbit with this number of impacts."""
    return BRANCH_SECONDS * (1.0 + (impacts / BRANCH_IMPACTS) ** 2) * oscillator.size
