"""Estimated error of the trajectory in each lane (one slot of a batch), and whether impacts may be false or missing.

The round-off of every half period is propagated as a small change of the state is: with g the growth of a change over a
half period and e the round-off in it, the width W of the error becomes ``sqrt(g^2 (W^2 + e^2) + e^2)``. One change is
carried along, which soon has the direction that grows most. W is in displacement of the contact. Where it is as large
as the motion, nothing more is carried.

Two decisions may be wrong. An impact, with speed v and acceleration a, may be a miss on the exact trajectory. It is not
where v^2/(2 |a|), the distance from the stop to the vertex of the parabola that q follows there, exceeds the error of
the displacement there, times a safety factor. That error is W times the contact displacement of the change there over
the largest that a change of its length can have, plus the round-off. And a passage without contact may be an impact:
its distance from the stop is compared with W. The growth of changes says nothing about these decisions: where a passage
at a small distance becomes an impact, the derivative of the motion jumps.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.runs import MIN_GAP, VELOCITY
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lanes import EVENT_ACCELERATION, Lanes
from grazemap_core.maps.kernels.tangent_batches import is_safe
from grazemap_core.maps.tolerances import (
    CLOSE_PASSAGE,
    ERROR_GROWTH,
    ERROR_SAFETY,
    FARTHEST_PASSAGE,
    HALF_PERIOD_ERROR,
)
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.lyapunov import begin_first


class LaneErrors(NamedTuple):
    """The error of every lane."""

    carried: Integers
    """(LANES,) 1 if its error is carried."""
    changes: Floats
    """(LANES, 2 N, 2) Small changes of the state (u, u'). The first one gives the error; after every half period its
    length in the energy norm is made 1. Where the growth of both is measured (`lane_tangents`), they are made
    orthonormal."""
    elapsed: Floats
    """(LANES,) Time since the last impact, to which the changes belong."""
    square: Floats
    """(LANES,) W^2."""
    since: Floats
    """(LANES,) Square of the largest growth of the change from any earlier time until now; 1 or more."""
    growth: Floats
    """(LANES,) Square of the largest growth of the change between any two times until now."""
    sensitive: Integers
    """(LANES,) 1 if a decision may be wrong."""


def lane_errors(masses: int) -> LaneErrors:
    """Return arrays for lanes without a trajectory."""
    return LaneErrors(
        carried=np.zeros(LANES, dtype=np.int64),
        changes=np.zeros((LANES, 2 * masses, 2)),
        elapsed=np.zeros(LANES),
        square=np.zeros(LANES),
        since=np.ones(LANES),
        growth=np.ones(LANES),
        sensitive=np.zeros(LANES, dtype=np.int64),
    )


@kernel
def forget_error(errors: LaneErrors, lane: int) -> None:
    """Set the error of a lane's state to 0; where it is to be carried, `begin_error` has to follow."""
    errors.square[lane] = 0.0
    errors.sensitive[lane] = 0
    errors.growth[lane] = 1.0


@kernel
def begin_change(frequency: Floats, errors: LaneErrors, lane: int) -> None:
    """Begin the first change of a lane, with the length 1; the second one becomes 0."""
    columns, square = errors.changes[lane], 0.0
    errors.elapsed[lane] = 0.0
    begin_first(frequency, columns)
    for i in range(columns.shape[0]):
        square += 1.0 / (i + 1.0) ** 2  # in the energy norm its entries are 1/(i + 1)
    for i in range(columns.shape[0]):
        columns[i, 0] /= math.sqrt(square)
        columns[i, 1] = 0.0


@kernel
def begin_error(frequency: Floats, errors: LaneErrors, lane: int) -> None:
    """Carry a lane's error from now on."""
    errors.carried[lane] = 1
    errors.since[lane] = 1.0
    errors.growth[lane] = 1.0
    begin_change(frequency, errors, lane)


@kernel
def lose_error(errors: LaneErrors, lane: int) -> None:
    """Note that the error of a lane is not known any more."""
    errors.carried[lane] = 0
    errors.sensitive[lane] = 1


@kernel
def move_error(errors: LaneErrors, source: int, target: int) -> None:
    """Move a lane's error to another lane."""
    errors.carried[target] = errors.carried[source]
    errors.carried[source] = 0
    copy_matrix(errors.changes[target], errors.changes[source])
    errors.elapsed[target] = errors.elapsed[source]
    errors.square[target] = errors.square[source]
    errors.since[target] = errors.since[source]
    errors.growth[target] = errors.growth[source]
    errors.sensitive[target] = errors.sensitive[source]


@kernel
def error_of(errors: LaneErrors, lane: int) -> float:
    """Return the estimated error of a lane in displacement of the contact, times its safety factor; 0 if sensitive.

    Where a decision may be wrong, the exact trajectory may differ altogether, so the computed one is followed as if it
    were exact.
    """
    return 0.0 if errors.sensitive[lane] != 0 else ERROR_SAFETY * math.sqrt(errors.square[lane])


@kernel
def transient_growth_of(errors: LaneErrors, lane: int) -> float:
    """Return the logarithm of the largest growth of a change between any two times, as far as it was carried."""
    return 0.5 * math.log(errors.growth[lane])


@kernel
def largest_reach(problem: CellProblem) -> float:
    """Return the largest displacement of the contact in a change of length 1."""
    square = 0.0
    for j in range(problem.reach.shape[0]):
        square += problem.reach[j] * problem.reach[j]
    return math.sqrt(square)


@kernel
def shorten_change(frequency: Floats, errors: LaneErrors, lane: int) -> float:
    """Make the length of a lane's first change 1, or begin a new change if the squared length is not safe to use.

    Returns the squared length before.
    """
    columns, square = errors.changes[lane], 0.0
    for j in range(frequency.shape[0]):
        square += (frequency[j] * columns[2 * j, 0]) ** 2 + columns[2 * j + 1, 0] ** 2
    if is_safe(square):
        for i in range(columns.shape[0]):
            columns[i, 0] /= math.sqrt(square)
    else:  # after a rest it may be 0
        begin_change(frequency, errors, lane)
    return square


@kernel
def steepest_impact(impacts: Floats) -> float:
    """Return the largest 2 |a|/v^2 of impacts, which are rows of a lane's events."""
    steepest = 0.0
    for row in range(impacts.shape[0]):
        steepest = max(steepest, 2.0 * abs(impacts[row, EVENT_ACCELERATION]) / impacts[row, VELOCITY] ** 2)
    return steepest


@kernel
def carry_error(group: Lanes, errors: LaneErrors, lane: int, growth: float, sharpest: float, steepest: float) -> None:
    """Carry a lane's error over a half period, and compare it with the decisions.

    Parameters
    ----------
    growth : float
        Square of the growth of its change.
    sharpest : float
        Largest 2 |a|/v^2 of the impacts times the contact displacement of the change at the impact, over the largest
        displacement that a change of its length can have.
    steepest : float
        Largest 2 |a|/v^2 of the impacts. Both are infinite where a decision is open: at a graze, or after too many
        impacts.
    """
    farthest = group.reach[lane] + group.unit[lane]
    largest, rounding = farthest * farthest, HALF_PERIOD_ERROR * farthest
    added = rounding * rounding
    start = errors.square[lane] + added
    end = growth * start + added
    errors.square[lane] = min(end, largest)
    since = max(growth * errors.since[lane], 1.0)
    errors.since[lane] = since
    errors.growth[lane] = max(errors.growth[lane], since)
    least = min(group.tally[MIN_GAP, lane], group.close[lane])
    width = math.sqrt(start)
    # infinite where `least` is 0: the decision is open
    share = max(max(width, math.sqrt(end)) / least, width * sharpest + rounding * steepest)
    if not ERROR_SAFETY * share < 1.0:
        errors.sensitive[lane] = 1
    if not end < largest:
        errors.carried[lane] = 0
    watch_passages(group, errors, lane)


@kernel
def watch_passages(group: Lanes, errors: LaneErrors, lane: int) -> None:
    """Set the distance from the stops up to which the gaps of a lane's passages are bounded (`Lanes.close`).

    It depends on the error that the next half period may bring. It is 0 where no error is carried, or a decision may
    already be wrong.
    """
    unit, close = group.unit[lane], 0.0
    if errors.carried[lane] != 0 and errors.sensitive[lane] == 0:
        expected = ERROR_GROWTH * ERROR_SAFETY * math.sqrt(errors.square[lane])
        close = min(max(expected, CLOSE_PASSAGE * unit), FARTHEST_PASSAGE * unit)
    group.limit[lane] -= close - group.close[lane]
    group.limit[LANES + lane] -= close - group.close[lane]
    group.close[lane] = close
