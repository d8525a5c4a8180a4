"""Figure 9: the paper's 22 motions, found again along two lines of falling clearance."""

from __future__ import annotations

from itertools import combinations

from grazemap import Client, PeriodicOrbit
from paper.motions import Line, motions_along
from paper.one_stop import one_stop
from paper.page import Section
from paper.paper import GAMMA, READINGS, REGIONS, Region
from paper.portraits import portraits
from paper.regions import Found, Regions, regions_of
from paper.samples import DRAWN, HEAD, MAX_PERIOD, PATIENCE, Sample, samples_of
from paper.touching import touching


def figure_9(client: Client, points: int) -> tuple[list[Section], list[Sample]]:
    """Return the part on Figure 9: head, frequencies, labels that were not found; and the samples of all regions."""
    lines: dict[str, list[Line]] = {
        name: [motions_along(client, name, omega, *limits, points) for omega, (limits, _) in REGIONS.items()]
        for name in READINGS
    }
    by_reading = {name: [regions_of(client, line) for line in lines[name]] for name in READINGS}
    sections, all_samples = [_head(by_reading, points, lines[GAMMA])], []
    for line, regions in zip(lines[GAMMA], by_reading[GAMMA], strict=True):
        samples = _samples(client, line.omega, regions)
        all_samples += samples
        sections.append(_of_line(line, regions, samples))
        sections += _not_found(client, line.omega, regions, samples)
    return sections, all_samples


def _samples(client: Client, omega: float, regions: Regions) -> list[Sample]:
    """Return a sample of every region that has a place."""
    span, printed = REGIONS[omega]
    places = {region: regions[region.letter].place for region in printed}
    return samples_of(client, omega, span, {region: at for region, at in places.items() if at is not None})


def _of_line(line: Line, regions: Regions, samples: list[Sample]) -> Section:
    """Return the section of a frequency: what was found, one motion of each region, and the whole sequence."""
    (high, low), printed = REGIONS[line.omega]
    section = Section(f"omega = {line.omega}, clearance from {high:g} down to {low:g}")
    section.show(
        ["region", "printed", "here, n = minimum period", "clearances", "remark"],
        [_row(region, regions[region.letter]) for region in printed],
    )
    section.say(
        "The next table has one motion of each region, at the middle of the longest interval of the line with the"
        " printed motion. Where the printed motion was not found, the table has the motion that is there instead; if"
        " this motion has one additional impact, it is taken at the clearance where that impact is slowest. Orbits with"
        " impacts are solved for by Newton's method. The time t counts from a zero of the forcing with positive slope,"
        " and speeds are those before the impacts. For motions that are their own mirror image the impacts of half a"
        " period are listed. The last column is the interval of b on which the branch of the orbit has stable motions;"
        f" trajectories from rest may settle to other motions there. Periods up to {MAX_PERIOD} are sought in"
        f" trajectories of {PATIENCE} periods."
    )
    section.show(HEAD, [sample.row for sample in samples])
    section.say(_verified(samples))
    name = f"figure_9_{f'{line.omega:g}'.partition('.')[2]}.png"
    section.draw(name, f"Phase portraits of mass 1 at omega = {line.omega}", lambda: portraits(samples))
    section.say("All motions on the line:")
    section.show(
        ["from", "to", "points", "motion", "turns at A"],
        [
            (f"{run.clearances[0]:.4f}", f"{run.clearances[-1]:.4f}", str(len(run.clearances)), run.label,
             str(run.turns or "-"))
            for run in line.runs
        ],
    )  # fmt: skip
    return section


def _verified(samples: list[Sample]) -> str:
    """Say which of the motions are verified, and what the others are."""
    orbits = [sample for sample in samples if sample.orbit is not None]
    verified = [sample for sample in orbits if sample.verified]
    text = (
        f"Of these {len(orbits)} orbits {len(verified)} are verified: each is isolated (by the theorem of Newton and"
        " Kantorovich), admissible (it meets the stops at its impacts only) and stable (all its multipliers are"
        " inside the unit circle)."
    )
    for sample in samples:
        name = f" In region {sample.region.letter}"
        if sample.orbit is not None and not sample.verified:
            text += f"{name} the orbit is found but not verified: {_lacking(sample.orbit)}."
        elif sample.orbit is None and sample.steady:
            text += f"{name} mass 1 moves without impacts, as it does wherever b > A(omega)."
        elif sample.orbit is None and sample.kind == "periodic":
            text += f"{name} the trajectory closes, and its orbit is not solved for."
        elif sample.orbit is None:
            text += f"{name} the motion does not close; {DRAWN} periods of it are drawn."
    by_letter = {sample.region.letter: sample for sample in orbits if sample.stable}
    alike = [
        f"{sample.region.letter} and {other.region.letter}"
        for sample, other in combinations(by_letter.values(), 2)
        if sample.row[-1] == other.row[-1]
    ]
    if alike:
        text += (
            f" Where two regions have the same interval ({', '.join(alike)}), their motions are on one branch or are"
            " mirror images of each other. The printed labels differ because of a loop in the picture or of the side"
            " that is hit, not because of a bifurcation."
        )
    return text


