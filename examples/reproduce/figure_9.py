"""Figure 9: the paper's 22 motions, found again along two lines of falling clearance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from examples.reproduce.motions import MAX_PERIODS, Line, Run, motions_along, plain_runs
from examples.reproduce.page import Section
from examples.reproduce.paper import GAMMA, READINGS, REGIONS, Region
from grazemap import Client

FINE = 701


@dataclass
class Found:
    """What was found of one printed region: its runs, and a remark where that needs one."""

    runs: list[Run] = field(default_factory=list)
    remark: str = ""

    @property
    def long(self) -> list[Run]:
        """The runs of more than two clearances, or all where there are none."""
        return [run for run in self.runs if len(run.clearances) > 2] or self.runs


Regions = dict[str, Found]
Finer = Callable[[float, float], list[Run]]


def figure_9(client: Client, points: int) -> list[Section]:
    """Return the head of the part on Figure 9, and a section for each of its two frequencies."""
    lines: dict[str, list[Line]] = {
        name: [motions_along(client, name, omega, *limits, points) for omega, (limits, _) in REGIONS.items()]
        for name in READINGS
    }
    found = {name: [_regions_of(client, line) for line in lines[name]] for name in READINGS}
    sections = [_head(found, points)]
    for line, regions in zip(lines[GAMMA], found[GAMMA], strict=True):
        (high, low), printed = REGIONS[line.omega]
        section = Section(f"omega = {line.omega}, clearance from {high:g} down to {low:g}")
        section.show(
            ["region", "printed", "here, n = least period", "clearances", "remark"],
            [_row(region, regions[region.letter]) for region in printed],
        )
        section.say("The whole sequence:")
        section.show(
            ["from", "to", "points", "motion", "turns at A"],
            [
                (f"{run.clearances[0]:.4f}", f"{run.clearances[-1]:.4f}", str(len(run.clearances)), run.label,
                 str(run.turns or "-"))
                for run in line.runs
            ],
        )  # fmt: skip
        sections.append(section)
    return sections


def _head(found: dict[str, list[Regions]], points: int) -> Section:
    """Return what is said of both lines: what n means, and which reading of zeta has the paper's motions."""
    labelled = [
        (place, region)
        for place, (_, regions) in enumerate(REGIONS.values())
        for region in regions
        if region.n is not None
    ]
    again = {name: [(found[name][place][region.letter], region) for place, region in labelled] for name in READINGS}
    again = {name: [(one, region) for one, region in pairs if one.runs] for name, pairs in again.items()}
    least = sum(any(run.motion and run.motion[0] == region.n for run in one.runs) for one, region in again[GAMMA])
    longest = sorted(again[GAMMA], key=lambda pair: -(pair[1].n or 0))[:2]
    examples = " and ".join(
        f"the motion printed as {region.label} closes after"
        f" {' or '.join(str(n) for n in sorted({run.motion[0] for run in one.runs if run.motion}))} forcing periods"
        for one, region in longest
    )
    head = Section("Figure 9: the paper's motions, found again")
    head.say(
        f"Figure 9 names {sum(len(regions) for _, regions in REGIONS.values())} motions as n-p_r-q_l, in the order of"
        " falling clearance, without saying at which clearance each of them was computed. Below is what grazemap finds"
        f" at {points} equally spaced clearances, every trajectory started from rest with forcing phase 0."
    )
    head.say(
        "**What n means.** The paper defines n as the motion's period in forcing periods. Its labels do not follow"
        f" that: {examples}. They fit another rule, which the tables test: the printed n counts how often, in one"
        " period of the motion, mass 1 turns back on the side of stop A, whether it hits the stop or not; these are the"
        " loops that one sees in a phase portrait. So a row below agrees when the impacts agree (the mirror image of a"
        ' motion counts as the same) and the number of turns ("turns at A", counted on the trajectory) is the printed'
        f" n. By this rule {len(again[GAMMA])} of the {len(labelled)} labels with numbers are found, and {least} of"
        " them would be if n were the least period in forcing periods, which is what grazemap's own n is, as the paper"
        " defines it."
    )
    head.say("**Which reading of zeta.** By the same rule, along the same lines:")
    head.show(
        ["damping", "labels found", "not found"],
        [
            [
                name,
                f"{len(again[name])} of {len(labelled)}",
                ", ".join(
                    f"{region.letter} ({region.label})"
                    for place, region in labelled
                    if not found[name][place][region.letter].runs
                )
                or "-",
            ]
            for name in READINGS
        ],
    )
    most = max(READINGS, key=lambda name: len(again[name]))
    head.say(f"So the motions of Figure 9 are those with {most}. The tables below are with {GAMMA}.")
    return head


