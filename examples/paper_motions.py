"""The motions of the paper's Figure 9, found again: prints docs/reproduction.md.

At omega = 0.29 and 0.27 the clearance falls as in the paper, every trajectory starts from rest, and the sequence of
motions is printed beside the paper's. Run `python examples/paper_motions.py > docs/reproduction.md`; it takes a minute
or two, most of it computing on the machine's own cores.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import groupby

import numpy as np

import grazemap
from grazemap import Client, Oscillator
from grazemap.models import motion_label

TRANSIENT = 1500
SAMPLES = 2000


@dataclass(frozen=True)
class Printed:
    """A region of the paper's Figure 9: its letter and n-p_r-q_l as printed; None for "multi"."""

    letter: str
    n: int | None
    right: int | None
    left: int | None

    @property
    def label(self) -> str:
        """The printed label."""
        if self.n is None:
            right, left = ("multi" if impacts is None else impacts for impacts in (self.right, self.left))
            return f"multi-{right}r-{left}l"
        return motion_label(self.n, self.right or 0, self.left or 0)


@dataclass
class Run:
    """Neighbouring clearances with one motion; `approaches` per motion period, or None unless the kind is periodic."""

    high: float
    low: float
    points: int
    kind: str
    motion: tuple[int, int, int] | None
    approaches: int | None = None

    def matches(self, printed: Printed, mirrored: bool = False) -> bool:
        """Whether the printed label is this motion (or its mirror image), with n counting turns on one side."""
        if printed.n is None or self.motion is None or self.approaches != printed.n:
            return False
        impacts = (printed.left, printed.right) if mirrored else (printed.right, printed.left)
        return self.motion[1:] == impacts


PAPER = {
    0.29: (
        (2.0, 1.494),
        [
            Printed("a", 1, -1, -1), Printed("b", None, 0, 0), Printed("c", 1, 1, -1), Printed("d", 1, -1, 1),
            Printed("e", 1, 1, 1), Printed("f", 2, 1, 1), Printed("g", None, None, None), Printed("h", 2, 2, 2),
            Printed("i", 3, 2, 2), Printed("j", 3, 3, 3), Printed("k", 4, 3, 3),
        ],
    ),
    0.27: (
        (1.86, 1.34),
        [
            Printed("l", 1, 1, -1), Printed("m", 3, -1, 3), Printed("n", 1, 1, 1), Printed("o", 2, 1, 1),
            Printed("p", 6, 4, 4), Printed("q", 10, 8, 8), Printed("r", None, None, None), Printed("s", 2, 2, 2),
            Printed("t", 3, 2, 2), Printed("u", 3, 3, 3), Printed("v", 4, 4, 4),
        ],
    ),
}  # fmt: skip


