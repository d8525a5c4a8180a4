"""Which stretch of a line of motions each printed region of Figure 9 is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from grazemap import Client
from paper.motions import MAX_PERIODS, Line, Run, plain_runs
from paper.paper import REGIONS, Region

FINE = 701


@dataclass
class Found:
    """What was found of one printed region.

    Attributes
    ----------
    runs : list of Run
        The printed motion.
    remark : str
    place : float or None
        The clearance at which its motion, or what is there instead, is looked at more closely.
    gap : (float, float) or None
        Where it was not found: between which clearances it would have to be, the greater one first.
    """

    runs: list[Run] = field(default_factory=list)
    remark: str = ""
    place: float | None = None
    gap: tuple[float, float] | None = None

    @property
    def long(self) -> list[Run]:
        """The runs of more than two clearances, or all where there are none."""
        return [run for run in self.runs if len(run.clearances) > 2] or self.runs


Regions = dict[str, Found]
Finer = Callable[[float, float], list[Run]]


def regions_of(client: Client, line: Line) -> Regions:
    """Return what was found of each region; those with numbers first, as the others lie between them."""

    def finer(high: float, low: float) -> list[Run]:
        return plain_runs(client, line.reading, line.omega, high, low, FINE)

    regions = REGIONS[line.omega][1]
    findings = {region.letter: _match(region, line.runs) for region in regions if region.n is not None}
    for k, region in enumerate(regions):
        if region.letter in findings and findings[region.letter].runs:
            continue
        letters = (regions[k - 1].letter, regions[k + 1].letter)
        neighbours = [(letter, findings.get(letter, Found())) for letter in letters]
        gap, names = _gap(neighbours), " and ".join(letter for letter, _ in neighbours)
        if region.n is None:
            findings[region.letter] = _match_between(region, gap, names, line.runs, finer)
        else:
            findings[region.letter].gap = gap
    return findings


def _match(region: Region, runs: list[Run]) -> Found:
    """Return what was found of a printed region with numbers."""
    matching = [run for run in runs if run.matches(region)]
    if matching:
        return Found(matching, place=_middle(matching))
    mirrored = [run for run in runs if run.matches(region, mirrored=True)]
    if mirrored:
        remark = "Found as its mirror image; which of the two is reached depends on the start."
        return Found(mirrored, remark, _middle(mirrored))
    impacts = (region.right or 0, region.left or 0)
    near = [
        run
        for run in runs
        if run.motion and run.turns == region.n and max(run.motion[1:]) == max(impacts) > min(run.motion[1:])
    ]
    if not near:
        return Found([], "Not found.")
    texts = [
        f"{run.label} at {run.clearances[0]:.4f} to {run.clearances[-1]:.4f}, with slowest impacts of speeds"
        f" {min(run.slowest):.4f} to {max(run.slowest):.4f}"
        for run in near
    ]
    _, place = min((speed, at) for run in near for speed, at in zip(run.slowest, run.clearances, strict=True))
    return Found([], f"Not reached from rest. Motions with the same n are {'; '.join(texts)}.", round(place, 4))


def _gap(neighbours: list[tuple[str, Found]]) -> tuple[float, float] | None:
    """Return the clearances between which a region must be, the greater one first; None: a neighbour was not found."""
    before, after = ([value for run in finding.long for value in run.clearances] for _, finding in neighbours)
    if not before or not after:
        return None
    high = min(before)
    return high, max((value for value in after if value < high), default=high)


def _middle(runs: list[Run]) -> float:
    """Return a clearance in the middle of the longest run, with as few digits as it takes to stay in it."""
    run = max(runs, key=lambda run: len(run.clearances))
    middle = run.clearances[len(run.clearances) // 2]
    rounded = (round(middle, digits) for digits in (4, 5, 6))
    return next((value for value in rounded if run.clearances[-1] <= value <= run.clearances[0]), round(middle, 6))


def _match_between(region: Region, gap: tuple[float, float] | None, names: str, runs: list[Run], finer: Finer) -> Found:
    """Return what was found of a region printed with "multi", which lies between two others."""
    touching_runs = [run for run in runs if run.motion and run.motion[1:] == (region.right, region.left)]
    if touching_runs:
        return Found(touching_runs, place=_middle(touching_runs))
    remark = "No motion that only touches the stops was found. " if region.right == 0 else ""
    if gap is None:
        return Found([], f"{remark}Its neighbours {names} were not both found.")
    high, low = gap
    inside = [run for run in runs if low < run.clearances[0] < high]
    fine = "more closely spaced " if not inside else ""
    inside = inside or [run for run in finer(high, low) if low < run.clearances[0] < high]
    total = sum(len(run.clearances) for run in inside)
    unclosed = [run for run in inside if run.motion is None]
    count = sum(len(run.clearances) for run in unclosed)
    extent = f", from {unclosed[0].clearances[0]:.5f} to {unclosed[-1].clearances[-1]:.5f}," if unclosed else ""
    periods = [run.motion[0] for run in inside if run.motion]
    closed = f"; the others have periods from {min(periods)} to {max(periods)}" if periods else ""
    text = (
        f"{remark}At {count} of {total} {fine}clearances between {names}{extent} the motion does not close in"
        f" {MAX_PERIODS} periods{closed}."
    )
    chosen = [run for run in unclosed if run.kind == "chaotic"] or unclosed
    return Found([], text, _middle(chosen) if chosen else None, gap)
