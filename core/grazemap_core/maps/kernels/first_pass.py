"""Vector arithmetic that carries all lanes, trajectories side by side, through one cell.

Every function here is a few loops over lanes, innermost and without a branch, so that the compiler turns them into
vector instructions. Lanes that need a case distinction are left to `lockstep`. Each row of a work array holds one
quantity for all LANES.

One kernel serves any number of masses, which is the number of blocks. The three sums over all blocks that take most of
the time, of `advance`, of the series of a first pass and of that of a second one, are compiled for each small number of
blocks as well, up to five: unrolled, they stay in registers. There the number is the length of a tuple, a constant to
the compiler. The order of the operations is the same, and so are the bytes.

Loops run over whole blocks of lanes, LANE_BLOCK or VECTOR of them, so the result of a lane does not depend on the
others to the last bit.
"""

from __future__ import annotations

import numpy as np
from numba.core.registry import cpu_target

from grazemap_core.arrays import Floats, Integers, aligned
from grazemap_core.contact.kernels.first_contact import HERMITE_DIVISOR
from grazemap_core.contact.tolerances import ANCHORED_GAP, CONTACT_ROUNDING
from grazemap_core.maps import tolerances
from grazemap_core.maps.kernels import lane_tables
from grazemap_core.maps.kernels.lane_tables import LANES, TERMS, LaneTables
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel, kernel
from grazemap_core.numerics.jit.lane_values import lane_row, lane_value
from grazemap_core.records import NamedTuple

Blocks = tuple[int, ...]
"""The number of blocks as the length of a tuple, whose entries are not used."""

VECTOR = 8 if "+avx512f" in cpu_target.target_context.codegen().magic_tuple()[2].split(",") else 4
"""Numbers in the longest vector of the processor that code is generated for, which need not be this one; lanes with an
impact are solved in blocks of this size."""
LANE_BLOCK = 16
"""The number of lanes in use is a multiple of this: loops over all of them work on two vectors or more at a time."""

PITCH = LANES + 8
"""Distance of two rows of a `LaneBatch`. Rows at a distance of 1024 bytes would compete for the same lines of the
first cache."""

# A state has 2 N + 2 rows: (u, u') of every block, then q and q'. A state, and the rows of a batch, are one flat array
# each, with the distance of its rows a constant: `rows[X * PITCH + k]`. The compiler vectorises a loop that reads some
# rows and writes others only if it can show that they do not overlap. It can for places in one array at constant
# distances, but neither for several arrays nor for a distance that is a variable, as that of an array with two axes.

# rows of `LaneBatch.rows`
START_X, START_V, RIGHT, LEFT, RESTITUTION_RIGHT, RESTITUTION_LEFT, UNIT = 0, 1, 2, 3, 4, 5, 6
"""Input: q and q' at the start of the cell, and the stops as in `stops.Stops`."""
END_X, END_V, END_LOSS = 7, 8, 9
"""Output: q and q' at its end, and by how much the limits there are below the gaps, but for the distance of close
passages and the rounding of the gaps."""
REACH, FOURTH, IMPACT_Z, JUMP, SIDE, SPEED, CONTACT_ACCELERATION = 10, 11, 12, 13, 14, 15, 16
"""Bounds of |q| and of h^4/384 |q''''|; z of the impact; change of the velocity; stop (+1 right, -1 left); speed before
the impact; acceleration toward the stop after it."""
GAP, RESTITUTION = 17, 18
"""Gap and restitution of the stop that q is closer to."""
MINIMUM_BEFORE, OUTCOME, MAXIMUM_BEFORE, LEAST_GAP = 19, 20, 21, 22
"""Lower bound of the gap before the impact, with its zero divided out; the outcome; upper bound of the gap before the
impact; lower bound of the gap where q turns back in the cell and, on either side of an impact, of the gap times the
length of the cell over the time from the impact."""
BATCH_ROWS = 23

UNCERTAIN, FIRST_IMPACT, SINGLE_IMPACT, NO_IMPACT = 0.0, 1.0, 2.0, 3.0
"""Outcomes. Nothing is certified; the impact is the first in the cell; it is the only one, and needs no second pass;
there is no impact."""

FOURTH_TO_HERMITE, FOURTH_TO_QUADRATIC = 144.0, 162.0
"""Divisors of s^4 max |fourth derivative|, on an interval of the length s, in `lower_bound` and in `_find_impact`."""
QUARTIC_TO_HERMITE, QUARTIC_TO_QUADRATIC = HERMITE_DIVISOR / FOURTH_TO_HERMITE, HERMITE_DIVISOR / FOURTH_TO_QUADRATIC
"""The same as factors on the row FOURTH, which has the divisor HERMITE_DIVISOR."""