def sequence(client: Client, omega: float, high: float, low: float, points: int) -> list[Run]:
    """Return the runs of equal motions as the clearance falls, each split where the approaches per period change."""
    # a map has at least two columns; the second, a neighbouring omega, is not used
    umap = client.unfolding_map(
        Oscillator(), omega=[omega, omega + 1e-3], clearance=(low, high), shape=(points, 2), max_periods=2000,
        progress=False,
    )  # fmt: skip
    rows = []
    for i in reversed(range(points)):
        kind = umap.kinds[umap.kind[i, 0]]
        motion = (int(umap.period[i, 0]), int(umap.impacts_right[i, 0]), int(umap.impacts_left[i, 0]))
        rows.append((float(umap.clearance[i]), (kind, motion if kind == "periodic" else None)))
    runs = []
    for (kind, motion), group in groupby(rows, key=lambda row: row[1]):
        members = [clearance for clearance, _ in group]
        if motion is None:
            runs.append(Run(members[0], members[-1], len(members), kind, None))
            continue
        step = max(1, len(members) // 16)
        pieces = [members[k : k + step] for k in range(0, len(members), step)]
        counted = [(piece, approaches(client, omega, piece[0], motion)) for piece in pieces]
        for count, same in groupby(counted, key=lambda item: item[1]):
            values = [clearance for piece, _ in same for clearance in piece]
            runs.append(Run(values[0], values[-1], len(values), kind, motion, count))
    return runs


def approaches(client: Client, omega: float, clearance: float, motion: tuple[int, int, int]) -> int:
    """Count how often mass 1 turns back on the side of stop A in one period of the motion, with or without impact."""
    result = client.trajectory(
        Oscillator(), omega=omega, clearance=clearance, transient_periods=TRANSIENT, periods=motion[0],
        samples_per_period=SAMPLES, progress=False,
    )  # fmt: skip
    x, v = result.displacement[0], result.velocity[0]
    turns = (v[:-1] > 0) & (v[1:] <= 0)
    # the record may begin on a turn: one motion period has both ends, of which one counts
    return int(np.sum(turns & (x[:-1] > 0)))


def page(client: Client, points: int) -> str:
    """Return the page as Markdown."""
    lines = [HEAD.format(version=grazemap.__version__, points=points)]
    for omega, ((high, low), printed) in PAPER.items():
        print(f"omega = {omega} ...", file=sys.stderr, flush=True)
        runs = sequence(client, omega, high, low, points)
        lines += [f"\n## omega = {omega}, clearance from {high:g} down to {low:g}\n", MATCH_HEAD]
        for region in printed:
            found = [run for run in runs if run.matches(region)] or [run for run in runs if run.matches(region, True)]
            where = "; ".join(f"{run.high:.4f} to {run.low:.4f}" for run in found if run.points > 2) or "; ".join(
                f"{run.high:.4f}" for run in found
            )
            ours = " or ".join(sorted({motion_label(*run.motion) for run in found if run.motion}))
            reason = REASONS.get((omega, region.letter), REASONS.get(region.letter, "" if found else "not found"))
            lines.append(f"| {region.letter} | {region.label} | {ours or '-'} | {where or '-'} | {reason} |")
        lines += ["\nThe whole sequence:\n", SEQUENCE_HEAD]
        for run in runs:
            label = motion_label(*run.motion) if run.motion else run.kind
            lines.append(f"| {run.high:.4f} | {run.low:.4f} | {run.points} | {label} | {run.approaches or '-'} |")
    return "\n".join(lines)


HEAD = """# The paper's motions, found again

This page is printed by `python examples/paper_motions.py` (grazemap {version}); do not edit it.

The paper's Figure 9 names 22 motions as n-p_r-q_l, in the order of falling clearance, without saying at which
clearance each of them was computed. Below is what grazemap finds at {points} equally spaced clearances, every
trajectory started from rest with forcing phase 0, with gamma = 0.05 (the reading of the paper's zeta = 0.05 that fits
its own equations).

**What n means.** The paper defines n as the motion's period in forcing periods. Its labels do not follow that: the
motion printed as 6-4r-4l closes after 3 forcing periods, and the one printed as 10-8r-8l after 5. All of its periodic
labels that were found fit another rule, which the tables test: the printed n counts how often, in one period of the
motion, mass 1 turns back on the side of stop A, whether it hits the stop or not; these are the loops that one sees in a
phase portrait. So a row below agrees when the impacts agree (the mirror image of a motion counts as the same) and the
number of turns ("turns at A", counted on the trajectory) is the printed n. grazemap's own n is the least period, as the
paper defines it."""

MATCH_HEAD = """| region | printed | here, n = least period | clearances | remark |
|---|---|---|---|---|"""

SEQUENCE_HEAD = """| from | to | points | motion | turns at A |
|---|---|---|---|---|"""

REASONS: dict[str | tuple[float, str], str] = {
    "b": "No motion that only touches was found. Between regions a and c, trajectories from rest settle to motions "
    "with few impacts in several periods, or to none within 2000 periods.",
    "d": "The mirror image of region c: which of the two is reached depends on the start.",
    "g": "A band of motions that do not close within 2000 periods, with windows of long periods between.",
    "r": "A band of motions that do not close within 2000 periods, with windows of long periods between.",
    "m": "Found with one impact on the other stop in three periods; a motion that leaves that stop untouched was not "
    "reached from rest at any of these clearances.",
}


if __name__ == "__main__":
    with grazemap.local() as stack:
        print(page(stack, points=int(sys.argv[1]) if len(sys.argv) > 1 else 1013))
