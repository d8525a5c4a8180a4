"""Changes of the state carried along lanes: what `lyapunov` does for one trajectory, half period by half period.

What flows in is a half period that lanes have just been through: the impacts that they have left in their events, all
that a change of the state needs between rests. A half period with a rest or with more impacts than there is room for is
gone through once more by the scalar kernel (`tangent`), from where the lane began it.

    begin_matrix_of, begin_growth_of     what is to be carried along a lane from now on
    keep                                 at the start of a half period, all lanes
    carry_lanes                          at its end
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.kernels.block_flow import block_flow
from grazemap_core.kernels.cells import CellProblem
from grazemap_core.kernels.compiled import copy_matrix, copy_vector, fused_inlined, kernel
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.lanes import LANES, Masses
from grazemap_core.kernels.lockstep import FREE, PRESSING, Lanes
from grazemap_core.kernels.lyapunov import (
    Tangents,
    begin_growth,
    begin_matrix,
    judge_growth,
    leading_multiplier,
    orthonormalise,
    tangents,
)
from grazemap_core.kernels.tangent import run_half_linearised
from grazemap_core.kernels.workspace import HELD, IMPACT, KIND, OK, ROWS, TIME, VELOCITY, Workspace, workspace

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ROOM = 48
"""Impacts of half a period that a lane has room for."""
FLOW_DEGREE = 13
"""Of the series of a flow over half a cell at most, so of exponents up to 1/2: 2^-14/14! = 7e-16 is left out."""
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
    series : (2, N, FLOW_DEGREE)
        Of each block's answer to a unit rate over a short time: coefficients from that of the first power on, and those
        of the derivative, from the constant on.
    scratch : Tangents
        All else that `lyapunov` needs.
    work : Workspace
        Scratch with room for the events of the scalar kernel.
    """

    carried: IntArray
    grown: IntArray
    full: FloatArray
    pair: FloatArray
    growth: FloatArray
    moments: FloatArray
    state: FloatArray
    cursor: IntArray
    near: FloatArray
    resting: FloatArray
    since: FloatArray
    series: FloatArray
    scratch: Tangents
    work: Workspace


def lane_tangents(decay: FloatArray, frequency_squared: FloatArray, halves: int) -> LaneTangents:
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
        series=_flow_series(decay, frequency_squared),
        scratch=tangents(masses, (halves + 1) // 2),
        work=workspace(masses, SCALAR_ROOM),
    )


def _flow_series(decay: FloatArray, frequency_squared: FloatArray) -> FloatArray:
    """Return `LaneTangents.series`: y'' = -w^2 y - 2 eta y' from y = 0, y' = 1."""
    series = np.zeros((2, len(decay), FLOW_DEGREE))
    before, term = np.zeros(len(decay)), np.ones(len(decay))
    for power in range(1, FLOW_DEGREE + 1):
        series[0, :, power - 1], series[1, :, power - 1] = term, power * term
        following = -(2.0 * decay * power * term + frequency_squared * before) / (power * (power + 1.0))
        before, term = term, following
    return series


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
    """Note where lanes with changes begin a half period, and have their impacts entered into their events."""
    carried, state, regime = changes.carried, changes.state, group.regime
    kept, cursor, even = changes.cursor, group.cursor, group.even
    for lane in range(used):
        if carried[lane] != ALL and carried[lane] != PAIR:
            cursor[lane, ROWS] = group.events.shape[1]
            continue
        for j in range(state.shape[1]):
            state[lane, j, 0] = even[2 * j * LANES + lane]
            state[lane, j, 1] = even[(2 * j + 1) * LANES + lane]
        cursor[lane, ROWS] = 0
        for i in range(cursor.shape[1]):
            kept[lane, i] = cursor[lane, i]
        if regime[lane] != FREE:
            copy_vector(changes.near[lane], group.near[lane])
            copy_matrix(changes.resting[lane], group.resting[lane])
            copy_vector(changes.since[lane], group.since[lane])


