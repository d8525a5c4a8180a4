"""Figure 9: the paper's 22 motions, found again along two lines of falling clearance."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np

from examples.reproduce.page import Section
from examples.reproduce.paper import GAMMA, READINGS, REGIONS, Region
from grazemap import Client, JobHandle, Trajectory
from grazemap.models import motion_label

TRANSIENT = 1500
SAMPLES = 2000
MAX_PERIODS = 2000
PIECES = 16

Motion = tuple[int, int, int]


@dataclass
class Run:
    """Neighbouring clearances with one motion; `turns` at A per motion period, or None unless the kind is periodic."""

    clearances: list[float]
    kind: str
    motion: Motion | None
    turns: int | None = None

    @property
    def label(self) -> str:
        """The motion's label, or its kind."""
        return motion_label(*self.motion) if self.motion else self.kind

    def has_impacts(self, printed: Region, mirrored: bool = False) -> bool:
        """Whether the motion (or its mirror image) has the printed impacts."""
        impacts = (printed.left, printed.right) if mirrored else (printed.right, printed.left)
        return self.motion is not None and self.motion[1:] == impacts

    def matches(self, printed: Region, mirrored: bool = False) -> bool:
        """Whether the printed label is this motion (or its mirror image), with n counting turns on one side."""
        return self.turns is not None and self.turns == printed.n and self.has_impacts(printed, mirrored)


@dataclass
class Found:
    """What was found of one printed region: runs, whether as mirror images, and the remark."""

    runs: list[Run] = field(default_factory=list)
    remark: str = ""

    @property
    def long(self) -> list[Run]:
        """The runs of more than two clearances, or all where there are none."""
        return [run for run in self.runs if len(run.clearances) > 2] or self.runs


def figure_9(client: Client, points: int) -> list[Section]:
    """Return the head of the part on Figure 9, and a section for each of its two frequencies."""
    sequences = {omega: sequence(client, omega, *limits, points) for omega, (limits, _) in REGIONS.items()}
    found = {omega: _all_of(regions, sequences[omega]) for omega, (_, regions) in REGIONS.items()}
    regions = [(omega, region) for omega, (_, regions) in REGIONS.items() for region in regions]
    labelled = [(omega, region) for omega, region in regions if region.n is not None]
    head = Section("Figure 9: the paper's motions, found again")
    again = [(omega, region) for omega, region in labelled if found[omega][region.letter].runs]
    least = sum(
        any(run.motion and run.motion[0] == region.n for run in found[omega][region.letter].runs)
        for omega, region in again
    )
    head.say(
        f"Figure 9 names {len(regions)} motions as n-p_r-q_l, in the order of falling clearance, without saying at"
        f" which clearance each of them was computed. Below is what grazemap finds at {points} equally spaced"
        f" clearances, every trajectory started from rest with forcing phase 0, with {GAMMA}."
    )
    head.say(
        "**What n means.** The paper defines n as the motion's period in forcing periods. Its labels do not follow"
        f" that: {_examples(again, found)}. They fit another rule, which the tables test: the printed n counts how"
        " often, in one period of the motion, mass 1 turns back on the side of stop A, whether it hits the stop or not;"
        " these are the loops that one sees in a phase portrait. So a row below agrees when the impacts"
        " agree (the mirror image of"
        ' a motion counts as the same) and the number of turns ("turns at A", counted on the trajectory) is the printed'
        f" n. By this rule {len(again)} of the {len(labelled)} labels with numbers are found, and {least} of them would"
        " be if n were the least period in forcing periods, which is what grazemap's own n is, as the paper defines it."
    )
    sections = [head]
    for omega, ((high, low), printed) in REGIONS.items():
        section = Section(f"omega = {omega}, clearance from {high:g} down to {low:g}")
        section.show(
            ["region", "printed", "here, n = least period", "clearances", "remark"],
            [_row(region, found[omega][region.letter]) for region in printed],
        )
        section.say("The whole sequence:")
        section.show(
            ["from", "to", "points", "motion", "turns at A"],
            [
                (f"{run.clearances[0]:.4f}", f"{run.clearances[-1]:.4f}", str(len(run.clearances)), run.label,
                 str(run.turns or "-"))
                for run in sequences[omega]
            ],
        )  # fmt: skip
        sections.append(section)
    return sections


