"""The sequence of motions as the clearance falls, with how often mass 1 turns back in each."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

from grazemap import Client, Trajectory
from grazemap.wire import motion_label
from paper.asking import answers
from paper.paper import READINGS, Region

TRANSIENT = 1500
SAMPLES = 2000
MAX_PERIODS = 2000
PIECES = 16

Motion = tuple[int, int, int]


@dataclass
class Run:
    """Neighbouring clearances with one motion.

    Attributes
    ----------
    clearances, slowest : list of float
        Falling, and the slowest impact at each; NaN where there is none.
    kind : str
    motion : (int, int, int) or None
        n, p, q; None unless the kind is periodic.
    turns : int or None
        How often mass 1 turns back on the side of stop A in one period of the motion.
    """

    clearances: list[float]
    slowest: list[float]
    kind: str
    motion: Motion | None
    turns: int | None = None

    @property
    def label(self) -> str:
        """The motion's label, or its kind."""
        return motion_label(*self.motion) if self.motion else self.kind

    def matches(self, printed: Region, mirrored: bool = False) -> bool:
        """Whether the printed label is this motion (or its mirror image), with n counting turns on one side."""
        impacts = (printed.left, printed.right) if mirrored else (printed.right, printed.left)
        return self.motion is not None and self.motion[1:] == impacts and self.turns == printed.n


@dataclass
class Line:
    """What trajectories from rest come to along a line of falling clearance.

    Attributes
    ----------
    reading : str
    omega : float
    runs : list of Run
    """

    reading: str
    omega: float
    runs: list[Run] = field(default_factory=list)


def motions_along(client: Client, reading: str, omega: float, high: float, low: float, points: int) -> Line:
    """Return the runs of equal motions as the clearance falls, each split where the turns per period change."""
    pieces = []
    for run in plain_runs(client, reading, omega, high, low, points):
        step = max(1, len(run.clearances) // PIECES) if run.motion else len(run.clearances)
        pieces += [
            Run(run.clearances[k : k + step], run.slowest[k : k + step], run.kind, run.motion)
            for k in range(0, len(run.clearances), step)
        ]
    _count_turns(client, reading, omega, [piece for piece in pieces if piece.motion])
    runs: list[Run] = []
    for piece in pieces:
        if runs and (runs[-1].kind, runs[-1].motion, runs[-1].turns) == (piece.kind, piece.motion, piece.turns):
            runs[-1].clearances += piece.clearances
            runs[-1].slowest += piece.slowest
        else:
            runs.append(piece)
    return Line(reading, omega, runs)


def plain_runs(client: Client, reading: str, omega: float, high: float, low: float, points: int) -> list[Run]:
    """Return the runs of equal motions as the clearance falls, turns not counted."""
    # a map has at least two columns; the second, a neighbouring omega, is not used
    umap = client.unfolding_map(
        READINGS[reading], omega=[omega, omega + 1e-3], clearance=(low, high), shape=(points, 2),
        max_periods=MAX_PERIODS,
    )  # fmt: skip
    motions = []
    for i in reversed(range(points)):
        kind = umap.kinds[umap.kind[i, 0]]
        motion = (int(umap.period[i, 0]), int(umap.impacts_right[i, 0]), int(umap.impacts_left[i, 0]))
        motions.append((kind, motion if kind == "periodic" else None, i))
    runs = []
    for (kind, some), group in groupby(motions, key=lambda item: item[:2]):
        places = [i for _, _, i in group]
        runs.append(Run(umap.vertical[places].tolist(), umap.least_impact_velocity[places, 0].tolist(), kind, some))
    return runs


def turns_at_a(path: Trajectory) -> int:
    """Return how often mass 1 turns back on the side of stop A, in a record of whole periods of a motion."""
    x, v = path.displacement[0], path.velocity[0]
    # the record may begin on a turn: one motion period has both ends, of which one counts
    return int(np.sum((v[:-1] > 0) & (v[1:] <= 0) & (x[:-1] > 0)))


def _count_turns(client: Client, reading: str, omega: float, pieces: list[Run]) -> None:
    """Count the turns of each motion on its trajectory; all are asked for at once, for all workers."""
    questions = [_question(reading, omega, piece) for piece in pieces]
    paths = answers(client, Trajectory, questions, f"{reading}, omega = {omega}, trajectories")
    for piece, path in zip(pieces, paths, strict=True):
        piece.turns = turns_at_a(path)


def _question(reading: str, omega: float, piece: Run) -> dict[str, Any]:
    assert piece.motion is not None
    return {
        "oscillator": READINGS[reading].model_dump(), "omega": omega, "clearance": piece.clearances[0],
        "transient_periods": TRANSIENT, "periods": piece.motion[0], "samples_per_period": SAMPLES,
    }  # fmt: skip
