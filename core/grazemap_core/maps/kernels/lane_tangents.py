"""Small changes of the state along all lanes, half period by half period, as in `lyapunov` for one trajectory.

After a half period the lanes' events hold its impacts, which determine the propagation of changes between rests. Pairs
of changes are propagated side by side (`tangent_pairs`) where the flow over half a period is tabulated. A half period
with a rest, with an impact at speed 0, or with more impacts than the events hold is computed again for the lane alone
(`tangent`), from the lane's state at its start. The errors of the lanes (`lane_errors`) are carried along.

    begin_matrix_of, begin_growth_of     start propagating changes along a lane
    save_lane_starts                     at the start of a half period, all lanes
    carry_lanes                          at its end
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import HELD, IMPACT, KIND, OK, ROWS, TIME, VELOCITY, Workspace, workspace
from grazemap_core.maps.kernels.lane_errors import (
    LaneErrors,
    carry_changes,
    carry_widths,
    lane_errors,
    lose_error,
    move_error,
    note_impacts,
)
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import CONTACT_ACCELERATION, FREE, Lanes
from grazemap_core.maps.kernels.tangent_pairs import PairBatch, carry_pairs, pair_batch
from grazemap_core.maps.tolerances import HALF_PERIOD_EVENTS
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel, plain
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.simulation.kernels import lyapunov
from grazemap_core.simulation.kernels.tangent import apply_saltation, flow_tangent, run_half_linearised

RECORDED_IMPACTS = MAX_VERIFIED_IMPACTS + HALF_PERIOD_EVENTS
"""Capacity of a lane's events. In at least half of all cases this suffices for all impacts of a motion that is to be
verified; otherwise the motion is run again to obtain them."""
SCALAR_EVENTS = 4096
"""Maximum number of events in half a period with which changes are propagated."""

NOTHING, ALL, PAIR, LOST = 0, 1, 2, 3
"""Changes along a lane: none; a basis of all; two that are kept orthonormal, with their growth; or propagation has
failed."""


class LaneTangents(NamedTuple):
    """Small changes of the state along every lane.

    Attributes
    ----------
    carried, grown : (LANES,)
        NOTHING, ALL, PAIR or LOST; half periods over which growth was measured.
    full, pair : (LANES, 2 N, 2 N), (LANES, 2 N, 2)
        The tangents, as columns.
    growth, moments : (LANES, halves, 2), (LANES, 2, 2 N, 2)
        As in `lyapunov.Tangents`.
    errors : LaneErrors
    even, cursor, near, resting, since
        State and regime of every lane at the start of the half period, as in `lockstep.Lanes`.
    batch : PairBatch
    scratch : Tangents
    work : Workspace
        Scratch for a lane alone.
    """

    carried: Integers
    grown: Integers
    full: Floats
    pair: Floats
    growth: Floats
    moments: Floats
    errors: LaneErrors
    even: Floats
    cursor: Integers
    near: Floats
    resting: Floats
    since: Floats
    batch: PairBatch
    scratch: lyapunov.Tangents
    work: Workspace


def lane_tangents(decay: Floats, frequency_squared: Floats, halves: int) -> LaneTangents:
    """Return arrays for changes along lanes, none of which has any, and for growth over `halves` half periods."""
    masses = len(decay)
    size = 2 * masses
    return LaneTangents(
        carried=np.zeros(LANES, dtype=np.int64),
        grown=np.zeros(LANES, dtype=np.int64),
        full=np.zeros((LANES, size, size)),
        pair=np.zeros((LANES, size, 2)),
        growth=np.zeros((LANES, halves, 2)),
        moments=np.zeros((LANES, 2, size, 2)),
        errors=lane_errors(masses),
        even=np.zeros((2 * masses + 2) * LANES),
        cursor=np.zeros((LANES, 4), dtype=np.int64),
        near=np.zeros((LANES, 3)),
        resting=np.zeros((LANES, masses - 1, 2)),
        since=np.zeros((LANES, 2)),
        batch=pair_batch(decay, frequency_squared),
        scratch=lyapunov.tangents(masses, (halves + 1) // 2),
        work=workspace(masses, SCALAR_EVENTS),
    )


@kernel
def tangents_of_lane(tangents: LaneTangents, lane: int) -> lyapunov.Tangents:
    """Return the changes along one lane as the argument of functions of `lyapunov`."""
    return lyapunov.Tangents(
        tangents.full[lane],
        tangents.scratch.eigen,
        tangents.pair[lane],
        tangents.scratch.real,
        tangents.scratch.imaginary,
        tangents.growth[lane],
        tangents.scratch.series,
        tangents.moments[lane],
        tangents.scratch.began,
    )


@kernel
def move_tangents(tangents: LaneTangents, source: int, target: int) -> None:
    """Move a lane's changes to another lane, between half periods."""
    tangents.carried[target] = tangents.carried[source]
    tangents.carried[source] = NOTHING
    tangents.grown[target] = tangents.grown[source]
    copy_matrix(tangents.full[target], tangents.full[source])
    copy_matrix(tangents.pair[target], tangents.pair[source])
    copy_matrix(tangents.growth[target], tangents.growth[source])
    for part in range(2):
        copy_matrix(tangents.moments[target, part], tangents.moments[source, part])
    move_error(tangents.errors, source, target)


