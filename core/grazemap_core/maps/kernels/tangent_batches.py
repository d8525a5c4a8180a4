"""Propagation of small changes of the state, for many lanes side by side, along half periods without rests on a stop.

As in `second_pass`, up to BATCH lanes are side by side in a batch, and every loop over them is straight-line
arithmetic over whole vectors. The compiler does not know the number of lanes: if it did, it would unroll a short loop
instead of vectorising it. In each step all lanes advance to their next impact. A lane without a further impact stays at
its last one; a lane without any impact advances to the end of the half period. A lane has one change, or two.

The time between two impacts is a whole number of parts of a cell, and a short time of at most half a part, forward or
backward. The flow over the parts is from a table, the flow over the short time from a series. The flow of a block
follows from the block's response to a unit velocity. The arithmetic is that of `advance_columns` and of
`tangent.apply_saltation`. At the end the changes of a lane are made orthonormal in the energy norm.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats, Integers, aligned
from grazemap_core.contact.kernels.runs import STOP, TIME, VELOCITY
from grazemap_core.maps.kernels import lane_tables
from grazemap_core.maps.kernels.first_pass import VECTOR, four_lane_rows
from grazemap_core.maps.kernels.lane_tables import (
    BLOCK_NUMBERS,
    FLOW_DEGREE,
    LANES,
    OF_CHANGES,
    RESPONSE_PARTS,
    LaneTables,
    put_in_changes,
)
from grazemap_core.maps.kernels.lanes import EVENT_ACCELERATION
from grazemap_core.maps.kernels.lockstep import Engine
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel, inlined, plain
from grazemap_core.numerics.jit.lane_values import lane_row, lane_value, record_of, table_of
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.tolerances import MIN_SAFE_SQUARE, RANK_ROUNDING

BATCH = 16
"""Lanes of a batch: two of the longest vectors of any processor."""

# rows of `TangentBatch.rows`
SHORT_TIME, PASSED, TARGET, PARTS = 0, 1, 2, 3
"""The short time of a flow; times of the last impact and of the next one; number of parts of a cell between them."""
FACTOR, RATIO = 4, 5
"""1 + R, or 0 without an impact; acceleration over velocity before the impact, both toward the stop."""
STEEPNESS, STEEPEST, SHARPEST = 6, 7, 8
"""2 |a|/v^2 at an impact; its maximum in the half period; the maximum of its product with |q| in the first change."""
SQUARE, OVERLAP, SECOND_SQUARE, REMAINDER = 9, 10, 11, 12
"""Scalar products of the changes at the end: of the first with itself and with the second, and of the second with
itself. REMAINDER is that of the second with itself after its share of the first was subtracted, 0 if only round-off was
left. SQUARE and REMAINDER are -1 where products have lost digits."""
SCALE = 13
"""Factor on a change."""
CONTACT_POSITION, CONTACT_VELOCITY = 14, 16
"""Position and velocity of the contact in both changes; at an impact then their jumps, the factors of T k and of k in
`tangent`."""
VELOCITY_AT, ACCELERATION_AT = 18, 19
"""Velocity before the impact, and acceleration toward the stop after it; 1 and 0 without an impact."""
DRAG = 20
"""The viscous term times FACTOR."""
END = 21
"""The end of the half period."""
CHANGE_ROWS = 22

Columns = tuple[int, ...]
"""One number, not used, for each change of a lane: to the compiler the length of the tuple is a constant."""
Flow = tuple[float, float, float, float]
"""A matrix (2, 2), row by row, that is applied to (u, u') of a block."""
Impulse = tuple[float, float, float]
"""Of a block after a unit impulse on the contact: u, u' and -u''."""


class TangentBatch(NamedTuple):
    """Working arrays for up to BATCH lanes."""

    lanes: Integers
    """(BATCH,) Index of a lane."""
    first: Integers
    """(BATCH,) Row of the half period's first impact in its events."""
    impacts: Integers
    """(BATCH,) Number of impacts."""
    changes: Floats
    """(4 N * BATCH,) For every block, u of every change, then u' of every change; side by side for the lanes."""
    flow: Floats
    """(2 N * BATCH,) Of every block, u and u' after the parts of a cell, from a unit velocity."""
    rows: Floats
    """(CHANGE_ROWS * BATCH,) Scratch, by the rows above."""


def tangent_batch(blocks: int) -> TangentBatch:
    """Return an empty batch for an oscillator of `blocks` blocks."""
    return TangentBatch(
        lanes=np.zeros(BATCH, dtype=np.int64),
        first=np.zeros(BATCH, dtype=np.int64),
        impacts=np.zeros(BATCH, dtype=np.int64),
        changes=aligned(np.zeros(4 * blocks * BATCH)),
        flow=aligned(np.zeros(2 * blocks * BATCH)),
        rows=aligned(np.zeros(CHANGE_ROWS * BATCH)),
    )


@fused_inlined
def _series(s: Floats, row: int, k: int, t: float) -> float:
    """Return at t the polynomial whose FLOW_DEGREE coefficients a lane k has in a row of `LaneTables.change_series`."""
    n = FLOW_DEGREE * row
    value: float = lane_value(lane_row(s, n + 6, BATCH), k)
    value = value * t + lane_value(lane_row(s, n + 5, BATCH), k)
    value = value * t + lane_value(lane_row(s, n + 4, BATCH), k)
    value = value * t + lane_value(lane_row(s, n + 3, BATCH), k)
    value = value * t + lane_value(lane_row(s, n + 2, BATCH), k)
    value = value * t + lane_value(lane_row(s, n + 1, BATCH), k)
    value = value * t + lane_value(lane_row(s, n, BATCH), k)
    return value


@fused_inlined
def _set_targets(engine: Engine, batch: TangentBatch, filled: int, width: int, scalars: Floats, index: int) -> None:
    """For every lane, write the flow from where it is to its impact number `index`, and the factors of the impact."""
    models, events, restitution = engine.models, engine.group.events, engine.group.restitution
    rows, flow = batch.rows, batch.flow
    steps, viscous = lane_row(scalars, lane_tables.STEP, BATCH), lane_row(scalars, lane_tables.VISCOUS_TERM, BATCH)
    for k in range(filled):
        time, factor, velocity, acceleration = rows[PASSED * BATCH + k], 0.0, 1.0, 0.0
        if index < batch.impacts[k]:
            event = events[batch.lanes[k], batch.first[k] + index]
            time, velocity, acceleration = event[TIME], event[VELOCITY], event[EVENT_ACCELERATION]
            factor = 1.0 + restitution[batch.lanes[k] + (0 if event[STOP] > 0.0 else LANES)]
        elif batch.impacts[k] == 0:
            time = rows[END * BATCH + k]
        rows[TARGET * BATCH + k] = time
        rows[FACTOR * BATCH + k] = factor
        rows[DRAG * BATCH + k] = lane_value(viscous, k) * factor
        rows[VELOCITY_AT * BATCH + k] = velocity
        rows[ACCELERATION_AT * BATCH + k] = acceleration
    for k in range(width):
        time, speed = rows[TARGET * BATCH + k], abs(rows[VELOCITY_AT * BATCH + k])
        ratio, away = rows[ACCELERATION_AT * BATCH + k] / speed, time - rows[PASSED * BATCH + k]
        part = lane_value(steps, k) / RESPONSE_PARTS
        parts = np.floor(away * (1.0 / part) + 0.5)
        rows[PARTS * BATCH + k] = parts
        rows[SHORT_TIME * BATCH + k] = away - parts * part
        rows[PASSED * BATCH + k] = time
        rows[RATIO * BATCH + k] = ratio - rows[DRAG * BATCH + k]
        rows[STEEPNESS * BATCH + k] = 2.0 * abs(ratio) / speed
    for k in range(filled):
        response = record_of(models, batch.lanes[k]).tables.block_response[int(rows[PARTS * BATCH + k])]
        for j in range(response.shape[0] // 2):
            flow[2 * j * BATCH + k] = response[2 * j]
            flow[(2 * j + 1) * BATCH + k] = response[2 * j + 1]


@fused_inlined
def _flow_change(rows: Floats, block: Floats, k: int, c: int, columns: int, flow: Flow, output: Flow) -> None:
    """Carry a block of change c of lane k to its next impact; add to CONTACT_POSITION and CONTACT_VELOCITY."""
    u, du = block[c * BATCH + k], block[(columns + c) * BATCH + k]
    u, du = flow[0] * u + flow[1] * du, flow[2] * u + flow[3] * du
    block[c * BATCH + k] = u
    block[(columns + c) * BATCH + k] = du
    rows[(CONTACT_POSITION + c) * BATCH + k] += output[0] * u + output[1] * du
    rows[(CONTACT_VELOCITY + c) * BATCH + k] += output[2] * u + output[3] * du


@fused_inlined
def _flow_changes(columns: Columns, batch: TangentBatch, width: int, tables: LaneTables, blocks: int) -> None:
    """Carry all changes over the parts of a cell and the short time; write position and velocity of the contact."""
    rows, flow, changes, series = batch.rows, batch.flow, batch.changes, tables.change_series
    count = len(columns)
    for k in range(width):
        rows[CONTACT_POSITION * BATCH + k], rows[CONTACT_VELOCITY * BATCH + k] = 0.0, 0.0
        if count == 2:
            rows[(CONTACT_POSITION + 1) * BATCH + k], rows[(CONTACT_VELOCITY + 1) * BATCH + k] = 0.0, 0.0
    for j in range(blocks):
        decays = lane_row(tables.block, BLOCK_NUMBERS * j, BATCH)
        squares = lane_row(tables.block, BLOCK_NUMBERS * j + 1, BATCH)
        r0, r1, r2, r3 = four_lane_rows(tables.output_row, j, BATCH)
        over = flow[2 * j * BATCH : (2 * j + 2) * BATCH]
        block = changes[2 * count * j * BATCH : 2 * count * (j + 1) * BATCH]
        for k in range(width):
            short = rows[SHORT_TIME * BATCH + k]
            square, twice = lane_value(squares, k), 2.0 * lane_value(decays, k)
            y, rate = _series(series, j, k, short) * short, _series(series, blocks + j, k, short)
            whole, whole_rate = over[k], over[BATCH + k]
            y, rate = (rate + twice * y) * whole + y * whole_rate, rate * whole_rate - square * y * whole
            to_impact = (rate + twice * y, y, -square * y, rate)
            output = (lane_value(r0, k), lane_value(r1, k), lane_value(r2, k), lane_value(r3, k))
            _flow_change(rows, block, k, plain(0), count, to_impact, output)
            if count == 2:
                _flow_change(rows, block, k, plain(1), count, to_impact, output)


@fused_inlined
def _strike_change(rows: Floats, block: Floats, k: int, c: int, columns: int, impulse: Impulse) -> None:
    """Add the jumps to a block of change c of lane k."""
    x, v = rows[(CONTACT_POSITION + c) * BATCH + k], rows[(CONTACT_VELOCITY + c) * BATCH + k]
    block[c * BATCH + k] += v * impulse[0] + x * impulse[1]
    block[(columns + c) * BATCH + k] += v * impulse[1] - x * impulse[2]


@fused_inlined
def _strike_changes(columns: Columns, batch: TangentBatch, width: int, tables: LaneTables, blocks: int) -> None:
    """Carry all changes through an impact; changes of a lane with FACTOR 0 stay as they are."""
    rows, changes, count = batch.rows, batch.changes, len(columns)
    for k in range(width):
        steepness, factor, ratio = rows[STEEPNESS * BATCH + k], rows[FACTOR * BATCH + k], rows[RATIO * BATCH + k]
        x = rows[CONTACT_POSITION * BATCH + k]
        sharpness = steepness * abs(x)
        steepest, sharpest = rows[STEEPEST * BATCH + k], rows[SHARPEST * BATCH + k]
        rows[STEEPEST * BATCH + k] = steepness if steepness > steepest else steepest
        rows[SHARPEST * BATCH + k] = sharpness if sharpness > sharpest else sharpest
        rows[CONTACT_VELOCITY * BATCH + k] = -factor * (rows[CONTACT_VELOCITY * BATCH + k] - ratio * x)
        rows[CONTACT_POSITION * BATCH + k] = -factor * x
        if count == 2:
            y = rows[(CONTACT_POSITION + 1) * BATCH + k]
            rows[(CONTACT_VELOCITY + 1) * BATCH + k] = -factor * (rows[(CONTACT_VELOCITY + 1) * BATCH + k] - ratio * y)
            rows[(CONTACT_POSITION + 1) * BATCH + k] = -factor * y
    for j in range(blocks):
        decay, square, first, second = four_lane_rows(tables.block, j, BATCH)
        block = changes[2 * count * j * BATCH : 2 * count * (j + 1) * BATCH]
        for k in range(width):
            displacement, velocity = lane_value(first, k), lane_value(second, k)
            curvature = lane_value(square, k) * displacement + 2.0 * lane_value(decay, k) * velocity
            impulse = (displacement, velocity, curvature)
            _strike_change(rows, block, k, plain(0), count, impulse)
            if count == 2:
                _strike_change(rows, block, k, plain(1), count, impulse)


@fused_inlined
def _products(columns: Columns, batch: TangentBatch, width: int, tables: LaneTables, blocks: int) -> None:
    """Write SQUARE, OVERLAP and SECOND_SQUARE; the last two are 0 with a single change."""
    rows, changes, count = batch.rows, batch.changes, len(columns)
    for k in range(width):
        rows[SQUARE * BATCH + k], rows[OVERLAP * BATCH + k], rows[SECOND_SQUARE * BATCH + k] = 0.0, 0.0, 0.0
    for j in range(blocks):
        frequency = lane_row(tables.bound, 3 * j, BATCH)
        block = changes[2 * count * j * BATCH : 2 * count * (j + 1) * BATCH]
        for k in range(width):
            stiffness = lane_value(frequency, k) * lane_value(frequency, k)
            u, du = block[k], block[count * BATCH + k]
            rows[SQUARE * BATCH + k] += stiffness * (u * u) + du * du
            if count == 2:
                w, dw = block[BATCH + k], block[3 * BATCH + k]
                rows[OVERLAP * BATCH + k] += stiffness * (u * w) + du * dw
                rows[SECOND_SQUARE * BATCH + k] += stiffness * (w * w) + dw * dw


@fused_inlined
def _subtract_first(batch: TangentBatch, width: int, tables: LaneTables, blocks: int) -> None:
    """Subtract from the second change its share of the first, and write REMAINDER."""
    rows, changes = batch.rows, batch.changes
    for k in range(width):
        rows[REMAINDER * BATCH + k] = 0.0
        rows[SCALE * BATCH + k] = rows[OVERLAP * BATCH + k] / rows[SQUARE * BATCH + k]
    for j in range(blocks):
        frequency = lane_row(tables.bound, 3 * j, BATCH)
        block = changes[4 * j * BATCH : 4 * (j + 1) * BATCH]
        for k in range(width):
            stiffness = lane_value(frequency, k) * lane_value(frequency, k)
            share = rows[SCALE * BATCH + k]
            w = block[BATCH + k] - share * block[k]
            dw = block[3 * BATCH + k] - share * block[2 * BATCH + k]
            block[BATCH + k], block[3 * BATCH + k] = w, dw
            rows[REMAINDER * BATCH + k] += stiffness * (w * w) + dw * dw


@fused_inlined
def _shorten(columns: Columns, batch: TangentBatch, width: int, blocks: int) -> None:
    """Make the lengths of the changes 1. A change with the square 0 becomes 0; one with a negative square stays."""
    rows, changes, count = batch.rows, batch.changes, len(columns)
    for c in range(count):
        row = SQUARE if c == 0 else REMAINDER
        squares, scale = rows[row * BATCH : (row + 1) * BATCH], rows[SCALE * BATCH : (SCALE + 1) * BATCH]
        for k in range(width):
            square = squares[k]
            scale[k] = 1.0 / np.sqrt(square) if square > 0.0 else (0.0 if square == 0.0 else 1.0)
        for j in range(blocks):
            block = changes[(2 * count * j + c) * BATCH : 2 * count * (j + 1) * BATCH]
            for k in range(width):
                block[k] *= scale[k]
                block[count * BATCH + k] *= scale[k]


@inlined
def is_safe(square: float) -> bool:
    """Return whether a sum of squares has lost no digits by underflow or overflow."""
    safe: bool = MIN_SAFE_SQUARE < square < 1.0 / MIN_SAFE_SQUARE
    return safe


@fused_inlined
def _orthonormalise(
    columns: Columns, batch: TangentBatch, filled: int, width: int, tables: LaneTables, blocks: int
) -> None:
    """Make the changes of every lane orthonormal; SQUARE and REMAINDER become -1 where products have lost digits.

    Those lanes keep their changes as they are.
    """
    rows, count = batch.rows, len(columns)
    _products(columns, batch, width, tables, blocks)
    for k in range(width):
        square, whole = rows[SQUARE * BATCH + k], rows[SECOND_SQUARE * BATCH + k]
        if k >= filled or not is_safe(square) or (count == 2 and not is_safe(whole)):
            rows[SQUARE * BATCH + k], rows[OVERLAP * BATCH + k] = -1.0, 0.0
    if count == 2:
        _subtract_first(batch, width, tables, blocks)
        for k in range(width):
            rest, whole = rows[REMAINDER * BATCH + k], rows[SECOND_SQUARE * BATCH + k]
            left = rest if rest > RANK_ROUNDING * RANK_ROUNDING * whole else 0.0
            rows[REMAINDER * BATCH + k] = left if rows[SQUARE * BATCH + k] > 0.0 else -1.0
    _shorten(columns, batch, width, blocks)


@fused_kernel
def carry_batch(
    columns: Columns, engine: Engine, batch: TangentBatch, filled: int, changes: Floats, elapsed: Floats
) -> None:
    """Propagate changes to the last impact of the half period, or to its end without one; make them orthonormal.

    Parameters
    ----------
    columns : tuple of length 1 or 2
        Only its length matters: the number of changes of a lane.
    engine : Engine
        Events and restitutions of its lanes are read; the block_response of its models is not empty.
    batch : TangentBatch
        Input: `lanes`, `first` and `impacts` of the first `filled` lanes. On return `rows` has SQUARE and, of two
        changes, REMAINDER (-1 for a lane whose changes are not made orthonormal), STEEPEST and SHARPEST.
    changes : (LANES, 2 N, 2)
        In place. A single change is the first column.
    elapsed : (LANES,)
        Time from the moment to which the changes belong to the start of the half period; on return to its end.
    """
    rows, batched, count, most = batch.rows, batch.changes, len(columns), 0
    models = engine.models
    tables, blocks = table_of(engine.separate, OF_CHANGES, models), models.shared.forced.free.decay.shape[0]
    width = min((filled + VECTOR - 1) // VECTOR * VECTOR, BATCH)
    for k in range(width):
        rows[TARGET * BATCH + k], rows[PASSED * BATCH + k], rows[FACTOR * BATCH + k] = 0.0, 0.0, 0.0
        rows[STEEPEST * BATCH + k], rows[SHARPEST * BATCH + k] = 0.0, 0.0
        rows[VELOCITY_AT * BATCH + k], rows[ACCELERATION_AT * BATCH + k], rows[DRAG * BATCH + k] = 1.0, 0.0, 0.0
    for k in range(filled):
        most = max(most, batch.impacts[k])
        rows[PASSED * BATCH + k] = -elapsed[batch.lanes[k]]
        model = record_of(models, batch.lanes[k])
        rows[END * BATCH + k] = model.forced.free.step * (model.forced.free.cells // 2)
        put_in_changes(tables, BATCH, k, model.tables)
        lane_changes = changes[batch.lanes[k]]
        for j in range(blocks):
            for c in range(count):
                batched[(2 * count * j + c) * BATCH + k] = lane_changes[2 * j, c]
                batched[(2 * count * j + count + c) * BATCH + k] = lane_changes[2 * j + 1, c]
    for index in range(max(most, 1)):
        _set_targets(engine, batch, filled, width, tables.scalars, index)
        _flow_changes(columns, batch, width, tables, blocks)
        if index < most:
            _strike_changes(columns, batch, width, tables, blocks)
    _orthonormalise(columns, batch, filled, width, tables, blocks)
    for k in range(filled):
        elapsed[batch.lanes[k]] = rows[END * BATCH + k] - rows[PASSED * BATCH + k]
        lane_changes = changes[batch.lanes[k]]
        for j in range(blocks):
            for c in range(count):
                lane_changes[2 * j, c] = batched[(2 * count * j + c) * BATCH + k]
                lane_changes[2 * j + 1, c] = batched[(2 * count * j + count + c) * BATCH + k]
