"""Second pass over a cell, for lanes with several impacts on one stop, a slow rebound or a close passage.

WIDTH lanes at a time are side by side in a `LaneBatch`. For each the gap to one stop is a series in s, in half cells,
about an expansion point in the cell: the start of the cell, or the last impact. At an impact the gap is exactly zero
and the series starts with the speed, so that arbitrarily small rebounds keep their full relative precision. One round
finds the next contact with that stop in every lane, or certifies that there is none up to the end of the cell; then the
series is shifted to the contact, and the impulse is added. The state at the end of the cell is that without impacts
plus the effect of every impulse.

Lanes for which a round certifies nothing are left to `half_period.run_cell`, from their last impact on.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.tolerances import CONTACT_ROUNDING
from grazemap_core.maps.kernels import lane_tables
from grazemap_core.maps.kernels.first_pass import (
    FOURTH_TO_HERMITE,
    FOURTH_TO_QUADRATIC,
    Blocks,
    LaneBatch,
    four_lane_rows,
    horner,
    horner_step,
    lower_bound,
    three_lane_rows,
)
from grazemap_core.maps.kernels.lane_tables import TERMS, LaneTables
from grazemap_core.maps.tolerances import (
    LANE_SPLIT,
    LANE_SURE,
    OTHER_STOP_SHARE,
    PARABOLA_DIVISOR,
    ROOT_CHANGE,
    ROOT_SLOPE_CHANGE,
)
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel, plain
from grazemap_core.numerics.jit.lane_values import lane_row, lane_value

Five = tuple[float, float, float, float, float]
Fifteen = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip

WIDTH = 16
"""Number of lanes of a second pass, of which as many VECTORs are computed as are used."""

# rows of the `LaneBatch.rows` of a second pass
UNIT, SIDE, ORIGIN, ON_STOP, GAP, RATE = 0, 1, 2, 3, 4, 5
"""The unit of `stops.Stops`; stop (+1 right, -1 left); z of the expansion point; 1 if that point is on the stop (after
an impact), else 0; the gap and its rate in s there."""
OUTCOME, CONTACT_S, SPEED, JUMP, CONTACT_ACCELERATION = 6, 7, 8, 9, 10
"""Of the last round: outcome, s of the contact, speed before it, change of the velocity, and acceleration toward the
stop after it (in velocity and time of the problem)."""
END_GAP, END_RATE, END_X, END_V, END_LOSS = 11, 12, 13, 14, 15
"""At the end of the cell: the gap and its rate, q and q', and END_LOSS of `first_pass`."""
END_VALUE, END_SLOPE, TERM_SUM, OTHER_CLEAR, LEAST_GAP = 16, 17, 18, 19, 20
"""Of the gap, its zero on the stop divided out: value and slope at the end of the cell, and the sum of the moduli of
all terms; 1 where a contact with the other stop is impossible; lower bound of the gap as `first_pass.LEAST_GAP`, up
to the next contact or the end of the cell."""
BOTH, RESTITUTION = 21, 22
"""Distance of the stops; restitution of this one."""
PASS_ROWS = 23

UNCERTAIN, CLEAR, CONTACT = 0.0, 1.0, 2.0
"""Outcomes: nothing is certified; there is no contact up to the end of the cell; the next contact was found."""


@fused_inlined
def _five(series: Floats, first: int, k: int) -> Five:
    """Return five successive coefficients of lane k."""
    return (
        series[first * WIDTH + k],
        series[(first + 1) * WIDTH + k],
        series[(first + 2) * WIDTH + k],
        series[(first + 3) * WIDTH + k],
        series[(first + 4) * WIDTH + k],
    )


@fused_inlined
def _divide_five(c: Five, above: float, z: float) -> Five:
    """Divide five coefficients by (s - z), synthetically; `above` is the coefficient of the next degree."""
    c4 = c[4] + z * above
    c3 = c[3] + z * c4
    c2 = c[2] + z * c3
    c1 = c[1] + z * c2
    return c[0] + z * c1, c1, c2, c3, c4


