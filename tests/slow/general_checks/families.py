"""Curves that leave resonant points against exact motions, and motions with one impact on each of two unlike stops."""

from __future__ import annotations

from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import at_point, periodic_orbit
from grazemap_core.orbits.two_impact_orbits import two_impact_sequences
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import differences, solved
from tests.oracles.unfolded_curves import errors, random_system, unfolded_points
from tests.support.general_systems import mismatch, random_oscillator

from .table import Row, part

UNFOLDINGS, ORBITS = 20, 20
"""Numbers of systems."""
COEFFICIENT = 1e-6
"""Relative error of a coefficient, from a polynomial through exact motions at five frequencies."""
ACCURACY = 1e-12
"""Error of phases, and of velocities and multipliers in units of the largest."""


class Orbits(NamedTuple):
    """Numbers of orbits compared and wrong, and the largest error."""

    compared: int
    wrong: int
    error: float


def unfolding_errors(seed: int) -> list[float]:
    """Return the largest error of the coefficients at each of a system's resonant points."""
    oscillator, oracle = random_system(100 + seed)
    return [max(errors(oscillator, oracle, point)) for point in unfolded_points(oscillator)]


def two_impact_orbits(seed: int) -> Orbits:
    """Compare all orbits with one impact on each stop in one or two periods, found from nothing, with fifty digits."""
    random = np.random.default_rng(1000 + seed)
    oscillator = random_oscillator(random, seed)
    omega, place = float(random.uniform(0.4, 1.6)), contact_equilibrium(oscillator)
    size = OrbitFamily.of(oscillator, 1, False).at(omega).steady_size
    right, left = random.uniform(0.2, 0.8, 2) * size
    clearance = (float(right + place), float(left - place))
    compared, wrong, worst = 0, 0, 0.0
    for multiple in (1, 2):
        pattern = ImpactSequence.create(multiple, [1, -1], [0.0, 1.0], [1.0, -1.0])
        family, stops = at_point(oscillator, omega, clearance, pattern)
        for guess in two_impact_sequences(family, stops, 1):
            orbit = periodic_orbit(oscillator, omega, clearance, guess)
            if not orbit.isolated:
                continue
            exact = solved(oscillator, omega, clearance, orbit.impacts)
            with digits():
                theirs = exact.multipliers()
            late, faster = differences(exact, orbit.impacts)
            largest = max(abs(value) for value in theirs)
            away = mismatch(orbit.multipliers, theirs) / max(1.0, largest)
            error = max(late, faster / float(np.max(np.abs(orbit.impacts.velocities))), away)
            compared, wrong, worst = compared + 1, wrong + (error > ACCURACY), max(worst, error)
            if error > ACCURACY:
                print(
                    f"orbit of seed {seed}, {multiple} periods: error {error:.1e}, {orbit.kantorovich:.1e}", flush=True
                )
    return Orbits(compared, wrong, worst)


def check(share: float, processes: int) -> list[Row]:
    """Compare coefficients and orbits."""
    with get_context("spawn").Pool(processes) as pool:
        error_lists = pool.map(unfolding_errors, range(part(UNFOLDINGS, share)), chunksize=1)
        orbits = pool.map(two_impact_orbits, range(part(ORBITS, share)), chunksize=1)
    points = [error for of_seed in error_lists for error in of_seed]
    wrong = sum(error > COEFFICIENT for error in points)
    rows = [Row("unfoldings of resonant points against exact motions", len(points), wrong, f"error {max(points):.1e}")]
    compared, wrong = sum(orbit.compared for orbit in orbits), sum(orbit.wrong for orbit in orbits)
    error = max(orbit.error for orbit in orbits)
    return [*rows, Row("orbits with an impact on each stop, 50 digits", compared, wrong, f"error {error:.1e}")]