class LaneBatch(NamedTuple):
    """Lanes side by side for one cell; `pitch` is the distance of two rows of an array."""

    start: Floats
    """(2 N * pitch,) (u, u') of every block at the start of the cell."""
    end: Floats
    """(2 N * pitch,) (u, u') of every block at its end."""
    series: Floats
    """(TERMS * pitch,) Coefficients of q in z; in a second pass, of the gap in s."""
    rows: Floats
    """(number of rows * pitch,) BATCH_ROWS rows; in a second pass, those of `second_pass`."""


def lane_batch(masses: int, pitch: int = PITCH, rows: int = BATCH_ROWS) -> LaneBatch:
    """Return an empty batch for an oscillator."""
    return LaneBatch(*(aligned(np.zeros(count * pitch)) for count in (2 * masses, 2 * masses, TERMS, rows)))


@fused_inlined
def four_lane_rows(table: Floats, j: int, pitch: int) -> tuple[float, float, float, float]:
    """Return the four numbers of a block as `lane_row` does."""
    return (
        lane_row(table, 4 * j, pitch),
        lane_row(table, 4 * j + 1, pitch),
        lane_row(table, 4 * j + 2, pitch),
        lane_row(table, 4 * j + 3, pitch),
    )


@fused_inlined
def three_lane_rows(table: Floats, j: int, pitch: int) -> tuple[float, float, float]:
    """Return the three numbers of a block as `lane_row` does."""
    return lane_row(table, 3 * j, pitch), lane_row(table, 3 * j + 1, pitch), lane_row(table, 3 * j + 2, pitch)


