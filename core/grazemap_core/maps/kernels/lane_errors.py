"""Estimated error of the trajectory in every lane, and whether a decision on its way may be wrong.

The round-off of every half period is propagated as a small change of the state is: with g the growth of a change over a
half period and e its round-off, the width W of the error becomes ``sqrt(g^2 (W^2 + e^2) + e^2)``. One change is carried
along, which soon has the direction that grows most. W is in displacement of mass 1. Where it is as large as the motion,
nothing more is carried.

A decision is an impact that happens, with speed v and acceleration a, where it could have been missed: it cannot if
v^2/(2 |a|) exceeds the error, in the share of W that the change has in the displacement there. Or it is a passage
without contact, whose distance from the stop is compared with W. The derivative alone says nothing about these: where a
passage at a small distance becomes an impact, it jumps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.workspace import HELD_LEFT, HELD_RIGHT, LEAST_GAP, ROWS, TIME, VELOCITY
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import CONTACT_ACCELERATION, Lanes
from grazemap_core.maps.tolerances import CLOSE_PASSAGE, ERROR_SAFETY, HALF_PERIOD_ERROR
from grazemap_core.numerics.jit.compiled import copy_matrix, fused_kernel, kernel
from grazemap_core.simulation.kernels.lyapunov import MIN_SAFE_SQUARE


class LaneErrors(NamedTuple):
    """Of every lane.

    Attributes
    ----------
    carried : (LANES,)
        1 if its error is carried.
    change : (LANES, 2 N, 1)
        A small change of the state (u, u'), of length 1 in the energy norm at the end of a half period.
    square : (LANES,)
        W^2.
    since, growth : (LANES,)
        Squares of the largest growth up to now from any earlier time, and of the largest growth between any two times.
    sensitive : (LANES,)
        1 if a decision may be wrong.
    lanes, grown, sharpest, steepest : (LANES,)
        Scratch: lanes that are carried together; squares of the growth of their changes over the half period; largest
        2 |a|/v^2 of their impacts, with and without the displacement of mass 1 in the change, as a share of the largest
        possible one.
    """

    carried: Integers
    change: Floats
    square: Floats
    since: Floats
    growth: Floats
    sensitive: Integers
    lanes: Integers
    grown: Floats
    sharpest: Floats
    steepest: Floats


def lane_errors(masses: int) -> LaneErrors:
    """Return arrays for lanes without a trajectory."""
    return LaneErrors(
        carried=np.zeros(LANES, dtype=np.int64),
        change=np.zeros((LANES, 2 * masses, 1)),
        square=np.zeros(LANES),
        since=np.ones(LANES),
        growth=np.ones(LANES),
        sensitive=np.zeros(LANES, dtype=np.int64),
        lanes=np.zeros(LANES, dtype=np.int64),
        grown=np.zeros(LANES),
        sharpest=np.zeros(LANES),
        steepest=np.zeros(LANES),
    )


@kernel
def forget_error(errors: LaneErrors, lane: int) -> None:
    """Note that the state of a lane has no error."""
    errors.square[lane] = 0.0
    errors.sensitive[lane] = 0


@kernel
def begin_error(frequency: Floats, errors: LaneErrors, lane: int) -> None:
    """Carry a lane's error from now on."""
    errors.carried[lane] = 1
    errors.since[lane] = 1.0
    errors.growth[lane] = 1.0
    for j in range(frequency.shape[0]):
        errors.change[lane, 2 * j, 0] = 1.0 / frequency[j]
        errors.change[lane, 2 * j + 1, 0] = 1.0 / (j + 2.0)


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
    copy_matrix(errors.change[target], errors.change[source])
    errors.square[target] = errors.square[source]
    errors.since[target] = errors.since[source]
    errors.growth[target] = errors.growth[source]
    errors.sensitive[target] = errors.sensitive[source]


@kernel
def error_of(errors: LaneErrors, lane: int) -> float:
    """Return the estimated error of a lane with its safety factor, in displacement of mass 1; 0 if it is sensitive.

    Of a sensitive trajectory only the computed one can be followed, with no regard to the exact one.
    """
    return 0.0 if errors.sensitive[lane] != 0 else ERROR_SAFETY * math.sqrt(errors.square[lane])


@kernel
def transient_growth_of(errors: LaneErrors, lane: int) -> float:
    """Return the logarithm of the largest growth of a change between any two times, as far as it was carried."""
    return 0.5 * math.log(errors.growth[lane])


@kernel
def _largest_reach(problem: CellProblem) -> float:
    """Return the largest displacement of mass 1 in a change of length 1."""
    square = 0.0
    for j in range(problem.reach.shape[0]):
        square += problem.reach[j] * problem.reach[j]
    return math.sqrt(square)


@kernel
def note_impacts(errors: LaneErrors, events: Floats, lane: int, first: int, rows: int) -> None:
    """Write `sharpest` and `steepest` of the first of `errors.lanes`, for a change of which no more is known."""
    steep = 0.0
    for row in range(first, rows):
        steep = max(steep, 2.0 * abs(events[lane, row, CONTACT_ACCELERATION]) / events[lane, row, VELOCITY] ** 2)
    errors.sharpest[0], errors.steepest[0] = steep, steep


@fused_kernel
def carry_changes(
    problem: CellProblem, viscous_term: float, group: Lanes, errors: LaneErrors, before: Integers, count: int
) -> None:
    """Carry the changes of the first `count` lanes of `errors.lanes` over a half period of impacts only.

    `before` is the lanes' cursor at its start. The flow over whole cells is tabulated; over the half cell left it is a
    series of degree 4, good for two digits or more.
    """
    # arrays are looked up before the loops (see `lockstep`)
    table, step, end = problem.flow_table, problem.step, problem.step * (problem.cells // 2)
    decay, frequency_squared, factor = problem.decay, problem.frequency_squared, 1.0 + problem.restitution
    output_row, unit_impulse = problem.output_row, problem.unit_impulse
    events, after, change, lanes = group.events, group.cursor, errors.change, errors.lanes
    sharpest, steepest, farthest = errors.sharpest, errors.steepest, _largest_reach(problem)
    for k in range(count):
        lane, sharp, steep = lanes[k], 0.0, 0.0
        rows, passed = after[lane, ROWS], 0.0
        for row in range(before[lane, ROWS], rows + 1):
            time = events[lane, row, TIME] if row < rows else end
            cells = int((time - passed) / step + 0.5)
            s = time - passed - cells * step
            passed = time
            x, v = 0.0, 0.0
            for j in range(decay.shape[0]):
                square, twice = frequency_squared[j], 2.0 * decay[j]
                first, rate = change[lane, 2 * j, 0], change[lane, 2 * j + 1, 0]
                y = table[cells, j, 0] * first + table[cells, j, 1] * rate
                y1 = table[cells, j, 2] * first + table[cells, j, 3] * rate
                y2 = -square * y - twice * y1
                y3 = -square * y1 - twice * y2
                y4 = -square * y2 - twice * y3
                y += s * (y1 + s * (y2 / 2.0 + s * (y3 / 6.0 + s * (y4 / 24.0))))
                y1 += s * (y2 + s * (y3 / 2.0 + s * (y4 / 6.0)))
                change[lane, 2 * j, 0], change[lane, 2 * j + 1, 0] = y, y1
                x += output_row[j, 0] * y + output_row[j, 1] * y1
                v += output_row[j, 2] * y + output_row[j, 3] * y1
            if row == rows:
                break
            speed = abs(events[lane, row, VELOCITY])
            ratio = events[lane, row, CONTACT_ACCELERATION] / speed - viscous_term * factor
            steep = max(steep, 2.0 * abs(ratio) / speed)
            sharp = max(sharp, 2.0 * abs(ratio) / speed * abs(x) / farthest)
            jump, moved = -factor * (v - ratio * x), -factor * x
            for j in range(decay.shape[0]):
                impulse, slope = unit_impulse[j, 0], unit_impulse[j, 1]
                curvature = frequency_squared[j] * impulse + 2.0 * decay[j] * slope
                change[lane, 2 * j, 0] += jump * impulse + moved * slope
                change[lane, 2 * j + 1, 0] += jump * slope - moved * curvature
        sharpest[k], steepest[k] = sharp, steep


@kernel
def _normalise(frequency: Floats, errors: LaneErrors, count: int) -> None:
    """Make the lengths of the changes of the first `count` lanes 1; write the squares of what they were."""
    change, lanes, squares = errors.change, errors.lanes, errors.grown
    for k in range(count):
        lane, square = lanes[k], 0.0
        for j in range(frequency.shape[0]):
            square += (frequency[j] * change[lane, 2 * j, 0]) ** 2 + change[lane, 2 * j + 1, 0] ** 2
        squares[k] = square
        if not MIN_SAFE_SQUARE < square < 1.0 / MIN_SAFE_SQUARE:  # after a rest nothing may be left of it
            square = float(frequency.shape[0])
            for j in range(frequency.shape[0]):
                change[lane, 2 * j, 0], change[lane, 2 * j + 1, 0] = 1.0 / frequency[j], 0.0
        shorter = 1.0 / math.sqrt(square)
        for c in range(change.shape[1]):
            change[lane, c, 0] *= shorter


@kernel
def carry_widths(frequency: Floats, group: Lanes, errors: LaneErrors, count: int, impacts_only: bool) -> None:
    """Carry the errors of the first `count` lanes of `errors.lanes` over a half period, after their changes.

    They are compared with the decisions. Without `impacts_only` mass 1 rests, after a chatter that leads to the rest in
    any case; or there is a graze, or too many impacts, and the decision is open.
    """
    _normalise(frequency, errors, count)
    clearances, reaches, tally = group.clearance, group.reach, group.tally
    lanes, grown, squares, since = errors.lanes, errors.grown, errors.square, errors.since
    most, sensitive, carried = errors.growth, errors.sensitive, errors.carried
    sharpest, steepest = errors.sharpest, errors.steepest
    for k in range(count):
        lane, growth = lanes[k], grown[k]
        clearance = clearances[lane]
        largest = (reaches[lane] + clearance) ** 2
        added = HALF_PERIOD_ERROR * HALF_PERIOD_ERROR * largest
        start = squares[lane] + added
        end = growth * start + added
        squares[lane] = min(end, largest)
        since[lane] = max(growth * since[lane], 1.0)
        most[lane] = max(most[lane], since[lane])
        least = min(tally[LEAST_GAP, lane], CLOSE_PASSAGE * clearance)
        share = math.sqrt(max(start, end)) / least
        if impacts_only:
            share = max(share, math.sqrt(start) * sharpest[k] + math.sqrt(added) * steepest[k])
        elif tally[HELD_RIGHT, lane] + tally[HELD_LEFT, lane] == 0.0:
            share = np.inf
        if not ERROR_SAFETY * share < 1.0:
            sensitive[lane] = 1
        if not end < largest:
            carried[lane] = 0
