"""Other stable motions at a point: a sample of random starts beside the one that was asked for.

A motion that a trajectory settles to holds from its start. Where others are stable at the same point, a knock may lead
to one of them. `other_motions` starts trajectories at random states and returns the verified motions that differ from
that of the start; `other_motions_of_map` does so at random points of a map from rest. A sample proves no absence: a
motion that few states lead to is easily missed.

Two verified motions are one if they have the same name and the same smallest impact velocity. Neither depends on when
the motion is looked at, so a motion some forcing periods later is not counted again, nor is, between symmetric stops,
its mirror image.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import checked_order
from grazemap_core.maps.map_settings import AboutMiddle, Conditions, RunSettings, random_starts
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.tolerances import (
    MAP_POINTS_A_SAMPLE,
    MOST_SAMPLED_POINTS,
    OTHER_STARTS_KNOCK,
    OTHER_STARTS_PERIODS,
)
from grazemap_core.maps.unfolding import NAME, arrays_of
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.motion import KINDS, Motion
from grazemap_core.simulation.start import ForcedOscillator, State, forced_oscillator, initial_state
from grazemap_core.simulation.tolerances import LIMIT_DISTANCE, SEPARATION

Arrays = dict[str, NDArray[Any]]
_UNRESOLVED = KINDS.index("unresolved")


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """A verified motion that other starts lead to."""

    motion: Motion
    """Its name."""
    least_impact_velocity: float
    """Smallest velocity of its impacts; NaN without impacts."""
    multiplier: float
    """Largest modulus of the multipliers over a period."""
    starts: int
    """Number of starts that lead to it."""
    start: State
    """That of them which settles first."""
    settled_after: int
    """Forcing periods after which the trajectory from there had settled."""


@dataclass(frozen=True, eq=False)
class OtherMotions:
    """The motions that a sample of starts leads to, beside that of the start that was asked for."""

    motion: Motion
    """The motion that the given start leads to."""
    starts: int
    """Number of other starts; 0 where the motion from the given one is unresolved, so that there is nothing to differ
    from."""
    settled: int
    """Number of these starts whose motion is periodic and verified."""
    motions: list[OtherMotion]
    """The other motions, those that most starts lead to first."""


@in_own_period
def other_motions(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    count: int,
    seed: int = 0,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    max_periods: int = 1000,
    max_period: int = 32,
) -> OtherMotions:
    """Return the motions that random starts lead to, beside that of a given start.

    Parameters
    ----------
    omega : float
        > 0.
    clearance : float, or (float or None, float or None)
        As in `trajectories.trajectory`.
    count, seed : int
        Number of other starts, and the seed from which they are drawn, as those of an ensemble of `MapSettings`, but
        every other one with OTHER_STARTS_KNOCK times the velocities.
    displacement, velocity : (N,)
        The given start, by default at rest in the static equilibrium.
    phase : float
        Forcing phase at every start, radians.
    max_periods, max_period : int
        As in `map_settings.MapSettings`; the other starts run for OTHER_STARTS_PERIODS at most.

    Raises
    ------
    ParameterError
        An argument is out of its domain, or the contact does not start between the stops.
    """
    for name, value in (("starts", count), ("max_periods", max_periods), ("max_period", max_period)):
        checked_order(name, value, 1)
    forced = forced_oscillator(oscillator, float(omega), clearance)
    initial = initial_state(forced, displacement, velocity, phase)
    settings = RunSettings(max_periods, max_period, linearised=False)
    runner = Runner(oscillator, settings)
    codes, figures, _ = runner.run_from(forced, initial)
    given = arrays_of(codes[:, None], figures[:, None])
    if given["kind"][0] == _UNRESOLVED:
        return OtherMotions(_motion(given, 0), 0, 0, [])
    scaled = random_starts(oscillator, count, seed) * np.array([1.0, forced.omega])[:, None]
    scaled[1::2, 1] *= OTHER_STARTS_KNOCK
    start = AboutMiddle(scaled)
    conditions = Conditions.of(oscillator, np.array([forced.clearances]))
    runner = Runner(oscillator, settings._replace(max_periods=min(max_periods, OTHER_STARTS_PERIODS)), runner)
    every, every_figures = runner.run(forced.structure, conditions, start, phase)
    arrays = arrays_of(every[0].T, every_figures[0].T)
    states = runner.random_states(forced.structure, forced.clearance, start)
    motions = []
    for members in _groups(arrays, given, forced):
        first = members[np.argmin(arrays["settled_after"][members])]
        motions.append(
            OtherMotion(
                motion=_motion(arrays, first),
                least_impact_velocity=float(arrays["least_impact_velocity"][first]),
                multiplier=float(arrays["multiplier"][first]),
                starts=len(members),
                start=State(states[first, 0], states[first, 1], phase),
                settled_after=int(arrays["settled_after"][first]),
            )
        )
    return OtherMotions(_motion(given, 0), count, int(np.count_nonzero(arrays["verified"])), motions)


@dataclass(frozen=True, eq=False)
class SeenOnMap:
    """A motion that other starts lead to at points of a map."""

    row: int
    """Row of the first point where it was seen."""
    column: int
    """Its column."""
    given: Motion
    """The motion that the trajectory from rest leads to at that point."""
    other: OtherMotion
    """The motion as it is there, and a start that leads to it."""
    points: int
    """Number of points at which it was seen; `other` has the starts of the first one."""


@dataclass(frozen=True, eq=False)
class OtherMotionsOfMap:
    """The motions that a sample of starts at a sample of points leads to, beside those from rest."""

    points: int
    """Number of points of the sample whose motion from rest is known."""
    points_with_others: int
    """Number of these points at which other motions were seen."""
    seen: list[SeenOnMap]
    """The other motions by name, those seen at most points first; mirror images of one another have one entry."""


def other_motions_of_map(
    plane: Plane, count: int, seed: int = 0, max_periods: int = 1000, max_period: int = 32
) -> OtherMotionsOfMap | None:
    """Return the motions that other starts lead to at random points of a map from rest; None of a small map.

    Parameters
    ----------
    plane : Plane
        Of the whole map; of MAP_POINTS_A_SAMPLE points one is in the sample, of at most MOST_SAMPLED_POINTS.
    count, seed, max_periods, max_period
        As of `other_motions`, at every point; the seed is that of the points too.
    """
    rows, columns = plane.shape
    number = min(MOST_SAMPLED_POINTS, rows * columns // MAP_POINTS_A_SAMPLE)
    if number == 0:
        return None
    chosen = np.sort(np.random.default_rng(seed).choice(rows * columns, number, replace=False))
    known = with_others = 0
    seen: dict[tuple[Any, ...], SeenOnMap] = {}
    for row, column in zip(*(part.tolist() for part in np.divmod(chosen, columns)), strict=True):
        there = other_motions(*plane.at_point(row, column), count, seed, max_periods=max_periods, max_period=max_period)
        known, with_others = known + (there.starts > 0), with_others + bool(there.motions)
        here: dict[tuple[Any, ...], SeenOnMap] = {}
        for other in there.motions:
            here.setdefault(_name(other.motion, plane.mirrors), SeenOnMap(row, column, there.motion, other, 0))
        for name, first in here.items():
            before = seen.get(name, first)
            seen[name] = replace(before, points=before.points + 1)
    return OtherMotionsOfMap(known, with_others, sorted(seen.values(), key=lambda motion: -motion.points))


def _groups(arrays: Arrays, given: Arrays, forced: ForcedOscillator) -> list[Integers]:
    """Return the starts that lead to each verified motion that is not the given one, the largest group first."""
    accuracy = SEPARATION * LIMIT_DISTANCE * forced.omega * forced.stops.unit
    own, names = (_names(each, bool(forced.stops.symmetric)) for each in (given, arrays))
    groups: list[tuple[tuple[Any, ...], float, list[int]]] = [(own[0], float(given["least_impact_velocity"][0]), [])]
    for number in np.flatnonzero(arrays["verified"]).tolist():
        name, velocity = names[number], float(arrays["least_impact_velocity"][number])
        for known, its_velocity, members in groups:
            if name == known and (abs(velocity - its_velocity) <= accuracy or np.isnan(velocity)):
                members.append(number)
                break
        else:
            groups.append((name, velocity, [number]))
    others = [np.array(members) for _, _, members in groups[1:]]
    return sorted(others, key=lambda members: -len(members))


def _names(arrays: Arrays, mirrors: bool) -> list[tuple[Any, ...]]:
    """Return what names each motion; with `mirrors` the same for its mirror image."""
    return [_name(_motion(arrays, number), mirrors) for number in range(len(arrays["kind"]))]


def _name(motion: Motion, mirrors: bool) -> tuple[Any, ...]:
    right, left = motion.impacts_right, motion.impacts_left
    if mirrors and right is not None and left is not None:
        right, left = min(right, left), max(right, left)
    return motion.kind, motion.period, right, left, motion.symmetric, motion.sticking


def _motion(arrays: Arrays, number: int) -> Motion:
    kind = KINDS[int(arrays["kind"][number])]
    named: dict[str, Any] = {}
    if kind == "periodic":
        named = {name: arrays[name][number].item() for name in NAME[1:]}
    return Motion(kind=kind, **({"sticking": False} | named), verified=bool(arrays["verified"][number]))