@fused_inlined
def _carry_between_stops(
    blocks: int,
    count: int,
    decay: FloatArray,
    discriminant: FloatArray,
    frequency_squared: FloatArray,
    readout: FloatArray,
    kick: FloatArray,
    factor: float,
    drag: float,
    end: float,
    step: float,
    flow_table: FloatArray,
    series: FloatArray,
    events: FloatArray,
    rows: int,
    columns: FloatArray,
) -> None:
    """Carry `count` columns along half a period that lasts until `end` and has impacts only.

    As `tangent.flow_tangent` and `tangent.strike_tangent`, but that the flow is one over whole cells, which is in the
    table, and a short one, of less than half a cell either way. Numbers of blocks and columns are constants to the
    compiler.
    """
    passed = 0.0
    for row in range(rows + 1):
        last = row == rows
        time = end if last else events[row, TIME]
        cells = int((time - passed) / step + 0.5)
        short = (time - passed) - cells * step
        for j in range(blocks):
            if cells < flow_table.shape[0]:
                y, rate = 0.0, 0.0
                for power in range(FLOW_DEGREE, 0, -1):
                    y = y * short + series[0, j, power - 1]
                    rate = rate * short + series[1, j, power - 1]
                y *= short
                square, twice = frequency_squared[j], 2.0 * decay[j]
                t = flow_table[cells, j]
                over = rate + twice * y
                e11, e12 = over * t[0] + y * t[2], over * t[1] + y * t[3]
                e21, e22 = rate * t[2] - square * y * t[0], rate * t[3] - square * y * t[1]
            else:
                e11, e12, e21, e22 = block_flow(decay[j], discriminant[j], frequency_squared[j], time - passed)
            for c in range(count):
                first, second = columns[2 * j, c], columns[2 * j + 1, c]
                columns[2 * j, c] = e11 * first + e12 * second
                columns[2 * j + 1, c] = e21 * first + e22 * second
        passed = time
        if last:
            break
        # of the acceleration before the impact and the velocity; the drag turns with the velocity
        ratio = events[row, PRESSING] / abs(events[row, VELOCITY]) - drag * factor
        for c in range(count):
            x, v = 0.0, 0.0
            for j in range(blocks):
                first, second = columns[2 * j, c], columns[2 * j + 1, c]
                x += readout[j, 0] * first + readout[j, 1] * second
                v += readout[j, 2] * first + readout[j, 3] * second
            velocity, displacement = -factor * (v - ratio * x), -factor * x
            for j in range(blocks):
                k0, k1 = kick[j, 0], kick[j, 1]
                columns[2 * j, c] += velocity * k0 + displacement * k1
                columns[2 * j + 1, c] += velocity * k1 - displacement * (
                    frequency_squared[j] * k0 + 2.0 * decay[j] * k1
                )


@kernel
def _go_through_again(
    problem: CellProblem,
    held: HeldProblem,
    changes: LaneTangents,
    lane: int,
    clearance: float,
    half: int,
    columns: FloatArray,
    u: FloatArray,
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
def carry_lanes(
    masses: Masses,
    problem: CellProblem,
    held: HeldProblem,
    group: Lanes,
    changes: LaneTangents,
    half: int,
    skipped: int,
    used: int,
    u: FloatArray,
) -> None:
    """Carry changes of the state along the half period that lanes have been through since `keep`.

    Parameters
    ----------
    masses : tuple of length N
    half : int
        Index of the half period.
    skipped : int
        Half periods at the beginning of a measurement of growth that do not count.
    u : (N, 2)
        Scratch.
    """
    carried, grown, full, pair, moments = changes.carried, changes.grown, changes.full, changes.pair, changes.moments
    events, cursor, even, status = group.events, group.cursor, group.even, group.status
    decay, discriminant, frequency_squared = problem.decay, problem.discriminant, problem.frequency_squared
    readout, kick, frequency = problem.readout, problem.kick, problem.frequency
    flow_table, series = problem.flow_table, changes.series
    factor, drag, end = 1.0 + problem.restitution, held.drag, problem.step * (problem.cells // 2)
    room, halves = events.shape[1], changes.growth.shape[1]
    sign = 1.0 if half % 2 == 0 else -1.0
    for lane in range(used):
        if (carried[lane] != ALL and carried[lane] != PAIR) or status[lane] != OK:
            continue
        columns = full[lane] if carried[lane] == ALL else pair[lane]
        rows = cursor[lane, ROWS]
        plain = changes.cursor[lane, HELD] == 0 and cursor[lane, HELD] == 0 and rows <= room
        for row in range(rows if plain else 0):
            plain = plain and events[lane, row, KIND] == IMPACT and events[lane, row, VELOCITY] != 0.0
        if plain:
            # written out for both, so that either number of columns is a constant
            impacts, n = events[lane], len(masses)
            if carried[lane] == ALL:
                _carry_between_stops(
                    n,
                    2 * n,
                    decay,
                    discriminant,
                    frequency_squared,
                    readout,
                    kick,
                    factor,
                    drag,
                    end,
                    problem.step,
                    flow_table,
                    series,
                    impacts,
                    rows,
                    columns,
                )
            else:
                _carry_between_stops(
                    n,
                    2,
                    decay,
                    discriminant,
                    frequency_squared,
                    readout,
                    kick,
                    factor,
                    drag,
                    end,
                    problem.step,
                    flow_table,
                    series,
                    impacts,
                    rows,
                    columns,
                )
        elif _go_through_again(problem, held, changes, lane, group.clearance[lane], half, columns, u) != OK:
            carried[lane] = LOST
            continue
        k = grown[lane]
        if carried[lane] == PAIR and k < halves:
            orthonormalise(frequency, columns, changes.growth[lane, k])
            if k >= skipped:
                part = 0 if 2 * (k - skipped) < halves - skipped else 1
                for c in range(moments.shape[2]):
                    z = sign * even[c * LANES + lane]
                    moments[lane, part, c, 0] += z
                    moments[lane, part, c, 1] += z * z
            grown[lane] = k + 1


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
    kind, first, error, _, _ = judge_growth(problem, clearance, skipped, of_lane(changes, lane))
    return kind, first, error
