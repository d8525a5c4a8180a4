"""The chance that a chaotic motion settles later: a sample of chaotic trajectories, run on for ten times as long.

A motion is called chaotic after the forcing periods that were simulated. It may be a transient that ends on a periodic
motion: trajectories leave the neighbourhood of a chaotic saddle after times that vary exponentially (Lai & Tél 2011),
and one trajectory does not distinguish such a saddle from an attractor. So the chance to settle is measured for all
chaotic motions of a result together: trajectories that are evenly spaced among them are simulated for RUN_ON times as
many periods in all, and those that become periodic are counted.

References
----------
Y.-C. Lai, T. Tél, Transient Chaos, Springer (2011), chapter 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import RESOLVED
from grazemap_core.contact.cell_problem import Clearance
from grazemap_core.maps.adaptive_map import Settings
from grazemap_core.maps.basin_fractions import Point, Settlers, from_rest
from grazemap_core.maps.basins import Coordinate, initial_states, run_states
from grazemap_core.maps.bifurcation_diagrams import Section
from grazemap_core.maps.binomial import interval
from grazemap_core.maps.kernels.lane_state import GROWTH, HALVES_RUN, REASON, UNVERIFIED
from grazemap_core.maps.planes import Line, Plane, PlaneSettler
from grazemap_core.maps.settling import Settler, Settling
from grazemap_core.maps.tolerances import RUN_ON, RUN_ON_PERIODS, RUN_ON_SAMPLE
from grazemap_core.maps.unfolding import random_starts
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS, kinds_of
from grazemap_core.simulation.start import forced_oscillator

_CHAOTIC: Final = KINDS.index("chaotic")


@dataclass(frozen=True)
class ChanceToSettle:
    """How many chaotic motions settle if they are simulated for RUN_ON times as many forcing periods.

    Attributes
    ----------
    watched, run_on : int
        Forcing periods after which motions were called chaotic, and after which those of the sample were named again.
    chaotic : int
        Number of chaotic motions.
    sampled, settled : int
        Number of those that were run on, without trajectories that ended early, and of those that became periodic.
    chance : float
        settled/sampled; NaN for an empty sample.
    low, high : float
        The interval of the chance (`binomial.interval`).
    """

    watched: int
    run_on: int
    chaotic: int
    sampled: int
    settled: int
    chance: float
    low: float
    high: float


def chance_in_map(kind: NDArray[Any], plane: Plane, **settings: Unpack[Settings]) -> ChanceToSettle | None:
    """Return the chance of the chaotic points of an unfolding map to settle; None if it has none.

    Parameters
    ----------
    kind : (n, m)
        Positions in `motion.KINDS`.
    plane, **settings
        As of `unfolding.unfolding_map_tile`, of the whole map.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    watched, max_period = settings.get("max_periods", 1000), settings.get("max_period", 32)
    policy = settings.get("policy", "rest")
    sweeps = policy.startswith("sweep")
    ensemble = policy == "ensemble"
    starts = None
    if ensemble:
        starts = random_starts(plane.oscillator, settings.get("initial_conditions", 16), settings.get("seed", 0))
    # a sweep reaches the point as in the map, and goes on there
    longer = Settling(watched if sweeps else RUN_ON * watched, max_period, linearised=sweeps, follow=sweeps)
    settler = PlaneSettler(plane, longer)
    of_map = PlaneSettler(plane, Settling(watched, max_period, starts=starts)) if ensemble else None

    def settles(position: int) -> bool | None:
        row, column = rows[[position]], columns[[position]]
        if sweeps:
            down = policy == "sweep-down"
            path = np.arange(plane.shape[0])[row[0] :][::-1] if down else np.arange(row[0] + 1)
            codes, _ = settler.sweep(np.concatenate([path, np.repeat(row, RUN_ON - 1)]), int(column[0]))
            return _outcome(codes[-RUN_ON:, 0], longer)
        if of_map is not None and starts is not None:
            chosen = starts[[_first_chaotic(of_map.points(row, column)[0][0])]]
            codes, _ = PlaneSettler(plane, longer._replace(starts=chosen)).points(row, column)
        else:
            codes, _ = settler.points(row, column)
        return _outcome(codes[-1:, 0], longer)

    return _chance(len(rows), watched, settles)