@fused_inlined
def _advance_unrolled(
    few: Blocks,
    tables: LaneTables,
    end: int,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    flow, output_row = tables.flow, tables.output_row
    right, left = limit[:LANES], limit[LANES : 2 * LANES]
    steady_x = lane_row(tables.steady_table, 2 * end, LANES)
    steady_v = lane_row(tables.steady_table, 2 * end + 1, LANES)
    step = lane_row(tables.scalars, lane_tables.STEP, LANES)
    flagged = 0
    at_x, at_v = 2 * len(few) * LANES, (2 * len(few) + 1) * LANES
    for lane in range(min(used, LANES)):
        x, v, third = lane_value(steady_x, lane), lane_value(steady_v, lane), lane_value(step, lane) / 3.0
        for j in range(len(few)):
            first, second = here[2 * j * LANES + lane], here[(2 * j + 1) * LANES + lane]
            f0, f1 = lane_row(flow, 4 * j, LANES), lane_row(flow, 4 * j + 1, LANES)
            f2, f3 = lane_row(flow, 4 * j + 2, LANES), lane_row(flow, 4 * j + 3, LANES)
            a = lane_value(f0, lane) * first + lane_value(f1, lane) * second
            b = lane_value(f2, lane) * first + lane_value(f3, lane) * second
            there[2 * j * LANES + lane] = a
            there[(2 * j + 1) * LANES + lane] = b
            r0, r1 = lane_row(output_row, 4 * j, LANES), lane_row(output_row, 4 * j + 1, LANES)
            r2, r3 = lane_row(output_row, 4 * j + 2, LANES), lane_row(output_row, 4 * j + 3, LANES)
            x += lane_value(r0, lane) * a + lane_value(r1, lane) * b
            v += lane_value(r2, lane) * a + lane_value(r3, lane) * b
        x0, v0 = here[at_x + lane], here[at_v + lane]
        early, late = x0 + third * v0, x - third * v
        highest, lowest = max(max(x0, early), max(late, x)), min(min(x0, early), min(late, x))
        flag = 0 if (highest < right[lane]) & (-lowest < left[lane]) else 1
        flags[lane] = flag
        flagged += flag
        there[at_x + lane] = x
        there[at_v + lane] = v
    return flagged


@fused_kernel
def _advance_by_block(
    blocks: int,
    tables: LaneTables,
    end: int,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    steady_x = lane_row(tables.steady_table, 2 * end, LANES)
    steady_v = lane_row(tables.steady_table, 2 * end + 1, LANES)
    step = lane_row(tables.scalars, lane_tables.STEP, LANES)
    right, left = limit[:LANES], limit[LANES : 2 * LANES]
    used = min(used, LANES)
    start = here[2 * blocks * LANES : (2 * blocks + 2) * LANES]
    after = there[2 * blocks * LANES : (2 * blocks + 2) * LANES]
    for lane in range(used):
        after[lane] = lane_value(steady_x, lane)
        after[LANES + lane] = lane_value(steady_v, lane)
    for j in range(blocks):
        f0, f1, f2, f3 = four_lane_rows(tables.flow, j, LANES)
        r0, r1, r2, r3 = four_lane_rows(tables.output_row, j, LANES)
        block, moved = here[2 * j * LANES : (2 * j + 2) * LANES], there[2 * j * LANES : (2 * j + 2) * LANES]
        for lane in range(used):
            first, second = block[lane], block[LANES + lane]
            a = lane_value(f0, lane) * first + lane_value(f1, lane) * second
            b = lane_value(f2, lane) * first + lane_value(f3, lane) * second
            moved[lane] = a
            moved[LANES + lane] = b
            after[lane] += lane_value(r0, lane) * a + lane_value(r1, lane) * b
            after[LANES + lane] += lane_value(r2, lane) * a + lane_value(r3, lane) * b
    flagged = 0
    for lane in range(used):
        x, v = after[lane], after[LANES + lane]
        x0, v0, third = start[lane], start[LANES + lane], lane_value(step, lane) / 3.0
        early, late = x0 + third * v0, x - third * v
        highest, lowest = max(max(x0, early), max(late, x)), min(min(x0, early), min(late, x))
        flag = 0 if (highest < right[lane]) & (-lowest < left[lane]) else 1
        flags[lane] = flag
        flagged += flag
    return flagged


@fused_kernel
def advance(
    blocks: int,
    tables: LaneTables,
    end: int,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    """Carry the first `used` lanes over one cell without impacts, and flag the lanes that may have a contact in it.

    Parameters
    ----------
    end : int
        Cell boundary at which the cell ends.
    here, there : ((2 N + 2) * LANES,)
        States at the start of the cell (input) and at its end (output).
    limit : (2 * LANES,)
        There is no contact where the Bernstein coefficients of q are below the first LANES of these, and those of -q
        below the others (`cells.is_clear`).
    flags : (LANES,)
        Output: 1 where there may be a contact, else 0.
    used : int
        A multiple of LANE_BLOCK.

    Returns
    -------
    The number of lanes flagged.
    """
    if blocks == 1:
        return _advance_unrolled((0,), tables, end, here, there, limit, flags, used)
    if blocks == 2:
        return _advance_unrolled((0, 0), tables, end, here, there, limit, flags, used)
    if blocks == 3:
        return _advance_unrolled((0, 0, 0), tables, end, here, there, limit, flags, used)
    if blocks == 4:
        return _advance_unrolled((0, 0, 0, 0), tables, end, here, there, limit, flags, used)
    if blocks == 5:
        return _advance_unrolled((0, 0, 0, 0, 0), tables, end, here, there, limit, flags, used)
    return _advance_by_block(blocks, tables, end, here, there, limit, flags, used)


@fused_kernel
def update_limits(
    blocks: int,
    tables: LaneTables,
    state: Floats,
    gap: Floats,
    close: Floats,
    limit: Floats,
    reach: Floats,
    used: int,
) -> None:
    """Update limit, for passages closer than `close` (LANES,), and reach (LANES,), a bound of |q| without impacts.

    `gap` and `limit` (2 * LANES,) have the right stop of every lane, then the left one.
    """
    steady = lane_row(tables.scalars, lane_tables.STEADY, LANES)
    fourth = lane_row(tables.scalars, lane_tables.STEADY_FOURTH, LANES)
    right, left = limit[:LANES], limit[LANES : 2 * LANES]
    for lane in range(min(used, LANES)):
        reach[lane] = lane_value(steady, lane)
        right[lane] = lane_value(fourth, lane)
    for j in range(blocks):
        frequency, of_reach, of_fourth = three_lane_rows(tables.bound, j, LANES)
        block = state[2 * j * LANES : (2 * j + 2) * LANES]
        for lane in range(min(used, LANES)):
            envelope = lane_value(frequency, lane) * abs(block[lane]) + abs(block[LANES + lane])
            reach[lane] += lane_value(of_reach, lane) * envelope
            right[lane] += lane_value(of_fourth, lane) * envelope
    for lane in range(min(used, LANES)):
        loss = CONTACT_ROUNDING * reach[lane] + right[lane] + close[lane]
        right[lane] = (1.0 - CONTACT_ROUNDING) * gap[lane] - loss
        left[lane] = (1.0 - CONTACT_ROUNDING) * gap[LANES + lane] - loss


@fused_inlined
def _coefficient(few: Blocks, series: Floats, start: Floats, forcing: float, n: int, k: int) -> float:
    """Return the coefficient n of q in z for lane k of a batch."""
    total = lane_value(forcing, k)
    for c in range(2 * len(few)):
        total += lane_value(lane_row(series, 2 * len(few) * n + c, PITCH), k) * start[c * PITCH + k]
    return total


@fused_inlined
def _expand_unrolled(few: Blocks, tables: LaneTables, cell: int, start: Floats, series: Floats, count: int) -> None:
    count, table = min(count, LANES), tables.series
    for n in range(0, TERMS, 3):
        f0, f1, f2 = three_lane_rows(tables.forcing, 5 * cell + n // 3, PITCH)
        out = series[n * PITCH : (n + 3) * PITCH]
        for k in range(count):
            out[k] = _coefficient(few, table, start, f0, n, k)
            out[PITCH + k] = _coefficient(few, table, start, f1, n + 1, k)
            out[2 * PITCH + k] = _coefficient(few, table, start, f2, n + 2, k)


@fused_kernel
def _expand_by_block(blocks: int, tables: LaneTables, cell: int, start: Floats, series: Floats, count: int) -> None:
    count, table = min(count, LANES), tables.series
    for n in range(0, TERMS, 3):
        f0, f1, f2 = three_lane_rows(tables.forcing, 5 * cell + n // 3, PITCH)
        out = series[n * PITCH : (n + 3) * PITCH]
        for k in range(count):
            out[k] = lane_value(f0, k)
            out[PITCH + k] = lane_value(f1, k)
            out[2 * PITCH + k] = lane_value(f2, k)
        for j in range(blocks):
            first, second = start[2 * j * PITCH : (2 * j + 1) * PITCH], start[(2 * j + 1) * PITCH : (2 * j + 2) * PITCH]
            a0, b0 = _two_lane_rows(table, blocks * n + j)
            a1, b1 = _two_lane_rows(table, blocks * (n + 1) + j)
            a2, b2 = _two_lane_rows(table, blocks * (n + 2) + j)
            for k in range(count):
                u, v = first[k], second[k]
                out[k] = (out[k] + lane_value(a0, k) * u) + lane_value(b0, k) * v
                out[PITCH + k] = (out[PITCH + k] + lane_value(a1, k) * u) + lane_value(b1, k) * v
                out[2 * PITCH + k] = (out[2 * PITCH + k] + lane_value(a2, k) * u) + lane_value(b2, k) * v


@fused_inlined
def _two_lane_rows(table: Floats, j: int) -> tuple[float, float]:
    """Return the two numbers of a block as `lane_row` does."""
    return lane_row(table, 2 * j, PITCH), lane_row(table, 2 * j + 1, PITCH)


@fused_inlined
def _expand_positions(blocks: int, tables: LaneTables, cell: int, start: Floats, series: Floats, count: int) -> None:
    """Write the coefficients of q in z, three at a time, as three rows of the table fit in registers."""
    if blocks == 1:
        _expand_unrolled((0,), tables, cell, start, series, count)
    elif blocks == 2:
        _expand_unrolled((0, 0), tables, cell, start, series, count)
    elif blocks == 3:
        _expand_unrolled((0, 0, 0), tables, cell, start, series, count)
    elif blocks == 4:
        _expand_unrolled((0, 0, 0, 0), tables, cell, start, series, count)
    elif blocks == 5:
        _expand_unrolled((0, 0, 0, 0, 0), tables, cell, start, series, count)
    else:
        _expand_by_block(blocks, tables, cell, start, series, count)


@fused_inlined
def _end_without_impact(blocks: int, tables: LaneTables, end: int, batch: LaneBatch, count: int) -> None:
    """Write the state, q and q' at the end of the cell without the impact, and the bounds without it."""
    count = min(count, LANES)
    rows = batch.rows
    x, v = lane_row(tables.steady_table, 2 * end, PITCH), lane_row(tables.steady_table, 2 * end + 1, PITCH)
    steady = lane_row(tables.scalars, lane_tables.STEADY, PITCH)
    fourth = lane_row(tables.scalars, lane_tables.STEADY_FOURTH, PITCH)
    for k in range(count):
        rows[END_X * PITCH + k] = lane_value(x, k)
        rows[END_V * PITCH + k] = lane_value(v, k)
        rows[REACH * PITCH + k] = lane_value(steady, k)
        rows[FOURTH * PITCH + k] = lane_value(fourth, k)
    for j in range(blocks):
        f0, f1, f2, f3 = four_lane_rows(tables.flow, j, PITCH)
        r0, r1, r2, r3 = four_lane_rows(tables.output_row, j, PITCH)
        frequency, of_reach, of_fourth = three_lane_rows(tables.bound, j, PITCH)
        block = batch.start[2 * j * PITCH : (2 * j + 2) * PITCH]
        moved = batch.end[2 * j * PITCH : (2 * j + 2) * PITCH]
        for k in range(count):
            first, second = block[k], block[PITCH + k]
            a = lane_value(f0, k) * first + lane_value(f1, k) * second
            b = lane_value(f2, k) * first + lane_value(f3, k) * second
            moved[k] = a
            moved[PITCH + k] = b
            rows[END_X * PITCH + k] += lane_value(r0, k) * a + lane_value(r1, k) * b
            rows[END_V * PITCH + k] += lane_value(r2, k) * a + lane_value(r3, k) * b
            envelope = lane_value(frequency, k) * abs(first) + abs(second)
            rows[REACH * PITCH + k] += lane_value(of_reach, k) * envelope
            rows[FOURTH * PITCH + k] += lane_value(of_fourth, k) * envelope


@fused_inlined
def horner_step(f: float, d: float, e: float, z: float, coefficient: float) -> tuple[float, float, float]:
    """Return the value of a polynomial, and its derivatives ahead of it by one coefficient, from those of fewer."""
    f = f * z + coefficient
    return f, d * z + f, e * z + d


@fused_inlined
def _value_and_two_derivatives(series: Floats, k: int, z: float) -> tuple[float, float, float]:
    """Return a polynomial of degree 14, its derivative and half its second derivative (Horner, written out)."""
    e = series[14 * PITCH + k]
    f = e * z + series[13 * PITCH + k]
    d = e * z + f
    f, d, e = horner_step(f, d, e, z, series[12 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[11 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[10 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[9 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[8 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[7 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[6 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[5 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[4 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[3 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[2 * PITCH + k])
    f, d, e = horner_step(f, d, e, z, series[PITCH + k])
    return f * z + series[k], d, e


@fused_inlined
def lower_bound(g0: float, d0: float, g1: float, d1: float, quartic: float) -> float:
    """Return a lower bound of a function on [0, 1] from its values g and slopes d at the ends.

    `quartic` is a bound of |fourth derivative| / FOURTH_TO_HERMITE. The bound is the minimum of the coefficients of the
    cubic Hermite interpolant in the Bernstein basis of degree four. The error of the interpolant is at most
    quartic 6 t^2 (1 - t)^2, which changes the middle coefficient only.
    """
    c1, c2 = g0 + d0 / 3.0, g1 - d1 / 3.0
    ends = min(min(g0, g1), min(0.25 * g0 + 0.75 * c1, 0.25 * g1 + 0.75 * c2))
    return min(ends, 0.5 * (c1 + c2) - quartic)


@fused_inlined
def _approximate_impact(tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Approximate z of the contact with the stop that q is closer to, or certify that there is no contact.

    The approximation is the root, to about five digits, of the polynomial of degree five through positions and
    velocities at both ends and at the middle of the cell: two steps of Halley's method from the root of a parabola,
    with the second derivative of the cubic through both ends. The certificate is sharper than that of `advance`.
    """
    count = min(count, LANES)
    rows, series, steps = batch.rows, batch.series, lane_row(tables.scalars, lane_tables.STEP, PITCH)
    for k in range(count):
        step = lane_value(steps, k)
        x0, v0 = rows[START_X * PITCH + k], rows[START_V * PITCH + k]
        x1, v1 = rows[END_X * PITCH + k], rows[END_V * PITCH + k]
        right, left = rows[RIGHT * PITCH + k], rows[LEFT * PITCH + k]
        of_right, of_left = rows[RESTITUTION_RIGHT * PITCH + k], rows[RESTITUTION_LEFT * PITCH + k]
        # the cubic at the middle of the cell decides between the stops
        upper = 4.0 * (x0 + x1) + step * (v0 - v1) > 4.0 * (right - left)
        side = 1.0 if upper else -1.0
        gap = right if upper else left
        restitution = of_right if upper else of_left
        rows[GAP * PITCH + k] = gap
        rows[RESTITUTION * PITCH + k] = restitution
        g0, g1 = gap - side * x0, gap - side * x1
        d0, d1 = -side * v0 * step, -side * v1 * step
        discriminant = max(d0 * d0 - 4.0 * (g1 - g0 - d0) * g0, 0.0)
        t = min(max(2.0 * g0 / max(np.sqrt(discriminant) - d0, tolerances.PARABOLA_DIVISOR), 0.0), 1.0)
        rows[SIDE * PITCH + k] = side
        rows[IMPACT_Z * PITCH + k] = t
        quartic = QUARTIC_TO_HERMITE * rows[FOURTH * PITCH + k]
        both = right + left
        here, there = lower_bound(g0, d0, g1, d1, quartic), lower_bound(both - g0, -d0, both - g1, -d1, quartic)
        none = min(here, there) > CONTACT_ROUNDING * (rows[REACH * PITCH + k] + rows[UNIT * PITCH + k])
        turns, turns_there = (d0 <= 0.0) & (d1 >= 0.0), (d0 >= 0.0) & (d1 <= 0.0)
        rows[LEAST_GAP * PITCH + k] = min(here if turns else both, there if turns_there else both)
        rows[OUTCOME * PITCH + k] = NO_IMPACT if none else UNCERTAIN
    for k in range(count):
        step = lane_value(steps, k)
        x0, v0 = rows[START_X * PITCH + k], rows[START_V * PITCH + k]
        x1, v1 = rows[END_X * PITCH + k], rows[END_V * PITCH + k]
        gap, side, t = rows[GAP * PITCH + k], rows[SIDE * PITCH + k], rows[IMPACT_Z * PITCH + k]
        g0, g1 = gap - side * x0, gap - side * x1
        d0, d1 = -side * v0 * step, -side * v1 * step
        c2, c3 = 3.0 * (g1 - g0) - 2.0 * d0 - d1, 2.0 * (g0 - g1) + d0 + d1
        # residuals of value and slope at the middle of the cell
        middle = 16.0 * (gap - side * series[k] - 0.5 * (g0 + g1) - 0.125 * (d0 - d1))
        tilt = 16.0 * (-2.0 * side * series[PITCH + k] - 1.5 * (g1 - g0) + 0.25 * (d0 + d1))
        w, q = t * (1.0 - t), middle + tilt * (t - 0.5)
        f = ((c3 * t + c2) * t + d0) * t + g0 + w * w * q
        d = (3.0 * c3 * t + 2.0 * c2) * t + d0 + w * (2.0 * (1.0 - 2.0 * t) * q + w * tilt)
        e = 3.0 * c3 * t + c2
        t = t - f * d / (d * d - f * e)
        w, q = t * (1.0 - t), middle + tilt * (t - 0.5)
        f = ((c3 * t + c2) * t + d0) * t + g0 + w * w * q
        d = (3.0 * c3 * t + 2.0 * c2) * t + d0 + w * (2.0 * (1.0 - 2.0 * t) * q + w * tilt)
        e = 3.0 * c3 * t + c2
        t = t - f * d / (d * d - f * e)
        rows[CONTACT_ACCELERATION * PITCH + k] = -0.25 * side * (3.0 * c3 * t + c2)
        rows[IMPACT_Z * PITCH + k] = min(max(2.0 * t - 1.0, -1.0), 1.0)


@fused_inlined
def _find_impact(tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Find z of the first contact with the stop that q is closer to, and bound the gap before it.

    Two steps of Halley's method with the whole series, from the approximation, converge to round-off. The contact is
    the first if the gap is positive before it. The Hermite interpolant of the gap with double nodes at the start of the
    cell and at the impact has the error q''''(xi)/24 tau^2 (tau_i - tau)^2. Divided by its zero, (tau_i - tau), the
    interpolant is a quadratic; the gap is positive if its three Bernstein coefficients exceed
    max|q''''| tau_i^4 / FOURTH_TO_QUADRATIC.
    """
    count = min(count, LANES)
    _approximate_impact(tables, batch, count)
    rows, series = batch.rows, batch.series
    steps = lane_row(tables.scalars, lane_tables.STEP, PITCH)
    viscous_term = lane_row(tables.scalars, lane_tables.VISCOUS_TERM, PITCH)
    for k in range(count):
        z, e = rows[IMPACT_Z * PITCH + k], rows[CONTACT_ACCELERATION * PITCH + k]
        f, d, _ = _value_and_two_derivatives(series, k, z)
        f = rows[SIDE * PITCH + k] * rows[GAP * PITCH + k] - f
        rows[IMPACT_Z * PITCH + k] = z + f * d / (d * d + f * e)
    for k in range(count):
        z, side, gap = rows[IMPACT_Z * PITCH + k], rows[SIDE * PITCH + k], rows[GAP * PITCH + k]
        f, d, e = _value_and_two_derivatives(series, k, z)
        f = side * gap - f
        change = f * d / (d * d + f * e)
        z += change
        step = lane_value(steps, k)
        per_step = 2.0 / step
        per_square = 2.0 * per_step * per_step
        v = (d + 2.0 * e * change) * per_step
        jump = -(1.0 + rows[RESTITUTION * PITCH + k]) * v
        speed = side * v
        passed = 0.5 * (1.0 + z)
        square = passed * passed
        g0, d0 = gap - side * rows[START_X * PITCH + k], -side * rows[START_V * PITCH + k] * step
        quadratic = min(min(g0, 1.5 * g0 + 0.5 * passed * d0), passed * step * speed)
        rows[IMPACT_Z * PITCH + k] = z
        rows[JUMP * PITCH + k] = jump
        rows[SPEED * PITCH + k] = speed
        rows[CONTACT_ACCELERATION * PITCH + k] = side * (e * per_square - lane_value(viscous_term, k) * jump)
        rows[MINIMUM_BEFORE * PITCH + k] = quadratic - QUARTIC_TO_QUADRATIC * square * square * rows[FOURTH * PITCH + k]
        rows[MAXIMUM_BEFORE * PITCH + k] = max(g0, max(g0 + passed * d0 / 3.0, passed * step * speed / 3.0))
        converged = (abs(change) < tolerances.ROOT_CHANGE) & (abs(e * change) < tolerances.ROOT_SLOPE_CHANGE * abs(d))
        known = rows[OUTCOME * PITCH + k]
        outcome = FIRST_IMPACT if converged & (abs(z) < 1.0) else UNCERTAIN
        rows[OUTCOME * PITCH + k] = NO_IMPACT if known == NO_IMPACT else outcome


@fused_inlined
def horner(table: Floats, c: int, pitch: int, k: int, z: float) -> float:
    """Return the polynomial of degree 14 with the coefficients in row c of a table."""
    square, n = z * z, TERMS * c
    even, odd = lane_value(lane_row(table, n + 14, pitch), k), lane_value(lane_row(table, n + 13, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 12, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 11, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 10, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 9, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 8, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 7, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 6, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 5, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 4, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 3, pitch), k)
    even = even * square + lane_value(lane_row(table, n + 2, pitch), k)
    odd = odd * square + lane_value(lane_row(table, n + 1, pitch), k)
    value: float = odd * z + (even * square + lane_value(lane_row(table, n, pitch), k))
    return value


@fused_inlined
def _add_impulse(blocks: int, tables: LaneTables, end: int, batch: LaneBatch, count: int) -> None:
    """Add the effect of the impact to the state at the end of the cell; write q, q' and END_LOSS there."""
    count = min(count, LANES)
    rows, unit_impulse = batch.rows, tables.unit_impulse
    x, v = lane_row(tables.steady_table, 2 * end, PITCH), lane_row(tables.steady_table, 2 * end + 1, PITCH)
    steady = lane_row(tables.scalars, lane_tables.STEADY, PITCH)
    fourth = lane_row(tables.scalars, lane_tables.STEADY_FOURTH, PITCH)
    for k in range(count):
        rows[END_X * PITCH + k] = lane_value(x, k)
        rows[END_V * PITCH + k] = lane_value(v, k)
        rows[END_LOSS * PITCH + k] = CONTACT_ROUNDING * lane_value(steady, k) + lane_value(fourth, k)
    for j in range(blocks):
        r0, r1, r2, r3 = four_lane_rows(tables.output_row, j, PITCH)
        frequency, of_reach, of_fourth = three_lane_rows(tables.bound, j, PITCH)
        moved = batch.end[2 * j * PITCH : (2 * j + 2) * PITCH]
        for k in range(count):
            z, jump = rows[IMPACT_Z * PITCH + k], rows[JUMP * PITCH + k]
            a = moved[k] + jump * horner(unit_impulse, 2 * j, PITCH, k, z)
            b = moved[PITCH + k] + jump * horner(unit_impulse, 2 * j + 1, PITCH, k, z)
            moved[k] = a
            moved[PITCH + k] = b
            rows[END_X * PITCH + k] += lane_value(r0, k) * a + lane_value(r1, k) * b
            rows[END_V * PITCH + k] += lane_value(r2, k) * a + lane_value(r3, k) * b
            weight = CONTACT_ROUNDING * lane_value(of_reach, k) + lane_value(of_fourth, k)
            rows[END_LOSS * PITCH + k] += weight * (lane_value(frequency, k) * abs(a) + abs(b))


@fused_inlined
def _certify_impact(tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Certify that the impact is the first in the cell, that it is the only one, and that it needs no second pass.

    After the impact the gap is bounded as before it (`_find_impact`), with its zero at the start. There is no contact
    with the other stop if the Bernstein coefficients of both arcs are below its distance. A second pass is needed if
    the contact may come to rest. It is also needed if it returns within the next cell and ends so close to this stop
    that the gap must be a separate number (ANCHORED_GAP).
    """
    count = min(count, LANES)
    rows = batch.rows
    steps = lane_row(tables.scalars, lane_tables.STEP, PITCH)
    impulse_reach = lane_row(tables.scalars, lane_tables.IMPULSE_REACH, PITCH)
    impulse_fourth = lane_row(tables.scalars, lane_tables.IMPULSE_FOURTH, PITCH)
    for k in range(count):
        step = lane_value(steps, k)
        side, unit, restitution = rows[SIDE * PITCH + k], rows[UNIT * PITCH + k], rows[RESTITUTION * PITCH + k]
        at_rest = tolerances.LANE_REST_SHARE * (1.0 - restitution) * step
        jump = abs(rows[JUMP * PITCH + k])
        passed, left = 0.5 * (1.0 + rows[IMPACT_Z * PITCH + k]), 0.5 * (1.0 - rows[IMPACT_Z * PITCH + k])
        time = left * step
        leaving = restitution * rows[SPEED * PITCH + k]
        gap, rate = rows[GAP * PITCH + k] - side * rows[END_X * PITCH + k], -side * rows[END_V * PITCH + k]
        reach = rows[REACH * PITCH + k] + lane_value(impulse_reach, k) * jump
        fourth = rows[FOURTH * PITCH + k] + lane_value(impulse_fourth, k) * jump
        square = left * left
        quadratic = min(min(time * leaving, 1.5 * gap - 0.5 * time * rate), gap)
        margin = tolerances.LANE_SURE * (reach + unit)
        above = rows[RIGHT * PITCH + k] + rows[LEFT * PITCH + k] - fourth - margin
        before, other = rows[MINIMUM_BEFORE * PITCH + k] - margin, above - rows[MAXIMUM_BEFORE * PITCH + k]
        first, beside = min(before, other), min(before / passed, other)
        this = quadratic - QUARTIC_TO_QUADRATIC * square * square * fourth - margin
        other = above - max(time * leaving / 3.0, max(gap, gap - time * rate / 3.0))
        after = min(this, other)
        # the parabola through both rates, a cell ahead, times the time left
        ahead = time * gap + step * (time * rate + 0.5 * step * (rate - leaving))
        bouncing = 2.0 * leaving - at_rest * rows[CONTACT_ACCELERATION * PITCH + k]
        apart = max(ahead, gap - ANCHORED_GAP * unit)
        single = min(after, min(apart, bouncing)) > 0.0
        known, whole = rows[OUTCOME * PITCH + k], rows[LEAST_GAP * PITCH + k]
        beside = min(beside, min(this / left, other)) if single else beside
        rows[LEAST_GAP * PITCH + k] = whole if known == NO_IMPACT else beside
        verified = (SINGLE_IMPACT if single else FIRST_IMPACT) if (first > 0.0) & (known == FIRST_IMPACT) else UNCERTAIN
        rows[OUTCOME * PITCH + k] = NO_IMPACT if known == NO_IMPACT else verified


@kernel
def solve_impacts(blocks: int, tables: LaneTables, cell: int, batch: LaneBatch, count: int) -> None:
    """Find the impact of each lane of a batch in a cell, and carry the lane to the end of the cell.

    Parameters
    ----------
    cell : int
        Index in the forcing period, or where the tables have it.
    batch : LaneBatch
        Input: `start` and the rows START_X to UNIT; all else is output. The cell has exactly one impact where
        OUTCOME is SINGLE_IMPACT, one at IMPACT_Z and possibly others after it where it is FIRST_IMPACT, and none where
        it is NO_IMPACT.
    count : int
        Lanes in the batch, a multiple of VECTOR.
    """
    end = cell + 1
    _expand_positions(blocks, tables, cell, batch.start, batch.series, count)
    _end_without_impact(blocks, tables, end, batch, count)
    _find_impact(tables, batch, count)
    _add_impulse(blocks, tables, end, batch, count)
    _certify_impact(tables, batch, count)
