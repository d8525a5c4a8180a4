"""Other starts than rest: random states, the same at every clearance in units of it; and sweeps of the clearance."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from grazemap import Client, Trajectories
from paper.motions import MAX_PERIODS
from paper.paper import GAMMA, READINGS

SEED = 2026
SWEPT = 101


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


def swept(client: Client, omega: float, high: float, low: float) -> str:
    """Say which motions sweeps up and down between two clearances come to."""
    texts = []
    for policy, name in (("sweep-down", "downwards"), ("sweep-up", "upwards")):
        # a map has at least two columns; the second, a neighbouring omega, is not used
        umap = client.unfolding_map(
            READINGS[GAMMA], omega=[omega, omega + 1e-3], clearance=(low, high), shape=(SWEPT, 2), policy=policy,
            max_periods=MAX_PERIODS, progress=False,
        )  # fmt: skip
        names = Counter(umap.labels()[:, 0].tolist())
        ordered = sorted(names.items(), key=lambda item: (-item[1], item[0]))
        texts.append(f"{name} {', '.join(f'{label} ({count})' for label, count in ordered)}")
    return (
        f"In sweeps over {SWEPT} clearances between b = {high:.4f} and {low:.4f} each trajectory starts at the final"
        f" state of the one before. They lead to these motions (with the number of clearances): {'; '.join(texts)}."
    )