def sequence(client: Client, omega: float, high: float, low: float, points: int) -> list[Run]:
    """Return the runs of equal motions as the clearance falls, each split where the turns per period change."""
    # a map has at least two columns; the second, a neighbouring omega, is not used
    umap = client.unfolding_map(
        READINGS[GAMMA], omega=[omega, omega + 1e-3], clearance=(low, high), shape=(points, 2), max_periods=MAX_PERIODS
    )
    rows = []
    for i in reversed(range(points)):
        kind = umap.kinds[umap.kind[i, 0]]
        motion = (int(umap.period[i, 0]), int(umap.impacts_right[i, 0]), int(umap.impacts_left[i, 0]))
        rows.append((float(umap.clearance[i]), (kind, motion if kind == "periodic" else None)))
    pieces = []
    for (kind, motion), group in groupby(rows, key=lambda row: row[1]):
        members = [clearance for clearance, _ in group]
        step = max(1, len(members) // PIECES) if motion else len(members)
        pieces += [Run(members[k : k + step], kind, motion) for k in range(0, len(members), step)]
    count_turns(client, omega, [piece for piece in pieces if piece.motion])
    runs: list[Run] = []
    for piece in pieces:
        if runs and (runs[-1].kind, runs[-1].motion, runs[-1].turns) == (piece.kind, piece.motion, piece.turns):
            runs[-1].clearances += piece.clearances
        else:
            runs.append(piece)
    return runs


def count_turns(client: Client, omega: float, pieces: list[Run]) -> None:
    """Count how often mass 1 turns back on the side of stop A in one period of each motion; all are asked at once."""
    jobs = [_ask(client, omega, piece) for piece in pieces]
    for done, (piece, job) in enumerate(zip(pieces, jobs, strict=True)):
        path = job.wait().result()
        assert isinstance(path, Trajectory)
        x, v = path.displacement[0], path.velocity[0]
        turns = (v[:-1] > 0) & (v[1:] <= 0)
        # the record may begin on a turn: one motion period has both ends, of which one counts
        piece.turns = int(np.sum(turns & (x[:-1] > 0)))
        if (done + 1) % 50 == 0 or done + 1 == len(pieces):
            print(f"  omega = {omega}: turns of {done + 1} of {len(pieces)} motions", file=sys.stderr, flush=True)


def _ask(client: Client, omega: float, piece: Run) -> JobHandle:
    assert piece.motion is not None
    question = {
        "oscillator": READINGS[GAMMA].model_dump(), "omega": omega, "clearance": piece.clearances[0],
        "transient_periods": TRANSIENT, "periods": piece.motion[0], "samples_per_period": SAMPLES,
    }  # fmt: skip
    return client.submit("trajectories", question)


def match(region: Region, runs: list[Run]) -> Found:
    """Return what was found of a printed region with numbers, with a remark where that needs one."""
    found = [run for run in runs if run.matches(region)]
    if found:
        return Found(found)
    mirrored = [run for run in runs if run.matches(region, mirrored=True)]
    if mirrored:
        return Found(mirrored, "As its mirror image: which of the two is reached depends on the start.")
    right, left = region.right or 0, region.left or 0
    near = [
        run.label
        for run in runs
        if run.motion and run.turns == region.n and max(run.motion[1:]) == max(right, left) > min(run.motion[1:])
    ]
    labels = " and ".join(dict.fromkeys(near))
    return Found([], f"Not reached from rest. With the same n there are {labels}." if near else "Not found.")


def match_between(region: Region, before: tuple[str, Found], after: tuple[str, Found], runs: list[Run]) -> Found:
    """Return what was found of a region printed with "multi", which lies between two others."""
    touching = [run for run in runs if run.motion and run.motion[1:] == (region.right, region.left)]
    if touching:
        return Found(touching)
    remark = "No motion that only touches was found. " if region.right == 0 else ""
    ends = [[value for run in found.long for value in run.clearances] for _, found in (before, after)]
    names = f"{before[0]} and {after[0]}"
    if not all(ends):
        return Found([], f"{remark}Its neighbours {names} were not both found.")
    high, low = min(ends[0]), max(value for value in ends[1] if value < min(ends[0]))
    inside = [(run, sum(low < value < high for value in run.clearances)) for run in runs]
    total = sum(count for _, count in inside)
    if not total:
        return Found(
            [], f"{remark}No clearance lies between those of {names}; {_open(runs)} of the whole line stay open."
        )
    unclosed = sum(count for run, count in inside if run.motion is None)
    periods = [run.motion[0] for run, count in inside if run.motion and count]
    closed = f"; the others have periods from {min(periods)} to {max(periods)}" if periods else ""
    return Found(
        [], f"{remark}Of {total} clearances between {names}, {unclosed} do not close in {MAX_PERIODS} periods{closed}."
    )


def _open(runs: list[Run]) -> int:
    """Return at how many clearances no period was found."""
    return sum(len(run.clearances) for run in runs if run.motion is None)


def _all_of(regions: list[Region], runs: list[Run]) -> dict[str, Found]:
    """Return what was found of each region; those with numbers first, as the others lie between them."""
    found = {region.letter: match(region, runs) for region in regions if region.n is not None}
    for k, region in enumerate(regions):
        if region.n is None:
            before, after = regions[k - 1].letter, regions[k + 1].letter
            found[region.letter] = match_between(region, (before, found[before]), (after, found[after]), runs)
    return found


def _row(region: Region, found: Found) -> list[str]:
    where = "; ".join(f"{run.clearances[0]:.4f} to {run.clearances[-1]:.4f}" for run in found.long)
    ours = " or ".join(sorted({run.label for run in found.runs}))
    return [region.letter, region.label, ours or "-", where or "-", found.remark]


def _examples(again: list[tuple[float, Region]], found: dict[float, dict[str, Found]]) -> str:
    """Name the two longest printed periods that were found, and the least periods they have."""
    longest = sorted(again, key=lambda item: -(item[1].n or 0))[:2]
    texts = []
    for omega, region in longest:
        periods = sorted({run.motion[0] for run in found[omega][region.letter].runs if run.motion})
        texts.append(
            f"the motion printed as {region.label} closes after {' or '.join(map(str, periods))} forcing periods"
        )
    return " and ".join(texts)
