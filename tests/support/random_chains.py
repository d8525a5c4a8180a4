"""Random chains for tests: an oscillator of the core, and the same numbers as the oracles take them."""

from __future__ import annotations

import numpy as np

from grazemap_core.grazing.point import GrazingPoint, grazing_point
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import Chain


def chain_of(oscillator: Oscillator) -> Chain:
    """Take over the numbers, and nothing else, of the core's oscillator."""
    if oscillator.gamma is not None:
        return Chain.proportional(oscillator.masses, oscillator.stiffnesses, oscillator.gamma, oscillator.forcing)
    return Chain(oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing)


def random_oscillator(random: np.random.Generator, count: int, per_link: bool) -> Oscillator:
    """Return a chain of `count` masses, its dampings from light to near critical, any restitution, any forcing."""
    masses, stiffnesses = 10 ** random.uniform(-0.5, 0.5, (2, count))
    forcing = random.normal(size=count)
    damping = 10 ** random.uniform(-2.0, -0.5, count)
    given = damping if per_link else float(damping[0])
    return Oscillator.create(masses, stiffnesses, given, forcing, float(random.uniform()))


def random_grazing_points(seed: int, count: int, highest_omega: float) -> list[GrazingPoint]:
    """Return grazing points of chains with 1 to 4 masses, at both stops in turn, with both kinds of damping."""
    random = np.random.default_rng(seed)
    points = []
    for number in range(count):
        oscillator = random_oscillator(random, 1 + number // 4 % 4, per_link=bool(number // 2 % 2))
        omega = float(random.uniform(0.2, highest_omega))
        points.append(grazing_point(oscillator, omega, 1 if number % 2 == 0 else -1))
    return points