@kernel
def save_lane_starts(group: Lanes, tangents: LaneTangents, used: int) -> None:
    """Save the states and regimes of the lanes at the start of a half period."""
    regime = group.regime
    copy_vector(tangents.even, group.even)
    copy_matrix(tangents.cursor, group.cursor)
    for lane in range(used):
        if regime[lane] != FREE:
            copy_vector(tangents.near[lane], group.near[lane])
            copy_matrix(tangents.resting[lane], group.resting[lane])
            copy_vector(tangents.since[lane], group.since[lane])


@kernel
def _carry_through_impacts(
    problem: CellProblem, events: Floats, first: int, rows: int, viscous_term: float, columns: Floats
) -> None:
    """Propagate changes along a half period without rests; its impacts are rows first to rows - 1 of the events."""
    factor = 1.0 + problem.restitution
    passed = 0.0
    for row in range(first, rows + 1):
        last = row == rows
        time = problem.step * (problem.cells // 2) if last else events[row, TIME]
        flow_tangent(problem.decay, problem.discriminant, problem.frequency_squared, time - passed, columns)
        passed = time
        if not last:
            # the viscous term of the acceleration changes sign with the velocity
            speed = abs(events[row, VELOCITY])
            apply_saltation(problem, speed, events[row, CONTACT_ACCELERATION] - viscous_term * factor * speed, columns)


@kernel
def _carry_again(
    problem: CellProblem,
    held: HeldProblem,
    tangents: LaneTangents,
    lane: int,
    clearance: float,
    half: int,
    columns: Floats,
    u: Floats,
) -> int:
    """Run a half period of one lane again, with its tangents. Returns the status of `tangent.run_half_linearised`."""
    work = tangents.work
    for j in range(u.shape[0]):
        for c in range(2):
            u[j, c] = tangents.even[(2 * j + c) * LANES + lane]
    copy_vector(work.cursor, tangents.cursor[lane])
    copy_vector(work.near[:3], tangents.near[lane])
    copy_matrix(held.state, tangents.resting[lane])
    copy_vector(held.since, tangents.since[lane])
    return run_half_linearised(problem, held, u, clearance, half, work, columns, tangents.scratch.began)


@kernel
def _orthonormalise_pair(
    problem: CellProblem, group: Lanes, tangents: LaneTangents, lane: int, sign: float, skipped: int
) -> None:
    """Make a lane's pair orthonormal at the end of a half period; enter its growth and the moments of the orbit."""
    k, halves = tangents.grown[lane], tangents.growth.shape[1]
    if k >= halves:
        return
    lyapunov.orthonormalise(problem.frequency, tangents.pair[lane], tangents.growth[lane, k])
    tangents.grown[lane] = k + 1
    if k >= skipped:
        moments = tangents.moments[lane, 0 if 2 * (k - skipped) < halves - skipped else 1]
        for c in range(moments.shape[0]):
            z = sign * group.even[c * LANES + lane]
            moments[c, 0] += z
            moments[c, 1] += z * z


@kernel
def carry_lanes(
    problem: CellProblem,
    held: HeldProblem,
    group: Lanes,
    tangents: LaneTangents,
    half: int,
    skipped: int,
    used: int,
    u: Floats,
) -> None:
    """Propagate changes of the state along the half period since `save_lane_starts`.

    Parameters
    ----------
    half : int
        Index of the half period.
    skipped : int
        Half periods at the start of a measurement of growth that do not count.
    u : (N, 2)
        Scratch.
    """
    carried, batch = tangents.carried, tangents.batch
    width = batch.lanes.shape[0]
    tabulated = problem.flow_table.shape[0] > problem.cells // 2
    sign = 1.0 if half % 2 == 0 else -1.0
    filled, most = int(np.int64(0)), int(np.int64(0))
    for lane in range(used):
        if (carried[lane] != ALL and carried[lane] != PAIR) or group.status[lane] != OK:
            continue
        first, rows = tangents.cursor[lane, ROWS], group.cursor[lane, ROWS]
        impacts_only = _has_impacts_only(group.events, tangents.cursor, group.cursor, lane)
        if carried[lane] == PAIR and impacts_only and tabulated:
            batch.lanes[filled], batch.first[filled], batch.impacts[filled] = lane, first, rows - first
            filled += 1
            most = max(most, rows - first)
            if filled == width:
                _carry_batch(problem, held.viscous_term, group, tangents, filled, most, skipped, sign)
                filled, most = int(np.int64(0)), int(np.int64(0))
            continue
        columns = tangents.full[lane] if carried[lane] == ALL else tangents.pair[lane]
        if impacts_only:
            _carry_through_impacts(problem, group.events[lane], first, rows, held.viscous_term, columns)
        elif _carry_again(problem, held, tangents, lane, group.clearance[lane], half, columns, u) != OK:
            carried[lane] = LOST
        if carried[lane] == PAIR:
            _orthonormalise_pair(problem, group, tangents, lane, sign, skipped)
    if filled > 0:
        _carry_batch(problem, held.viscous_term, group, tangents, filled, most, skipped, sign)


@kernel
def carry_errors(
    problem: CellProblem, held: HeldProblem, group: Lanes, tangents: LaneTangents, half: int, used: int, u: Floats
) -> None:
    """Carry the errors of the lanes over the half period since `save_lane_starts`; parameters as `carry_lanes`."""
    errors, status, frequency, viscous_term = tangents.errors, group.status, problem.frequency, held.viscous_term
    carried, change, events, before, after = errors.carried, errors.change, group.events, tangents.cursor, group.cursor
    tabulated = problem.flow_table.shape[0] > problem.cells // 2
    ready, one = errors.lanes, plain(1)
    for lane in range(used):
        if carried[lane] == 0 or status[lane] != OK:
            continue
        impacts_only = _has_impacts_only(events, before, after, lane)
        if impacts_only and tabulated:
            continue
        ready[0] = lane
        if impacts_only:
            first, rows = before[lane, ROWS], after[lane, ROWS]
            note_impacts(errors, events, lane, first, rows)
            _carry_through_impacts(problem, events[lane], first, rows, viscous_term, change[lane])
        elif _carry_again(problem, held, tangents, lane, group.clearance[lane], half, change[lane], u) != OK:
            lose_error(errors, lane)
            continue
        carry_widths(frequency, group, errors, one, impacts_only)
    count = int(np.int64(0))
    for lane in range(used if tabulated else 0):
        if carried[lane] != 0 and status[lane] == OK and _has_impacts_only(events, before, after, lane):
            ready[count] = lane
            count += 1
    carry_changes(problem, viscous_term, group, errors, before, count)
    carry_widths(frequency, group, errors, count, one > 0)


@kernel
def _has_impacts_only(events: Floats, before: Integers, after: Integers, lane: int) -> bool:
    """Return whether a lane's half period has impacts of nonzero speed only, all of them in its events.

    `before` and `after` are the lanes' cursors at its start and at its end.
    """
    first, rows = before[lane, ROWS], after[lane, ROWS]
    if before[lane, HELD] != 0 or after[lane, HELD] != 0 or rows > events.shape[1]:
        return False
    for row in range(first, rows):
        if events[lane, row, KIND] != IMPACT or events[lane, row, VELOCITY] == 0.0:
            return False
    return True


@kernel
def _carry_batch(
    problem: CellProblem,
    viscous_term: float,
    group: Lanes,
    tangents: LaneTangents,
    count: int,
    most: int,
    skipped: int,
    sign: float,
) -> None:
    """Propagate the pairs of the first `count` lanes of the batch, with `most` impacts at most."""
    carry_pairs(tangents.batch, count, most, group.events, tangents.pair, problem, viscous_term)
    for k in range(count):
        _orthonormalise_pair(problem, group, tangents, tangents.batch.lanes[k], sign, skipped)


@kernel
def begin_matrix_of(tangents: LaneTangents, lane: int) -> None:
    """Start propagating a basis of all changes of the state along a lane."""
    tangents.carried[lane] = ALL
    lyapunov.begin_matrix(tangents_of_lane(tangents, lane))


@kernel
def begin_growth_of(problem: CellProblem, tangents: LaneTangents, lane: int) -> None:
    """Start propagating two changes of the state along a lane and measuring their growth."""
    tangents.carried[lane] = PAIR
    tangents.grown[lane] = 0
    lyapunov.begin_growth(problem, tangents_of_lane(tangents, lane))


@kernel
def multiplier_of_lane(problem: CellProblem, tangents: LaneTangents, lane: int) -> float:
    """Return the largest modulus of the eigenvalues of a lane's full columns, NaN where they could not be computed."""
    _, real, imaginary = lyapunov.leading_multiplier(problem, False, tangents_of_lane(tangents, lane))
    return math.hypot(real, imaginary)


@kernel
def growth_of_lane(
    problem: CellProblem, clearance: float, skipped: int, tangents: LaneTangents, lane: int
) -> tuple[int, float, float]:
    """Return the kind of motion that the growth along a lane implies, the largest exponent per time, and its error."""
    kind, first, error, _, _ = lyapunov.classify_growth(problem, clearance, skipped, tangents_of_lane(tangents, lane))
    return kind, first, error
