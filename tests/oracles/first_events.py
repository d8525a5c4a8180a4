"""The first events of a system's motion from rest: in lockstep, of a single trajectory, and in fifty digits.

A motion is compared flight by flight: its impacts up to a rest, the release, the impacts after it, and so on. The
bounces of a complete chatter end where the rest of them is summed, which is a matter of tolerances, so only those that
both lists have are compared. A time may be off by `ACCURACY` of a forcing period, and by what an error of `ROUNDINGS`
of the displacements, at the start or at an impact, has grown to; where that exceeds `PREDICTABLE` nothing is compared.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np

from benchmarks.ensemble import first_impacts
from grazemap_core.contact.kernels.runs import CHATTER, IMPACT, RELEASE
from grazemap_core.contact.stops import both_clearances
from grazemap_core.simulation.trajectories import Trajectory, trajectory
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.support.random_systems import System

Floats = np.ndarray[Any, np.dtype[np.float64]]

EVENTS = 20
PERIODS = 60
ACCURACY = 1e-11
"""Of a time, in forcing periods, where an error of the initial state does not grow by more."""
ROUNDINGS = 64.0 * 2.0**-52
"""Of a state, in units of its largest displacement and 1, by whose growth a time may differ in addition."""
PREDICTABLE = 1e-6
"""Of a time, in forcing periods."""
TINY = 1e-30
"""Growth that counts as none."""
SLOW = 0.01
"""Speed of an impact, in units of the largest, below which an error of the displacement is smaller too."""
RESTING_ACCURACY = 1e-12
"""Of the times of rests and releases, in forcing periods, where an error does not grow by more."""
RESTING_PERIODS = 6


class Events(NamedTuple):
    """Signed times of impacts (the sign is the stop), and of releases after the rests that follow some of them.

    `rests` are the numbers of impacts before each rest, of which the last one stands for all that are summed. `whole`
    says whether there are no more within PERIODS.
    """

    impacts: Floats
    rests: list[int]
    releases: Floats
    whole: bool

    @classmethod
    def of_trajectory(cls, run: Trajectory) -> Self:
        """Return the first EVENTS impacts of a trajectory, and the releases between them."""
        chatters = np.flatnonzero(run.impacts.kind[:EVENTS] == "chatter")
        releases = run.sticking.stop_time[: len(chatters)]
        times = run.impacts.time * run.impacts.stop
        return cls(times[:EVENTS], (chatters + 1).tolist(), releases, len(times) <= EVENTS)

    @classmethod
    def of_lanes(cls, system: System) -> Self:
        """Return the first EVENTS impacts of the lockstep kernel, and the releases between them."""
        lanes = first_impacts(*system._replace(clearance=[system.clearance]), PERIODS, 2 * EVENTS)
        time = (lanes.half * (np.pi / system.omega) + lanes.time)[0]
        kind = lanes.kind[0]
        hits = np.isin(kind, (IMPACT, CHATTER))
        chatters = np.flatnonzero(kind[hits][:EVENTS] == CHATTER)
        times = (time * lanes.stop[0])[hits]
        releases = time[kind == RELEASE][: len(chatters)]
        return cls(times[:EVENTS], (chatters + 1).tolist(), releases, len(times) <= EVENTS and bool(kind[-1] == -1))

    @classmethod
    def of_oracle(cls, run: GeneralOracle) -> Self:
        """Return the events of a run."""
        with digits(run.digits):
            times, rests, releases = ([float(t) for t in part] for part in (run.times, run.rests, run.releases))
        before = [int(np.searchsorted(times, rest, side="right")) for rest in rests]
        return cls(np.array(times) * run.stops, before, np.array(releases), True)

    @property
    def last_flight(self) -> tuple[int, int]:
        """The number of rests, and of the impacts after the last of them."""
        return len(self.rests), len(self.impacts) - [0, *self.rests][-1]


class Outcome(NamedTuple):
    """Events compared; the largest error in forcing periods, and over that allowed; whether an event differs."""

    compared: int
    error: float
    share: float
    wrong: bool


def pairs(events: Events, other: Events) -> list[tuple[int, int, float, float]]:
    """Return events of both that are the same: their places, impacts from 0 and releases from -1 down, and times.

    Flights that follow on rests are compared as far as both motions have them. A flight between two rests may have more
    bounces in one list than in the other.
    """
    matches = []
    begins = [0, *events.rests], [0, *other.rests]
    for flight, (a, b) in enumerate(zip(*begins, strict=False)):
        ends = [part.rests[flight] - 1 if flight < len(part.rests) else len(part.impacts) for part in (events, other)]
        both = min(ends[0] - a, ends[1] - b)
        matches += [(a + k, b + k, float(events.impacts[a + k]), float(other.impacts[b + k])) for k in range(both)]
        if flight < min(len(events.releases), len(other.releases)):
            matches.append((-1 - flight, -1 - flight, float(events.releases[flight]), float(other.releases[flight])))
    return matches


def allowed(system: System, run: GeneralOracle) -> tuple[Floats, Floats]:
    """Return the errors of impacts and of releases that round-off may cause, at the start and at every impact.

    What a change of the initial state has grown to by two events says how an error that is made at the first one has
    grown by the second one; a transient that decays before the first impact does not make later errors smaller.
    """
    period = 2.0 * np.pi / system.omega
    if not run.times:
        return np.zeros(0), np.zeros(0)
    with digits(run.digits):
        error = ROUNDINGS * (max(float(abs(x)) for x in run.state().displacement) + 1.0)
        growth = run.growth()
        times, speeds = (np.array([abs(float(v)) for v in part]) for part in (run.times, run.speeds))
        releases = np.array([float(t) for t in run.releases])
    # of an error at an impact in units of one at the start; a slow bounce is as accurate as the impact before it
    speeds = np.maximum(speeds, SLOW * speeds.max())
    shares = np.maximum.accumulate([1.0, *1.0 / (speeds * np.maximum(growth.times, TINY))])
    of_impacts = np.maximum.accumulate(shares[1:] * growth.times)
    before = np.searchsorted(times, releases)
    of_releases = np.maximum(shares[before] * growth.releases, np.append(0.0, of_impacts)[before])
    return ACCURACY * period + error * of_impacts, ACCURACY * period + error * of_releases


def compared(system: System, events: Events, other: Events, limits: tuple[Floats, Floats]) -> Outcome:
    """Compare two lists of events; `limits` are the errors that are allowed of those of the second one."""
    period = 2.0 * np.pi / system.omega
    count, error, share, wrong = 0, 0.0, 0.0, False
    for _, place, a, b in sorted(pairs(events, other), key=lambda pair: abs(pair[3])):
        limit = limits[0][place] if place >= 0 else limits[1][-1 - place]
        if limit > PREDICTABLE * period:
            return Outcome(count, float(error), float(share), bool(wrong))
        away = abs(a - b)
        count, error, share = count + 1, max(error, away / period), max(share, away / limit)
        wrong = wrong or not away <= limit
    wrong = wrong or (events.whole and events.last_flight != other.last_flight)
    return Outcome(count, float(error), float(share), bool(wrong))


def exact_run(system: System, digits: int = 50) -> GeneralOracle:
    """Return a run from rest in multi-precision arithmetic that has not begun."""
    return GeneralOracle.of(system.oscillator, system.omega, *both_clearances(system.clearance), digits=digits)


def outcomes(system: System, *, lockstep: bool = True) -> tuple[Outcome, Outcome | None]:
    """Compare a trajectory, and the lockstep kernel, with fifty digits."""
    alone = Events.of_trajectory(trajectory(*system, periods=PERIODS, samples_per_period=1))
    run = exact_run(system)
    # as far as the trajectory has events, or to its end
    last = max([0.0, *np.abs(alone.impacts[-1:]), *alone.releases[-1:]])
    period = 2.0 * np.pi / system.omega
    run.run(until=PERIODS * period if alone.whole else float(last * (1.0 + 1e-12) + 1e-3 * PREDICTABLE * period))
    exact, limits = Events.of_oracle(run), allowed(system, run)
    lanes = compared(system, Events.of_lanes(system), exact, limits) if lockstep else None
    return compared(system, alone, exact, limits), lanes


def resting_outcome(system: System) -> Outcome:
    """Compare the times at which a trajectory comes to rest and is released with fifty digits."""
    period = 2.0 * np.pi / system.omega
    run = exact_run(system)
    run.run(until=RESTING_PERIODS * period)
    assert run.rests
    sticking = trajectory(*system, periods=RESTING_PERIODS, samples_per_period=1).sticking
    scale = max(float(abs(x)) for x in run.state().displacement) + 1.0
    with digits(run.digits):
        growth = run.growth()
        errors, limits = [], []
        for times, exact, grown in (
            (sticking.start, run.rests, growth.rests),
            (sticking.stop_time, run.releases, growth.releases),
        ):
            errors += [abs(float(t - a)) for t, a in zip(times.tolist(), exact, strict=False)]
            limits += [RESTING_ACCURACY * period + ROUNDINGS * scale * max(1.0, grow) for grow in grown]
    wrong = len(sticking.start) != len(run.rests) or any(a > b for a, b in zip(errors, limits, strict=True))
    share = max(a / b for a, b in zip(errors, limits, strict=True))
    return Outcome(len(errors), max(errors) / period, share, wrong)