def chance_in_basins(
    kind: NDArray[Any],
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    horizontal: Coordinate,
    vertical: Coordinate,
    displacement: ArrayLike | None,
    velocity: ArrayLike | None,
    phase: float,
    max_periods: int,
    max_period: int,
) -> ChanceToSettle | None:
    """Return the chance of the states that lead to chaos to settle; None if there are none.

    Parameters
    ----------
    kind : (n, m)
        Positions in `motion.KINDS`.
    oscillator, omega, clearance, horizontal, vertical, displacement, velocity, phase, max_periods, max_period
        As of `basins.basin_tile`, of the whole rectangle.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    longer = Settling(RUN_ON * max_periods, max_period, linearised=False)
    settler, forced = Settler(oscillator, longer), forced_oscillator(oscillator, omega, clearance)

    def settles(position: int) -> bool | None:
        one = horizontal._replace(values=horizontal.values[columns[[position]]])
        other = vertical._replace(values=vertical.values[rows[[position]]])
        codes, _ = run_states(settler, forced, *initial_states(forced, one, other, displacement, velocity), phase)
        return _outcome(codes, longer)

    return _chance(len(rows), max_periods, settles)


def chance_in_fractions(
    kind: NDArray[Any], points: Sequence[Point], states: Floats, phase: float, max_periods: int, max_period: int
) -> ChanceToSettle | None:
    """Return the chance of the states that lead to chaos to settle, at all values together; None if there are none.

    Parameters
    ----------
    kind : (n, s)
        Positions in `motion.KINDS`.
    points, states, phase, max_periods, max_period
        As of `basin_fractions.fraction_tile`.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    longer = Settling(RUN_ON * max_periods, max_period, linearised=False)
    settlers = Settlers(longer)

    def settles(position: int) -> bool | None:
        point = points[rows[position]]
        forced = forced_oscillator(*point)
        start = from_rest(forced, states[columns[[position]]])
        return _outcome(run_states(settlers.of(point.oscillator), forced, *start, phase)[0], longer)

    return _chance(len(rows), max_periods, settles)


def chance_in_diagram(
    line: Line,
    sections: Sequence[Section],
    watched: int,
    max_period: int,
) -> ChanceToSettle | None:
    """Return the chance of the chaotic motions of a bifurcation diagram to settle; None if it has none.

    Parameters
    ----------
    line, max_period
        As of `bifurcation_diagrams.sections`.
    sections : (n,)
        In the order of the values.
    watched : int
        Forcing periods after which a motion was called chaotic.
    """
    chaotic = [number for number, section in enumerate(sections) if section.motion.kind == "chaotic"]
    longer = Settling(RUN_ON * watched, max_period, linearised=False)

    def settles(position: int) -> bool | None:
        number = chaotic[position]
        oscillator, omega, clearance = line.point(number)
        codes, _ = Settler(oscillator, longer).run_from(omega, clearance, sections[number].start)
        return _outcome(codes[None], longer)

    return _chance(len(chaotic), watched, settles)


def sample(chaotic: int, watched: int) -> list[int]:
    """Return the positions of the sample among a number of chaotic motions, in the order of a result's arrays."""
    number = min(chaotic, RUN_ON_SAMPLE, max(1, RUN_ON_PERIODS // (RUN_ON * watched)))
    return [(2 * k + 1) * chaotic // (2 * number) for k in range(number)]


def _chance(chaotic: int, watched: int, settles: Callable[[int], bool | None]) -> ChanceToSettle | None:
    """Return the chance of chaotic motions from a sample; `settles` takes a position among them. None without any."""
    if chaotic == 0:
        return None
    outcomes = [settled for settled in map(settles, sample(chaotic, watched)) if settled is not None]
    sampled, settled = len(outcomes), sum(outcomes)
    low, high = interval(settled, sampled)
    return ChanceToSettle(
        watched=watched,
        run_on=RUN_ON * watched,
        chaotic=chaotic,
        sampled=sampled,
        settled=settled,
        chance=settled / sampled if sampled else np.nan,
        low=low,
        high=high,
    )


def _outcome(codes: Integers, task: Settling) -> bool | None:
    """Return whether a trajectory settles in one of its consecutive runs (k, CODES); None if one ends early."""
    for run in codes:
        if run[REASON] == RESOLVED:
            return True
        if run[HALVES_RUN] < 2 * task.max_periods:
            return None
    return False


def _first_chaotic(codes: Integers) -> int:
    """Return the first of the initial states of a point, (s, CODES), that leads to chaos; 0 for none."""
    kind, _ = kinds_of(codes[:, REASON], codes[:, GROWTH], codes[:, UNVERIFIED])
    return int(np.argmax(kind == _CHAOTIC))
