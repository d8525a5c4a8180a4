"""The same random initial states at every clearance, in units of it, and the names of what they lead to."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from grazemap import Trajectories

SEED = 2026


def states(clearance: float, count: int) -> list[dict[str, Any]]:
    """Return rest, and random states of three masses: displacements up to the clearance, speeds up to half of it."""
    random = np.random.default_rng(SEED).uniform(-1.0, 1.0, (count, 7))
    rest: dict[str, Any] = {"displacement": [0.0] * 3, "velocity": [0.0] * 3, "phase": 0.0}
    drawn = [
        {
            "displacement": (clearance * row[:3]).tolist(),
            "velocity": (0.5 * clearance * row[3:6]).tolist(),
            "phase": float(np.pi * row[6]),
        }
        for row in random
    ]
    return [rest, *drawn]


def counted(result: Trajectories) -> str:
    """Return the motions with the number of starts that lead to each, the most frequent first."""
    names = Counter(path.motion.label or path.motion.kind for path in result.trajectories)
    ordered = sorted(names.items(), key=lambda item: (-item[1], item[0]))
    return ", ".join(f"{name} ({count})" for name, count in ordered)
