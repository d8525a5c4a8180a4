"""Changes of the state carried along lanes: what `lyapunov` does for one trajectory, half period by half period.

What flows in is a half period that lanes have just been through: the impacts that they have left in their events, all
that a change of the state needs between rests. Pairs go along with others (`pair_tiles`) where the flow over half a
period is tabled. A half period with a rest, with an impact at speed 0, or with more impacts than there is room for is
gone through once more by the scalar kernel (`tangent`), from where the lane began it.

    begin_matrix_of, begin_growth_of     what is to be carried along a lane from now on
    keep                                 at the start of a half period, all lanes
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
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import CONTACT_ACCELERATION, FREE, Lanes
from grazemap_core.maps.kernels.tangent_pairs import PairTile, carry_pairs, pair_tile
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.simulation.kernels.lyapunov import (
    Tangents,
    begin_growth,
    begin_matrix,
    classify_growth,
    leading_multiplier,
    orthonormalise,
    tangents,
)
from grazemap_core.simulation.kernels.tangent import apply_saltation, flow_tangent, run_half_linearised

ROOM = 48
"""Impacts of half a period that a lane has room for."""
RECORD = MAX_VERIFIED_IMPACTS + ROOM
"""Impacts that a lane's events keep, before they are begun anew: a proof finds all of a motion's there as often as not,
however many it has, and replays them else."""
SCALAR_ROOM = 4096
"""Events of half a period beyond which no changes are carried along."""

NOTHING, ALL, PAIR, LOST = 0, 1, 2, 3
"""What is carried along a lane: every change of the state; two, kept apart, with what they grow by; LOST when that has
failed."""


class LaneTangents(NamedTuple):
    """What the changes along every lane have come to.

    Attributes
    ----------
    carried, grown : (LANES,)
        NOTHING, ALL, PAIR or LOST; half periods over which growth was measured.
    full, pair : (LANES, 2 N, 2 N), (LANES, 2 N, 2)
        Columns of a matrix, and of an exponent's pair.
    growth, moments : (LANES, halves, 2), (LANES, 2, 2 N, 2)
        As in `lyapunov.Tangents`.
    state, cursor, near, resting, since : (LANES, N, 2), (LANES, 4), (LANES, 3), (LANES, N - 1, 2), (LANES, 2)
        Where every lane began the half period, as in `lockstep.Lanes`.
    tile : PairTile
    scratch : Tangents
        All else that `lyapunov` needs.
    work : Workspace
        Scratch with room for the events of the scalar kernel.
    """

    carried: Integers
    grown: Integers
    full: Floats
    pair: Floats
    growth: Floats
    moments: Floats
    state: Floats
    cursor: Integers
    near: Floats
    resting: Floats
    since: Floats
    tile: PairTile
    scratch: Tangents
    work: Workspace


def lane_tangents(decay: Floats, frequency_squared: Floats, halves: int) -> LaneTangents:
    """Return room for the changes along all lanes of a chain's blocks, and for exponents over so many half periods."""
    masses = len(decay)
    size = 2 * masses
    return LaneTangents(
        carried=np.zeros(LANES, dtype=np.int64),
        grown=np.zeros(LANES, dtype=np.int64),
        full=np.zeros((LANES, size, size)),
        pair=np.zeros((LANES, size, 2)),
        growth=np.zeros((LANES, halves, 2)),
        moments=np.zeros((LANES, 2, size, 2)),
        state=np.zeros((LANES, masses, 2)),
        cursor=np.zeros((LANES, 4), dtype=np.int64),
        near=np.zeros((LANES, 3)),
        resting=np.zeros((LANES, masses - 1, 2)),
        since=np.zeros((LANES, 2)),
        tile=pair_tile(decay, frequency_squared),
        scratch=tangents(masses, (halves + 1) // 2),
        work=workspace(masses, SCALAR_ROOM),
    )


@kernel
def of_lane(changes: LaneTangents, lane: int) -> Tangents:
    """Return one lane's changes, as `lyapunov` takes them."""
    return Tangents(
        changes.full[lane],
        changes.scratch.eigen,
        changes.pair[lane],
        changes.scratch.real,
        changes.scratch.imaginary,
        changes.growth[lane],
        changes.scratch.series,
        changes.moments[lane],
        changes.scratch.began,
    )


@kernel
def move_changes(changes: LaneTangents, source: int, target: int) -> None:
    """Move a lane's changes to another lane, between half periods."""
    changes.carried[target] = changes.carried[source]
    changes.carried[source] = NOTHING
    changes.grown[target] = changes.grown[source]
    copy_matrix(changes.full[target], changes.full[source])
    copy_matrix(changes.pair[target], changes.pair[source])
    copy_matrix(changes.growth[target], changes.growth[source])
    for part in range(2):
        copy_matrix(changes.moments[target, part], changes.moments[source, part])


@kernel
def keep(group: Lanes, changes: LaneTangents, used: int) -> None:
    """Note where lanes with changes begin a half period."""
    carried, state, regime = changes.carried, changes.state, group.regime
    kept, cursor, even = changes.cursor, group.cursor, group.even
    for lane in range(used):
        if carried[lane] != ALL and carried[lane] != PAIR:
            continue
        for j in range(state.shape[1]):
            state[lane, j, 0] = even[2 * j * LANES + lane]
            state[lane, j, 1] = even[(2 * j + 1) * LANES + lane]
        for i in range(cursor.shape[1]):
            kept[lane, i] = cursor[lane, i]
        if regime[lane] != FREE:
            copy_vector(changes.near[lane], group.near[lane])
            copy_matrix(changes.resting[lane], group.resting[lane])
            copy_vector(changes.since[lane], group.since[lane])


@kernel
def _carry_by_itself(
    problem: CellProblem, events: Floats, first: int, rows: int, viscous_term: float, columns: Floats
) -> None:
    """Carry columns along a half period of a lane with impacts only, rows first to rows - 1 of its events."""
    factor = 1.0 + problem.restitution
    passed = 0.0
    for row in range(first, rows + 1):
        last = row == rows
        time = problem.step * (problem.cells // 2) if last else events[row, TIME]
        flow_tangent(problem.decay, problem.discriminant, problem.frequency_squared, time - passed, columns)
        passed = time
        if not last:
            # the drag turns with the velocity
            speed = abs(events[row, VELOCITY])
            apply_saltation(problem, speed, events[row, CONTACT_ACCELERATION] - viscous_term * factor * speed, columns)


@kernel
def _go_through_again(
    problem: CellProblem,
    held: HeldProblem,
    changes: LaneTangents,
    lane: int,
    clearance: float,
    half: int,
    columns: Floats,
    u: Floats,
) -> int:
    """Carry changes along a half period by the scalar kernel. Status as `tangent.run_half_linearised`."""
    work = changes.work
    copy_matrix(u, changes.state[lane])
    copy_vector(work.cursor, changes.cursor[lane])
    copy_vector(work.near[:3], changes.near[lane])
    copy_matrix(held.state, changes.resting[lane])
    copy_vector(held.since, changes.since[lane])
    return run_half_linearised(problem, held, u, clearance, half, work, columns, changes.scratch.began)


@kernel
def _keep_apart(
    problem: CellProblem, group: Lanes, changes: LaneTangents, lane: int, sign: float, skipped: int
) -> None:
    """Make a lane's pair orthonormal at the end of a half period, and enter what it grew by and where the orbit is."""
    k, halves = changes.grown[lane], changes.growth.shape[1]
    if k >= halves:
        return
    orthonormalise(problem.frequency, changes.pair[lane], changes.growth[lane, k])
    changes.grown[lane] = k + 1
    if k >= skipped:
        moments = changes.moments[lane, 0 if 2 * (k - skipped) < halves - skipped else 1]
        for c in range(moments.shape[0]):
            z = sign * group.even[c * LANES + lane]
            moments[c, 0] += z
            moments[c, 1] += z * z


@kernel
def carry_lanes(
    problem: CellProblem,
    held: HeldProblem,
    group: Lanes,
    changes: LaneTangents,
    half: int,
    skipped: int,
    used: int,
    u: Floats,
) -> None:
    """Carry changes of the state along the half period that lanes have been through since `keep`.

    Parameters
    ----------
    half : int
        Index of the half period.
    skipped : int
        Half periods at the beginning of a measurement of growth that do not count.
    u : (N, 2)
        Scratch.
    """
    carried, events, cursor, kept = changes.carried, group.events, group.cursor, changes.cursor
    tile, width = changes.tile, changes.tile.lanes.shape[0]
    capacity, end = events.shape[1], problem.step * (problem.cells // 2)
    tabled = problem.flow_table.shape[0] > problem.cells // 2
    sign = 1.0 if half % 2 == 0 else -1.0
    filled, most = int(np.int64(0)), int(np.int64(0))
    for lane in range(used + 1):
        if filled == width or (lane == used and filled > 0):
            carry_pairs(
                tile,
                filled,
                most,
                events,
                changes.pair,
                problem.flow_table,
                problem.decay,
                problem.frequency_squared,
                problem.output_row,
                problem.unit_impulse,
                problem.step,
                1.0 + problem.restitution,
                held.viscous_term,
                end,
            )
            for k in range(filled):
                _keep_apart(problem, group, changes, tile.lanes[k], sign, skipped)
            filled, most = int(np.int64(0)), int(np.int64(0))
        if lane == used:
            break
        if (carried[lane] != ALL and carried[lane] != PAIR) or group.status[lane] != OK:
            continue
        first, rows = kept[lane, ROWS], cursor[lane, ROWS]
        impacts_only = kept[lane, HELD] == 0 and cursor[lane, HELD] == 0 and rows <= capacity
        for row in range(first, rows if impacts_only else first):
            struck = events[lane, row, KIND] == IMPACT and events[lane, row, VELOCITY] != 0.0
            impacts_only = impacts_only and struck
        if carried[lane] == PAIR and impacts_only and tabled:
            tile.lanes[filled], tile.first[filled], tile.impacts[filled] = lane, first, rows - first
            filled += 1
            most = max(most, rows - first)
            continue
        columns = changes.full[lane] if carried[lane] == ALL else changes.pair[lane]
        if impacts_only:
            _carry_by_itself(problem, events[lane], first, rows, held.viscous_term, columns)
        elif _go_through_again(problem, held, changes, lane, group.clearance[lane], half, columns, u) != OK:
            carried[lane] = LOST
        if carried[lane] == PAIR:
            _keep_apart(problem, group, changes, lane, sign, skipped)


@kernel
def begin_matrix_of(changes: LaneTangents, lane: int) -> None:
    """Have every change of the state carried along a lane from now on."""
    changes.carried[lane] = ALL
    begin_matrix(of_lane(changes, lane))


@kernel
def begin_growth_of(problem: CellProblem, changes: LaneTangents, lane: int) -> None:
    """Have two changes carried along a lane from now on, and what they grow by measured."""
    changes.carried[lane] = PAIR
    changes.grown[lane] = 0
    begin_growth(problem, of_lane(changes, lane))


@kernel
def multiplier_of_lane(problem: CellProblem, changes: LaneTangents, lane: int) -> float:
    """Return the largest modulus of the eigenvalues of a lane's full columns, NaN where they could not be computed."""
    _, real, imaginary = leading_multiplier(problem, False, of_lane(changes, lane))
    return math.hypot(real, imaginary)


@kernel
def judge_lane(
    problem: CellProblem, clearance: float, skipped: int, changes: LaneTangents, lane: int
) -> tuple[int, float, float]:
    """Return the kind that the growth along a lane makes of it, and the largest exponent and its error per time."""
    kind, first, error, _, _ = classify_growth(problem, clearance, skipped, of_lane(changes, lane))
    return kind, first, error
