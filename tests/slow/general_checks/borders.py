"""Verified points beside borders of random systems' maps, run on and in 50 digits."""

from __future__ import annotations

import numpy as np

from tests.slow import beside_borders
from tests.slow.beside_borders import System
from tests.slow.verified_points import OTHER
from tests.support.random_systems import random_system

from .labels import clearances_at
from .table import Row, part

BORDERS, IN_FIFTY_DIGITS, WINDOWS = 60, 100, 12
RESTITUTION = 0.8
"""With less, most motions rest on a stop, and are not verified."""


def window(seed: int) -> System:
    """Return a window of a random system's map, the clearance of one stop being fixed."""
    system = random_system(seed, restitution=RESTITUTION)
    low, high, fixed = clearances_at(system, np.array([0.4, 1.3, 1.0]))
    oscillator, omega = system.oscillator, (0.85 * system.omega, 1.15 * system.omega)
    if np.isinf(low[0]):
        # q and the contact row change their signs, so that the only stop is the right one
        original = oscillator
        oscillator = type(original).of_structure(
            original.structure,
            -original.contact,
            original.drive,
            original.restitution_of(-1),
            original.bias,
            original.restitution_of(1),
        )
        low, high, fixed = low[::-1], high[::-1], fixed[::-1]
    return System(oscillator, omega, (float(low[0]), float(high[0])), float(fixed[1]))


def check(share: float, processes: int) -> list[Row]:
    """Compare labels."""
    windows = {f"system {seed}": window(seed) for seed in range(part(WINDOWS, share))}
    counts = beside_borders.main(part(BORDERS, share), part(IN_FIFTY_DIGITS, share), processes, windows, 0)
    figure = f"{counts['verified']} of {counts['points']} verified, {counts['in 50 digits']} in 50 digits"
    return [Row("strips beside borders", counts["borders"], counts[OTHER], figure)]
