"""Long transients of random systems that double precision follows: how many are called sensitive."""

from __future__ import annotations

import numpy as np

from tests.slow import long_transients
from tests.slow.long_transients import AGREE, DIFFER, MOST_SENSITIVE
from tests.slow.resolved_points import COLUMN, Points
from tests.support.random_systems import random_system

from .labels import clearances_at
from .table import Row, part

POINTS = 100


def random_column(rng: np.random.Generator) -> Points:
    """Return points of one frequency of a random system with high restitution."""
    seed, restitution = int(rng.integers(1000)), float(rng.uniform(0.9, 0.999))
    system = random_system(seed, restitution=restitution)
    omega = system.omega * float(rng.uniform(0.7, 1.3))
    return Points(system.oscillator, omega, clearances_at(system, np.sort(rng.uniform(0.2, 1.3, COLUMN))))


def check(share: float, processes: int) -> list[Row]:
    """Count sensitive points."""
    counts = long_transients.main(part(POINTS, share), processes, random_column)
    agree, part_of = counts[AGREE, False] + counts[AGREE, True], long_transients.sensitive_share(counts)
    verified_and_differ = counts[DIFFER, False]
    return [
        Row("long transients: verified, and elsewhere in 50 digits", sum(counts.values()), verified_and_differ),
        Row(
            "long transients that double precision follows",
            agree,
            int(part_of > MOST_SENSITIVE),
            f"{100.0 * part_of:.1f} % called sensitive",
        ),
    ]