def _lacking(orbit: PeriodicOrbit) -> str:
    """Say what is missing for a verification."""
    if not orbit.isolated:
        return f"the Newton-Kantorovich number, which must be at most 1/2, is {orbit.kantorovich:.1e}"
    return f"contacts with a stop besides the impacts: {orbit.contacts}"


def _not_found(client: Client, omega: float, regions: Regions, samples: list[Sample]) -> list[Section]:
    """Return a section on each label with touches, or with impacts on one stop, that was not found from rest."""
    sections = []
    by_letter = {sample.region.letter: sample for sample in samples}
    for region in REGIONS[omega][1]:
        finding, sample = regions[region.letter], by_letter.get(region.letter)
        if finding.runs or finding.gap is None:
            continue
        if region.right == 0:
            sections.append(touching(client, omega, *finding.gap))
        elif region.right == -1 and sample is not None and sample.orbit is not None:
            sections.append(one_stop(client, sample, *finding.gap))
    return sections


def _head(by_reading: dict[str, list[Regions]], points: int, lines: list[Line]) -> Section:
    """Return what is said of both lines: what n means, and which reading of zeta has the paper's motions."""
    labelled = [
        (place, region)
        for place, (_, regions) in enumerate(REGIONS.values())
        for region in regions
        if region.n is not None
    ]
    again = {
        name: [(by_reading[name][place][region.letter], region) for place, region in labelled] for name in READINGS
    }
    again = {name: [(finding, region) for finding, region in pairs if finding.runs] for name, pairs in again.items()}
    least = sum(
        any(run.motion and run.motion[0] == region.n for run in finding.runs) for finding, region in again[GAMMA]
    )
    longest = sorted(again[GAMMA], key=lambda pair: -(pair[1].n or 0))[:2]
    examples = " and ".join(
        f"the motion printed as {region.label} closes after"
        f" {' or '.join(str(n) for n in sorted({run.motion[0] for run in finding.runs if run.motion}))} forcing periods"
        for finding, region in longest
    )
    head = Section("Figure 9: the paper's motions, found again")
    head.say(
        f"Figure 9 names {sum(len(regions) for _, regions in REGIONS.values())} motions as n-p_r-q_l, in the order of"
        " decreasing clearance, but it does not give the clearance of each. The tables below have the motions that"
        f" grazemap finds at {points} equally spaced clearances. Every trajectory starts at rest with forcing phase 0."
    )
    head.say(
        "**What n means.** The paper defines n as the motion's period in forcing periods. Its labels do not follow"
        f" this definition: {examples}. They fit another rule, which the tables test. The printed n counts how often,"
        " in one period of the motion, mass 1 turns back on the side of stop A, whether it hits the stop or not. These"
        " turns are the loops in a phase portrait. So a motion found here agrees with a printed label when the impacts"
        ' agree (a motion and its mirror image count as one) and the number of turns ("turns at A", counted on the'
        f" trajectory) is the printed n. By this rule {len(again[GAMMA])} of the {len(labelled)} labels with numbers"
        f" are found. Only {least} of them would be found if n were the minimum period in forcing periods, which is"
        " the n of grazemap and the paper's own definition."
    )
    head.say(_literal(lines))
    head.say("**The reading of zeta.** The table has the labels found by the same rule, along the same lines:")
    head.show(
        ["damping", "labels found", "not found"],
        [
            [
                name,
                f"{len(again[name])} of {len(labelled)}",
                ", ".join(
                    f"{region.letter} ({region.label})"
                    for place, region in labelled
                    if not by_reading[name][place][region.letter].runs
                )
                or "-",
            ]
            for name in READINGS
        ],
    )
    most = max(READINGS, key=lambda name: len(again[name]))
    head.say(f"So the motions of Figure 9 are those with {most}. The tables below are for {GAMMA}.")
    return head


def _literal(lines: list[Line]) -> str:
    """Say which labels with numbers trajectories from rest have along their line when n is the least period."""
    met: list[str] = []
    others: list[str] = []
    for line in lines:
        motions = {run.motion for run in line.runs}
        for region in REGIONS[line.omega][1]:
            if region.n is not None and region.right is not None and region.left is not None:
                either = {(region.n, region.right, region.left), (region.n, region.left, region.right)}
                (met if either & motions else others).append(f"{region.letter} ({region.label})")
    return (
        "With n read as the minimum period, trajectories from rest have these labels somewhere on their line:"
        f" {', '.join(met)}. They have these labels nowhere on it: {', '.join(others)}."
    )


def _row(region: Region, finding: Found) -> list[str]:
    where = "; ".join(f"{run.clearances[0]:.4f} to {run.clearances[-1]:.4f}" for run in finding.long)
    ours = " or ".join(sorted({run.label for run in finding.runs}))
    return [region.letter, region.label, ours or "-", where or "-", finding.remark]