def _regions_of(client: Client, line: Line) -> Regions:
    """Return what was found of each region; those with numbers first, as the others lie between them."""

    def finer(high: float, low: float) -> list[Run]:
        return plain_runs(client, line.reading, line.omega, high, low, FINE)

    regions = REGIONS[line.omega][1]
    found = {region.letter: _match(region, line.runs) for region in regions if region.n is not None}
    for k, region in enumerate(regions):
        if region.n is None:
            neighbours = [(letter, found[letter]) for letter in (regions[k - 1].letter, regions[k + 1].letter)]
            found[region.letter] = _match_between(region, neighbours, line.runs, finer)
    return found


def _match(region: Region, runs: list[Run]) -> Found:
    """Return what was found of a printed region with numbers."""
    found = [run for run in runs if run.matches(region)]
    if found:
        return Found(found)
    mirrored = [run for run in runs if run.matches(region, mirrored=True)]
    if mirrored:
        return Found(mirrored, "As its mirror image: which of the two is reached depends on the start.")
    impacts = (region.right or 0, region.left or 0)
    near = [
        run
        for run in runs
        if run.motion and run.turns == region.n and max(run.motion[1:]) == max(impacts) > min(run.motion[1:])
    ]
    texts = [
        f"{run.label} at {run.clearances[0]:.4f} to {run.clearances[-1]:.4f}, its slowest impact at"
        f" {min(run.slowest):.4f} to {max(run.slowest):.4f}"
        for run in near
    ]
    return Found([], f"Not reached from rest. With the same n there are {'; '.join(texts)}." if near else "Not found.")


def _match_between(region: Region, neighbours: list[tuple[str, Found]], runs: list[Run], finer: Finer) -> Found:
    """Return what was found of a region printed with "multi", which lies between two others."""
    touching = [run for run in runs if run.motion and run.motion[1:] == (region.right, region.left)]
    if touching:
        return Found(touching)
    remark = "No motion that only touches was found. " if region.right == 0 else ""
    names = " and ".join(letter for letter, _ in neighbours)
    before, after = ([value for run in found.long for value in run.clearances] for _, found in neighbours)
    if not before or not after:
        return Found([], f"{remark}Its neighbours {names} were not both found.")
    high = min(before)
    low = max(value for value in after if value < high)
    inside = [run for run in runs if low < run.clearances[0] < high]
    fine = "finer " if not inside else ""
    inside = inside or [run for run in finer(high, low) if low < run.clearances[0] < high]
    total = sum(len(run.clearances) for run in inside)
    unclosed = [run for run in inside if run.motion is None]
    count = sum(len(run.clearances) for run in unclosed)
    extent = f" (from {unclosed[0].clearances[0]:.5f} to {unclosed[-1].clearances[-1]:.5f})" if unclosed else ""
    periods = [run.motion[0] for run in inside if run.motion]
    closed = f"; the others have periods from {min(periods)} to {max(periods)}" if periods else ""
    return Found(
        [],
        f"{remark}Of {total} {fine}clearances between {names}, {count}{extent} do not close in {MAX_PERIODS}"
        f" periods{closed}.",
    )


def _row(region: Region, found: Found) -> list[str]:
    where = "; ".join(f"{run.clearances[0]:.4f} to {run.clearances[-1]:.4f}" for run in found.long)
    ours = " or ".join(sorted({run.label for run in found.runs}))
    return [region.letter, region.label, ours or "-", where or "-", found.remark]
