"""Random chains for tests: an oscillator of the core, and the same numbers as the oracles take them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from grazemap_core.grazing.grazing_curve import ALIKE
from grazemap_core.grazing.point import GrazingPoint, grazing_point
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.steady_displacements import contact_amplitude


def random_oscillator(random: np.random.Generator, count: int, per_link: bool) -> Oscillator:
    """Return a chain of `count` masses, its dampings from light to near critical, any restitution, any forcing."""
    masses, stiffnesses = 10 ** random.uniform(-0.5, 0.5, (2, count))
    forcing = random.normal(size=count)
    damping = 10 ** random.uniform(-2.0, -0.5, count)
    damping_or_gamma = damping if per_link else float(damping[0])
    return Oscillator.create(masses, stiffnesses, damping_or_gamma, forcing, float(random.uniform()))


def random_grazing_points(seed: int, count: int, highest_omega: float) -> list[GrazingPoint]:
    """Return grazing points of chains with 1 to 4 masses, at both stops in turn, with both kinds of damping."""
    random = np.random.default_rng(seed)
    points = []
    for number in range(count):
        oscillator = random_oscillator(random, 1 + number // 4 % 4, per_link=bool(number // 2 % 2))
        omega = float(random.uniform(0.2, highest_omega))
        points.append(grazing_point(oscillator, omega, replace(ALIKE, stop=1 if number % 2 == 0 else -1)))
    return points


def sticking_case(seed: int) -> tuple[Oscillator, float, float]:
    """Return a chain of 1..4 masses that a slow force presses against close stops, the frequency and the clearance."""
    rng = np.random.default_rng(seed)
    count = 1 + seed % 4
    damping = float(rng.uniform(0.01, 0.3)) if rng.random() < 0.5 else rng.uniform(0.01, 0.4, count)
    forcing = rng.uniform(-1, 1, count)
    forcing[0] = 1.0
    restitution = [0.0, 0.2, 0.5, 0.8, 0.95][(seed // 4) % 5]
    oscillator = Oscillator.create(
        rng.uniform(0.5, 3, count), rng.uniform(0.5, 3, count), damping, forcing, restitution
    )
    omega = float(rng.uniform(0.05, 0.3))
    amplitude = contact_amplitude(oscillator, omega)
    return oscillator, omega, float(rng.uniform(0.1, 0.6) * amplitude)


STICKING = (0, 1, 2, 3, 4, 5, 7, 8, 9, 12, 15, 17, 20, 22, 24, 25, 26, 28, 31, 32, 33, 35, 38)
"""Seeds of cases whose motion sticks; only two with restitution 0.95, whose oracle follows thousands of bounces."""
