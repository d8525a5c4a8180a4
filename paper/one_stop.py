"""Region (m) of Figure 9, 3-(-1)r-3l: where such a motion would be, and what is there instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grazemap import Client, OrbitBranch, PeriodicOrbit, Trajectories
from paper.asking import answers
from paper.motions import TRANSIENT
from paper.page import Section, below
from paper.paper import GAMMA, READINGS
from paper.samples import TURN, Sample, as_asked, stretch
from paper.starts import SEED, counted, states, swept

CHAIN = READINGS[GAMMA]
PERIOD, STOPS = 3, (-1, -1, -1)
GUESSES, STARTS = 40, 24
# Impacts of random guesses are no faster than twice those of the motions here.
FASTEST = 0.4
# Speeds and times of two solutions that are one.
SAME = 1e-6


@dataclass
class Searched:
    """What Newton's method comes to from random guesses at one clearance.

    Attributes
    ----------
    clearance : float
    failed : int
        Guesses from which it does not converge.
    repeated, other : list of PeriodicOrbit
        Different solutions: the motion with one impact a period, run through three times; and all others.
    """

    clearance: float
    failed: int
    repeated: list[PeriodicOrbit]
    other: list[PeriodicOrbit]

    @property
    def row(self) -> list[str]:
        """Its line on the page."""
        return [
            f"{self.clearance:.4f}",
            str(self.failed),
            str(len(self.repeated)),
            str(len(self.other)),
            str(sum(orbit.admissible for orbit in self.other)),
            str(sum(bool(np.any(orbit.velocities > 0.0)) for orbit in self.other)),
        ]


def one_stop(client: Client, sample: Sample, high: float, low: float, places: int = 6) -> Section:
    """Return the section; `sample` is the motion found instead, `high` and `low` the clearances to search between."""
    section = Section("Region (m): 3-(-1)r-3l")
    orbit = sample.orbit
    assert orbit is not None
    _branch(client, section, orbit)
    clearances = np.round(np.linspace(high, low, places + 2)[1:-1], 4).tolist()
    section.say(
        f"**Coexisting attractors.** The table has the motions of trajectories from rest and from {STARTS} random"
        f" states, {TRANSIENT} periods later, at clearances from region l down to region n:"
    )
    section.show(["b", "motions (number of starts)"], attractors(client, sample.omega, clearances))
    section.say(swept(client, sample.omega, high, low))
    searched = [search(client, sample.omega, value) for value in clearances]
    section.say(
        "**Unstable motions.** The equations of a motion of period 3 with three impacts on C are solved by Newton's"
        f" method from {GUESSES} random guesses at each of these clearances. The table has the number of guesses from"
        " which it does not converge; of different solutions with three equal impacts, which have period 1; of other"
        " solutions; of those among the others that are motions; and of those among the others with an impact velocity"
        " of the wrong sign."
    )
    section.show(
        ["b", "not converged", "equal impacts", "others", "motions among the others", "wrong sign among the others"],
        [outcome.row for outcome in searched],
    )
    solutions = [orbit for outcome in searched for orbit in outcome.other]
    lowest, highest = min(clearances), max(clearances)
    branches = followed(client, solutions, lowest, highest)
    admissible = sum(bool(branch.admissible.any()) for branch in branches)
    section.say(
        f"The branches of all {len(solutions)} other solutions, over b from {lowest:.4f} to {highest:.4f}, have"
        f" {sum(len(branch.parameter) for branch in branches)} computed points, and {admissible or 'none'} of these"
        f" branches {'has' if admissible < 2 else 'have'} a point that is a motion. This is a search; it does not"
        " exclude that there are others."
    )
    return section


def _branch(client: Client, section: Section, orbit: PeriodicOrbit) -> None:
    """Describe the motion with a slow impact on A, and where that impact vanishes."""
    single_impact = client.periodic_orbit(
        CHAIN, omega=orbit.omega, clearance=orbit.clearance + 2e-3, motion=(1, [-1]), progress=False
    )
    reach = (orbit.clearance - 0.05, orbit.clearance + 0.05)
    branch = client.orbit_branch(
        CHAIN, omega=orbit.omega, clearance=orbit.clearance, motion=orbit, range=reach, progress=False
    )
    single = client.orbit_branch(
        CHAIN,
        omega=single_impact.omega,
        clearance=single_impact.clearance,
        motion=single_impact,
        range=reach,
        progress=False,
    )
    vanishing = next(p for p in branch.special_points if p.type == "GR" and p.impact is not None)
    grazing = min(
        (p for p in single.special_points if p.type == "GR" and p.impact is None),
        key=lambda p: abs(p.parameter - vanishing.parameter),
    )
    left = vanishing.velocities[np.arange(len(orbit.stops)) != vanishing.impact]
    high, low = stretch(branch, orbit.clearance)
    hits = {stop: np.abs(orbit.velocities[orbit.stops == stop]) for stop in (1, -1)}
    section.say(
        "**The motion in this region.** Between regions l and n trajectories from rest settle to"
        f" {orbit.motion.label}, with one slow impact on A. At b = {orbit.clearance:.4f} the speed of this impact is"
        f" {float(hits[1].max()):.4f}; those on C are {float(hits[-1].min()):.4f} to {float(hits[-1].max()):.4f}. In"
        " the phase portrait above the motion can hardly be distinguished from one that only passes close to A. It is"
        f" stable from b = {high} to {low}, and the speed on A decreases to zero at b = {vanishing.parameter:.12f}."
        " The printed label would begin there. But there the three remaining impacts on C are equal to within"
        f" {below(float(np.ptp(left)))}: the motion is three periods of 1-(-1)r-1l, which itself begins to touch A at"
        f" b = {grazing.parameter:.12f}. So no branch of motions 3-(-1)r-3l starts here."
    )


def attractors(client: Client, omega: float, clearances: Sequence[float]) -> list[list[str]]:
    """Return for each clearance the motions from many starts."""
    questions = [
        {
            "oscillator": CHAIN.model_dump(), "omega": omega, "clearance": value, "initial": states(value, STARTS),
            "periods": 1, "transient_periods": TRANSIENT, "samples_per_period": 1,
        }
        for value in clearances
    ]  # fmt: skip
    results = answers(client, Trajectories, questions)
    return [[f"{value:.4f}", counted(result)] for value, result in zip(clearances, results, strict=True)]


def search(client: Client, omega: float, clearance: float) -> Searched:
    """Return the different solutions that random guesses lead to."""
    random = np.random.default_rng(SEED)
    phases = np.sort(random.uniform(0.0, PERIOD * TURN, (GUESSES, len(STOPS))), axis=1)
    velocities = -random.uniform(0.0, FASTEST, (GUESSES, len(STOPS)))
    questions = [
        {
            "oscillator": CHAIN.model_dump(), "omega": omega, "clearance": clearance,
            "motion": {"period": PERIOD, "stops": list(STOPS), "phases": times.tolist(), "velocities": speeds.tolist()},
        }
        for times, speeds in zip(phases, velocities, strict=True)
    ]  # fmt: skip
    orbits = answers(client, PeriodicOrbit, questions)
    solved: list[PeriodicOrbit] = []
    for orbit in orbits:
        if orbit.converged and not any(_same(orbit, known) for known in solved):
            solved.append(orbit)
    solved.sort(key=lambda orbit: tuple(np.sort(orbit.velocities).tolist()))
    repeated = [orbit for orbit in solved if float(np.ptp(orbit.velocities)) < SAME]
    other = [orbit for orbit in solved if float(np.ptp(orbit.velocities)) >= SAME]
    return Searched(clearance, sum(not orbit.converged for orbit in orbits), repeated, other)


def followed(client: Client, solutions: Sequence[PeriodicOrbit], low: float, high: float) -> list[OrbitBranch]:
    """Return the branches of solutions over the clearance."""
    questions = [
        {
            "oscillator": CHAIN.model_dump(), "omega": orbit.omega, "clearance": orbit.clearance,
            "motion": as_asked(orbit), "range": {"start": low, "stop": high},
        }
        for orbit in solutions
    ]  # fmt: skip
    return answers(client, OrbitBranch, questions)


def _same(orbit: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """Whether two solutions are one, up to whole forcing periods by which it is shifted: then the speeds are turned."""
    speeds = other.velocities
    return any(bool(np.all(np.abs(orbit.velocities - np.roll(speeds, k)) < SAME)) for k in range(len(speeds)))