@fused_inlined
def _shift_series(series: Floats, rows: Floats, by: int, count: int) -> None:
    """Expand the first `count` series about another point, further on by the row `by`.

    Every division by (s - z) yields one more coefficient of the new series. Divisions also process coefficients that
    are final already, five at a time. All of them then stay in registers, which saves more than the operations cost.
    """
    for k in range(min(count, WIDTH)):
        z = rows[by * WIDTH + k]
        low, mid, high = _five(series, 0, k), _five(series, 5, k), _five(series, 10, k)
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        low = _divide_five(low, mid[0], z)
        series[k] = low[0]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        low = _divide_five(low, mid[0], z)
        series[WIDTH + k] = low[1]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        low = _divide_five(low, mid[0], z)
        series[2 * WIDTH + k] = low[2]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        low = _divide_five(low, mid[0], z)
        series[3 * WIDTH + k] = low[3]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        low = _divide_five(low, mid[0], z)
        series[4 * WIDTH + k] = low[4]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        series[5 * WIDTH + k] = mid[0]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        series[6 * WIDTH + k] = mid[1]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        series[7 * WIDTH + k] = mid[2]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        series[8 * WIDTH + k] = mid[3]
        high = _divide_five(high, 0.0, z)
        mid = _divide_five(mid, high[0], z)
        series[9 * WIDTH + k] = mid[4]
        high = _divide_five(high, 0.0, z)
        series[10 * WIDTH + k] = high[0]
        high = _divide_five(high, 0.0, z)
        series[11 * WIDTH + k] = high[1]
        high = _divide_five(high, 0.0, z)
        series[12 * WIDTH + k] = high[2]
        high = _divide_five(high, 0.0, z)
        series[13 * WIDTH + k] = high[3]


@fused_inlined
def _add_impulse(table: Floats, c: int, rows: Floats, out: Floats, count: int) -> None:
    """Add the effect of every lane's impulse at the end of the cell to `out` (WIDTH,), component c of the states."""
    for k in range(min(count, WIDTH)):
        out[k] += rows[JUMP * WIDTH + k] * horner(table, c, WIDTH, k, rows[ORIGIN * WIDTH + k])


