"""The number of near-grazing first impacts that each tool finds, and of false ones that it reports.

Mass 1 starts in the middle, on its steady motion of amplitude A, toward the right stop. With the clearance
(1 - overshoot) A the first contact is at asin(1 - overshoot)/omega, exactly; with (1 + overshoot) A there is none. The
frequency is random, one generator for all tools: a tool with fewer cases gets the first of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.contestants import Contestant
from benchmarks.result import GrazingRow
from benchmarks.work import chain, start_on_steady_motion

OVERSHOOTS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-13)
OMEGA = (0.2, 1.5)
SEED = 20260
FOUND_WITHIN = 0.1
"""Error, in radians of the forcing, up to which a contact counts as this one: generous, as nothing else is near."""


def count(contestants: Sequence[tuple[Contestant, int]], progress: Callable[[str], None]) -> list[GrazingRow]:
    """Return one row per tool and overshoot.

    Parameters
    ----------
    contestants : pairs
        A tool and its number of frequencies.
    """
    oscillator = chain(3)
    overshoot = np.array(OVERSHOOTS)
    rows: list[GrazingRow] = []
    for tool, cases in contestants:
        omegas = np.random.default_rng(SEED).uniform(*OMEGA, cases)
        hits = np.zeros(len(OVERSHOOTS), dtype=np.int64)
        invented = np.zeros(len(OVERSHOOTS), dtype=np.int64)
        largest = np.zeros(len(OVERSHOOTS))
        for omega in omegas:
            start = start_on_steady_motion(oscillator, float(omega))
            clearances = start.amplitude * np.concatenate([1.0 - overshoot, 1.0 + overshoot])
            times = tool.first_contacts(oscillator, start, clearances)
            inside, outside = np.split(times, 2)
            error = np.abs(omega * inside - np.array([math.asin(1.0 - d) for d in OVERSHOOTS]))
            seen = error <= FOUND_WITHIN  # False for NaN
            hits += seen
            largest = np.maximum(largest, np.where(seen, error, 0.0))
            invented += np.isfinite(outside)
        rows += [
            GrazingRow(
                tool=tool.name, overshoot=d, cases=cases, found=int(hits[i]), invented=int(invented[i]),
                largest_error=float(largest[i]),
            )
            for i, d in enumerate(OVERSHOOTS)
        ]  # fmt: skip
        progress(f"{tool.name}: {cases} frequencies, {int(hits.sum())} of {cases * len(OVERSHOOTS)} found")
    return rows