@fused_inlined
def _expand_after_impacts(blocks: int, tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Expand the gap after an impact at the expansion point in every lane with a JUMP (0 elsewhere)."""
    rows, series, unit_impulse = batch.rows, batch.series, tables.unit_impulse
    step = lane_row(tables.scalars, lane_tables.STEP, WIDTH)
    for n in range(2, TERMS):
        response = lane_row(tables.response, n, WIDTH)
        row = series[n * WIDTH : (n + 1) * WIDTH]
        for k in range(min(count, WIDTH)):
            row[k] -= rows[SIDE * WIDTH + k] * rows[JUMP * WIDTH + k] * lane_value(response, k)
    for k in range(min(count, WIDTH)):
        half = 0.5 * lane_value(step, k)
        per_square = 2.0 / (half * half)
        struck = rows[JUMP * WIDTH + k] != 0.0
        on, gap, rate = rows[ON_STOP * WIDTH + k], rows[GAP * WIDTH + k], rows[RATE * WIDTH + k]
        leaving = rows[RESTITUTION * WIDTH + k] * rows[SPEED * WIDTH + k] * half
        gap = 0.0 if struck else gap
        rate = leaving if struck else rate
        rows[ON_STOP * WIDTH + k] = 1.0 if struck else on
        rows[GAP * WIDTH + k] = gap
        rows[RATE * WIDTH + k] = rate
        series[k] = gap
        series[WIDTH + k] = rate
        rows[CONTACT_ACCELERATION * WIDTH + k] = -per_square * series[2 * WIDTH + k]
    for c in range(2 * blocks):
        _add_impulse(unit_impulse, c, rows, batch.end[c * WIDTH : (c + 1) * WIDTH], count)


@fused_inlined
def _expand_unrolled(few: Blocks, tables: LaneTables, cell: int, batch: LaneBatch, count: int) -> None:
    """Write the coefficients of the gaps in z."""
    rows, series, start, table = batch.rows, batch.series, batch.start, tables.series
    for n in range(TERMS):
        row = series[n * WIDTH : (n + 1) * WIDTH]
        steady = lane_row(tables.forcing, TERMS * cell + n, WIDTH)
        for k in range(min(count, WIDTH)):
            total = lane_value(steady, k)
            for c in range(2 * len(few)):
                total += lane_value(lane_row(table, 2 * len(few) * n + c, WIDTH), k) * start[c * WIDTH + k]
            row[k] = -rows[SIDE * WIDTH + k] * total


@fused_kernel
def _expand_by_block(blocks: int, tables: LaneTables, cell: int, batch: LaneBatch, count: int) -> None:
    rows, series, start, table = batch.rows, batch.series, batch.start, tables.series
    for n in range(TERMS):
        row = series[n * WIDTH : (n + 1) * WIDTH]
        steady = lane_row(tables.forcing, TERMS * cell + n, WIDTH)
        for k in range(min(count, WIDTH)):
            row[k] = lane_value(steady, k)
        for c in range(2 * blocks):
            factor, part = lane_row(table, 2 * blocks * n + c, WIDTH), start[c * WIDTH : (c + 1) * WIDTH]
            for k in range(min(count, WIDTH)):
                row[k] += lane_value(factor, k) * part[k]
        for k in range(min(count, WIDTH)):
            row[k] = -rows[SIDE * WIDTH + k] * row[k]


@fused_kernel
def begin_second_pass(blocks: int, tables: LaneTables, cell: int, batch: LaneBatch, count: int) -> None:
    """Expand the gaps, given batch.start and the rows UNIT, SIDE, ORIGIN, GAP, RATE, SPEED, JUMP, BOTH and RESTITUTION.

    A lane without an impact (JUMP 0) starts at ORIGIN with the gap and the rate given.
    """
    rows, series, start = batch.rows, batch.series, batch.start
    if blocks == 1:
        _expand_unrolled((0,), tables, cell, batch, count)
    elif blocks == 2:
        _expand_unrolled((0, 0), tables, cell, batch, count)
    elif blocks == 3:
        _expand_unrolled((0, 0, 0), tables, cell, batch, count)
    elif blocks == 4:
        _expand_unrolled((0, 0, 0, 0), tables, cell, batch, count)
    elif blocks == 5:
        _expand_unrolled((0, 0, 0, 0, 0), tables, cell, batch, count)
    else:
        _expand_by_block(blocks, tables, cell, batch, count)
    _shift_series(series, rows, plain(ORIGIN), count)
    for j in range(blocks):
        f0, f1, f2, f3 = four_lane_rows(tables.flow, j, WIDTH)
        block, moved = start[2 * j * WIDTH : (2 * j + 2) * WIDTH], batch.end[2 * j * WIDTH : (2 * j + 2) * WIDTH]
        for k in range(min(count, WIDTH)):
            moved[k] = lane_value(f0, k) * block[k] + lane_value(f1, k) * block[WIDTH + k]
            moved[WIDTH + k] = lane_value(f2, k) * block[k] + lane_value(f3, k) * block[WIDTH + k]
    for k in range(min(count, WIDTH)):
        rows[ON_STOP * WIDTH + k] = 0.0
    _expand_after_impacts(blocks, tables, batch, count)


@fused_inlined
def _value_and_two_derivatives(a: Fifteen, s: float) -> tuple[float, float, float]:
    """Return a polynomial of degree 14, its derivative and half its second derivative (Horner, written out)."""
    e = a[14]
    f = e * s + a[13]
    d = e * s + f
    f, d, e = horner_step(f, d, e, s, a[12])
    f, d, e = horner_step(f, d, e, s, a[11])
    f, d, e = horner_step(f, d, e, s, a[10])
    f, d, e = horner_step(f, d, e, s, a[9])
    f, d, e = horner_step(f, d, e, s, a[8])
    f, d, e = horner_step(f, d, e, s, a[7])
    f, d, e = horner_step(f, d, e, s, a[6])
    f, d, e = horner_step(f, d, e, s, a[5])
    f, d, e = horner_step(f, d, e, s, a[4])
    f, d, e = horner_step(f, d, e, s, a[3])
    f, d, e = horner_step(f, d, e, s, a[2])
    f, d, e = horner_step(f, d, e, s, a[1])
    return f * s + a[0], d, e


@fused_inlined
def _bound_step(size: float, fourth: float, s: float, coefficient: float, factor: float) -> tuple[float, float]:
    """Return the sum of the moduli of the terms, and of those of the fourth derivative over s^4, with one more."""
    return size * s + abs(coefficient), fourth * s + factor * abs(coefficient)


@fused_inlined
def _term_bounds(a: Fifteen, s: float) -> tuple[float, float]:
    """Return bounds on [0, s]: the sum of the moduli of all terms, and s^4 times that of the fourth derivative."""
    size, fourth = abs(a[14]), 24024.0 * abs(a[14])
    size, fourth = _bound_step(size, fourth, s, a[13], 17160.0)
    size, fourth = _bound_step(size, fourth, s, a[12], 11880.0)
    size, fourth = _bound_step(size, fourth, s, a[11], 7920.0)
    size, fourth = _bound_step(size, fourth, s, a[10], 5040.0)
    size, fourth = _bound_step(size, fourth, s, a[9], 3024.0)
    size, fourth = _bound_step(size, fourth, s, a[8], 1680.0)
    size, fourth = _bound_step(size, fourth, s, a[7], 840.0)
    size, fourth = _bound_step(size, fourth, s, a[6], 360.0)
    size, fourth = _bound_step(size, fourth, s, a[5], 120.0)
    size, fourth = _bound_step(size, fourth, s, a[4], 24.0)
    size = size * s + abs(a[3])
    size = size * s + abs(a[2])
    size = size * s + abs(a[1])
    size = size * s + abs(a[0])
    return size, fourth * ((s * s) * (s * s))


@fused_inlined
def _gap_series(series: Floats, k: int, on: bool) -> Fifteen:
    """Return the coefficients of a lane's gap; on the stop (`on`) with the zero at the expansion point divided out."""
    c0, c1, c2, c3, c4 = _five(series, 0, k)
    c5, c6, c7, c8, c9 = _five(series, 5, k)
    c10, c11, c12, c13, c14 = _five(series, 10, k)
    a0 = c1 if on else c0
    a1 = c2 if on else c1
    a2 = c3 if on else c2
    a3 = c4 if on else c3
    a4 = c5 if on else c4
    a5 = c6 if on else c5
    a6 = c7 if on else c6
    a7 = c8 if on else c7
    a8 = c9 if on else c8
    a9 = c10 if on else c9
    a10 = c11 if on else c10
    a11 = c12 if on else c11
    a12 = c13 if on else c12
    a13 = c14 if on else c13
    a14 = 0.0 if on else c14
    return a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14


@fused_kernel
def certify_clear(tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Certify that there is no contact with the stop up to the end of the cell, in each of the first `count` lanes.

    Output: OUTCOME, CLEAR or UNCERTAIN, and LEAST_GAP, END_GAP and END_RATE without a contact.

    A zero of the gap at the expansion point is divided out first. The certificate is that of `first_pass.lower_bound`,
    on both sides of the minimum of the cubic through values and slopes at both ends, with the fourth derivative bounded
    by the series itself.
    """
    rows, series = batch.rows, batch.series
    step = lane_row(tables.scalars, lane_tables.STEP, WIDTH)
    for k in range(min(count, WIDTH)):
        half = 0.5 * lane_value(step, k)
        on = rows[ON_STOP * WIDTH + k] > 0.0
        a = _gap_series(series, k, on)
        left = 1.0 - rows[ORIGIN * WIDTH + k]
        # value, slope and bounds at the end of the cell
        g, d, _ = _value_and_two_derivatives(a, left)
        size, fourth = _term_bounds(a, left)
        g1, d1 = g, d * left
        d0 = a[1] * left
        h2, h3 = 3.0 * (g1 - a[0]) - 2.0 * d0 - d1, 2.0 * (a[0] - g1) + d0 + d1
        # the minimum of the cubic, kept away from the ends
        second_derivative = h2 * h2 - 3.0 * h3 * d0
        low = np.sqrt(max(second_derivative, 0.0)) + h2
        t = -d0 / (low if low > 0.0 else 1.0)
        t = min(max(t if (low > 0.0) & (second_derivative > 0.0) else 0.5, LANE_SPLIT), 1.0 - LANE_SPLIT)
        gm, dm, _ = _value_and_two_derivatives(a, t * left)
        dm *= left
        quartic = fourth / FOURTH_TO_HERMITE
        u = 1.0 - t
        first = lower_bound(a[0], d0 * t, gm, dm * t, quartic * ((t * t) * (t * t)))
        second = lower_bound(gm, dm * u, g1, d1 * u, quartic * ((u * u) * (u * u)))
        rounding = CONTACT_ROUNDING * size
        travel = size * (left if on else 1.0)
        other_clear = travel + rounding < OTHER_STOP_SHARE * rows[BOTH * WIDTH + k]
        least = min(first, second)
        clear = (least > rounding) & other_clear
        turns = (d0 <= 0.0) & (d1 >= 0.0)
        rows[LEAST_GAP * WIDTH + k] = 2.0 * least if on else (least if turns else rows[UNIT * WIDTH + k])
        rows[OUTCOME * WIDTH + k] = CLEAR if clear else UNCERTAIN
        rows[END_VALUE * WIDTH + k] = g1
        rows[END_SLOPE * WIDTH + k] = d1
        rows[TERM_SUM * WIDTH + k] = size
        rows[OTHER_CLEAR * WIDTH + k] = 1.0 if other_clear else 0.0
        rows[END_GAP * WIDTH + k] = g1 * (left if on else 1.0)
        rows[END_RATE * WIDTH + k] = (g1 + d1 if on else d1 / left) / half


@fused_kernel
def find_contacts(tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Find the next contact with the stop in each of the first `count` lanes, after `certify_clear`.

    Output: OUTCOME; where it is CONTACT, LEAST_GAP; and CONTACT_S, SPEED and JUMP, which are 0 elsewhere.

    Halley's method starts at the root of the cubic of `certify_clear`; the certificate is that of
    `first_pass._find_impact`, with the fourth derivative bounded by the series itself.
    """
    rows, series = batch.rows, batch.series
    step = lane_row(tables.scalars, lane_tables.STEP, WIDTH)
    for k in range(min(count, WIDTH)):
        half = 0.5 * lane_value(step, k)
        on = rows[ON_STOP * WIDTH + k] > 0.0
        a = _gap_series(series, k, on)
        left = 1.0 - rows[ORIGIN * WIDTH + k]
        g1, d1, size = rows[END_VALUE * WIDTH + k], rows[END_SLOPE * WIDTH + k], rows[TERM_SUM * WIDTH + k]
        d0 = a[1] * left
        h2, h3 = 3.0 * (g1 - a[0]) - 2.0 * d0 - d1, 2.0 * (a[0] - g1) + d0 + d1
        discriminant = max(d0 * d0 - 4.0 * (g1 - a[0] - d0) * a[0], 0.0)
        t = min(max(2.0 * a[0] / max(np.sqrt(discriminant) - d0, PARABOLA_DIVISOR), 0.0), 1.0)
        f = ((h3 * t + h2) * t + d0) * t + a[0]
        d = (3.0 * h3 * t + 2.0 * h2) * t + d0
        e = 3.0 * h3 * t + h2
        t = t - f * d / (d * d - f * e)
        f = ((h3 * t + h2) * t + d0) * t + a[0]
        d = (3.0 * h3 * t + 2.0 * h2) * t + d0
        e = 3.0 * h3 * t + h2
        t = t - f * d / (d * d - f * e)
        s = min(max(t, 0.0), 1.0) * left
        f, d, e = _value_and_two_derivatives(a, s)
        s -= f * d / (d * d - f * e)
        f, d, e = _value_and_two_derivatives(a, s)
        s -= f * d / (d * d - f * e)
        f, d, e = _value_and_two_derivatives(a, s)
        change = -f * d / (d * d - f * e)
        s += change
        slope = d + 2.0 * e * change
        part, fourth_there = _term_bounds(a, s)
        quadratic = min(min(a[0], 1.5 * a[0] + 0.5 * s * a[1]), -s * slope) - fourth_there / FOURTH_TO_QUADRATIC
        sure = quadratic - LANE_SURE * part
        converged = (abs(change) < ROOT_CHANGE * s) & (abs(e * change) < ROOT_SLOPE_CHANGE * abs(d))
        converged &= (s > 0.0) & (s < left)
        # the first term is exact to its own precision; the others have the round-off of the whole cell
        within = LANE_SURE * part * left > CONTACT_ROUNDING * size * s
        contact = (sure > 0.0) & converged & within & (rows[OTHER_CLEAR * WIDTH + k] > 0.0)
        clear = (rows[OUTCOME * WIDTH + k] == CLEAR) & (not contact)
        speed = -slope * (s if on else 1.0) / half
        rows[OUTCOME * WIDTH + k] = CONTACT if contact else (CLEAR if clear else UNCERTAIN)
        before = rows[LEAST_GAP * WIDTH + k]
        rows[LEAST_GAP * WIDTH + k] = quadratic * (2.0 if on else 2.0 / s) if contact else before
        rows[CONTACT_S * WIDTH + k] = s if contact else 0.0
        rows[SPEED * WIDTH + k] = speed if contact else 0.0
        rows[JUMP * WIDTH + k] = (
            -rows[SIDE * WIDTH + k] * (1.0 + rows[RESTITUTION * WIDTH + k]) * speed if contact else 0.0
        )


@fused_kernel
def apply_impacts(blocks: int, tables: LaneTables, batch: LaneBatch, count: int) -> None:
    """Move the expansion point to the contact, after the impact, in every lane with a contact."""
    rows = batch.rows
    _shift_series(batch.series, rows, plain(CONTACT_S), count)
    for k in range(min(count, WIDTH)):
        rows[ORIGIN * WIDTH + k] += rows[CONTACT_S * WIDTH + k]
    _expand_after_impacts(blocks, tables, batch, count)


@fused_kernel
def end_second_pass(blocks: int, tables: LaneTables, cell: int, batch: LaneBatch, count: int) -> None:
    """Write q, q' and END_LOSS at the end of the cell."""
    rows, place = batch.rows, 2 * (cell + 1)
    x, v = lane_row(tables.steady_table, place, WIDTH), lane_row(tables.steady_table, place + 1, WIDTH)
    steady = lane_row(tables.scalars, lane_tables.STEADY, WIDTH)
    fourth = lane_row(tables.scalars, lane_tables.STEADY_FOURTH, WIDTH)
    for k in range(min(count, WIDTH)):
        rows[END_X * WIDTH + k] = lane_value(x, k)
        rows[END_V * WIDTH + k] = lane_value(v, k)
        rows[END_LOSS * WIDTH + k] = CONTACT_ROUNDING * lane_value(steady, k) + lane_value(fourth, k)
    for j in range(blocks):
        r0, r1, r2, r3 = four_lane_rows(tables.output_row, j, WIDTH)
        frequency, of_reach, of_fourth = three_lane_rows(tables.bound, j, WIDTH)
        end = batch.end[2 * j * WIDTH : (2 * j + 2) * WIDTH]
        for k in range(min(count, WIDTH)):
            a, b = end[k], end[WIDTH + k]
            rows[END_X * WIDTH + k] += lane_value(r0, k) * a + lane_value(r1, k) * b
            rows[END_V * WIDTH + k] += lane_value(r2, k) * a + lane_value(r3, k) * b
            weight = CONTACT_ROUNDING * lane_value(of_reach, k) + lane_value(of_fourth, k)
            rows[END_LOSS * WIDTH + k] += weight * (lane_value(frequency, k) * abs(a) + abs(b))
