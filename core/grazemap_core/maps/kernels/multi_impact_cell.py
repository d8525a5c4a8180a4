"""The second pass over a cell: lanes that bounce on one stop, leave it slowly, or pass it closely.

WIDTH lanes at a time stand side by side in a `Tile`. Each has the gap to one stop as a series in s from a point of its
own in the cell, in units of half a cell: the cell's start, or the impact it stands behind. There the gap is zero by
definition and the series begins with the speed, so a bounce of any smallness keeps its full relative precision. A round
finds in every column the next contact with that stop, or that there is none up to the end of the cell; the series is
shifted to the contact and the kick added to it. Nothing is flown: the state at the end of the cell is that without
impacts plus what every kick amounts to there.

What a round cannot certify it leaves to `walk`, from the last impact on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.maps.kernels import lane_tables
from grazemap_core.maps.kernels.lane_tables import TERMS, LaneTables
from grazemap_core.maps.kernels.lanes import Masses, horner, least_on
from grazemap_core.maps.tolerances import LANE_SURE
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel

Five = tuple[float, float, float, float, float]
Fifteen = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip

WIDTH = 16
"""Columns of a tile; of one that is half empty only half are worked on."""

# rows of `Tile.rows`
CLEARANCE, SIDE, PLACE, ON_STOP, GAP, RATE = 0, 1, 2, 3, 4, 5
"""The stop, z where the series begins, 1 on the stop (behind an impact) or 0, and the gap and its rate in s there."""
OUTCOME, LENGTH, SPEED, JUMP, CONTACT_ACCELERATION = 6, 7, 8, 9, 10
"""Of the last round: what it found, s of the contact, speed before it, kick, and pressing behind it (in velocity and
time of the problem)."""
END_GAP, END_RATE, END_X, END_V, END_LIMIT = 11, 12, 13, 14, 15
LEVEL, SLOPE, SIZE, INSIDE = 16, 17, 18, 19
"""Of the gap, a zero on the stop divided out: at the end of the cell, its slope there, a bound of all its terms; 1
where the other stop is out of reach."""
ROWS = 20

UNSURE, CLEAR, CONTACT = 0.0, 1.0, 2.0
"""Outcomes: nothing is claimed; no contact up to the end of the cell; the next contact."""


class Tile(NamedTuple):
    """WIDTH columns.

    Attributes
    ----------
    start, end : (2 N * WIDTH,)
        (u, u') of every block at the start of the cell, and at its end.
    series : (TERMS * WIDTH,)
        Coefficients of the gap in s.
    rows : (ROWS * WIDTH,)
    """

    start: Floats
    end: Floats
    series: Floats
    rows: Floats


def tile(masses: int) -> Tile:
    """Return an empty tile for an oscillator."""
    return Tile(
        start=np.zeros(2 * masses * WIDTH),
        end=np.zeros(2 * masses * WIDTH),
        series=np.zeros(TERMS * WIDTH),
        rows=np.zeros(ROWS * WIDTH),
    )


@fused_inlined
def _sweep(c: Five, above: float, z: float) -> Five:
    """One step of synthetic division by (s - z) through five coefficients, `above` being that of the next degree."""
    c4 = c[4] + z * above
    c3 = c[3] + z * c4
    c2 = c[2] + z * c3
    c1 = c[1] + z * c2
    return c[0] + z * c1, c1, c2, c3, c4


@fused_inlined
def _shift(series: Floats, rows: Floats, by: int, count: int) -> None:
    """Expand the first `count` columns about a point that lies by as much as row `by` says further on.

    Every sweep divides by (s - z) once more and leaves one coefficient of the new series behind. It goes on over those
    below, which are done with: five at a time they stay in registers, which is worth more than the operations.
    """
    for k in range(min(count, WIDTH)):
        z = rows[by * WIDTH + k]
        low = (series[k], series[WIDTH + k], series[2 * WIDTH + k], series[3 * WIDTH + k], series[4 * WIDTH + k])
        mid = (
            series[5 * WIDTH + k],
            series[6 * WIDTH + k],
            series[7 * WIDTH + k],
            series[8 * WIDTH + k],
            series[9 * WIDTH + k],
        )
        high = (
            series[10 * WIDTH + k],
            series[11 * WIDTH + k],
            series[12 * WIDTH + k],
            series[13 * WIDTH + k],
            series[14 * WIDTH + k],
        )
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        low = _sweep(low, mid[0], z)
        series[k] = low[0]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        low = _sweep(low, mid[0], z)
        series[WIDTH + k] = low[1]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        low = _sweep(low, mid[0], z)
        series[2 * WIDTH + k] = low[2]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        low = _sweep(low, mid[0], z)
        series[3 * WIDTH + k] = low[3]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        low = _sweep(low, mid[0], z)
        series[4 * WIDTH + k] = low[4]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        series[5 * WIDTH + k] = mid[0]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        series[6 * WIDTH + k] = mid[1]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        series[7 * WIDTH + k] = mid[2]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        series[8 * WIDTH + k] = mid[3]
        high = _sweep(high, 0.0, z)
        mid = _sweep(mid, high[0], z)
        series[9 * WIDTH + k] = mid[4]
        high = _sweep(high, 0.0, z)
        series[10 * WIDTH + k] = high[0]
        high = _sweep(high, 0.0, z)
        series[11 * WIDTH + k] = high[1]
        high = _sweep(high, 0.0, z)
        series[12 * WIDTH + k] = high[2]
        high = _sweep(high, 0.0, z)
        series[13 * WIDTH + k] = high[3]


@fused_inlined
def _add_kick(table: Floats, rows: Floats, out: Floats, count: int) -> None:
    """Add to `out` (WIDTH,) what every column's kick amounts to at the end of the cell, in one component of a state."""
    for k in range(min(count, WIDTH)):
        out[k] += rows[JUMP * WIDTH + k] * horner(table, rows[PLACE * WIDTH + k])


@fused_inlined
def _kick(tables: LaneTables, tile: Tile, count: int) -> None:
    """Let every column with a JUMP (0 elsewhere) begin behind an impact where it stands."""
    rows, series = tile.rows, tile.series
    half = 0.5 * tables.scalars[lane_tables.STEP]
    restitution = tables.scalars[lane_tables.RESTITUTION]
    per_square = 2.0 / (half * half)
    for n in range(2, TERMS):
        response = tables.response[n]
        row = series[n * WIDTH : (n + 1) * WIDTH]
        for k in range(min(count, WIDTH)):
            row[k] -= rows[SIDE * WIDTH + k] * rows[JUMP * WIDTH + k] * response
    for k in range(min(count, WIDTH)):
        struck = rows[JUMP * WIDTH + k] != 0.0
        on, gap, rate = rows[ON_STOP * WIDTH + k], rows[GAP * WIDTH + k], rows[RATE * WIDTH + k]
        leaving = restitution * rows[SPEED * WIDTH + k] * half
        gap = 0.0 if struck else gap
        rate = leaving if struck else rate
        rows[ON_STOP * WIDTH + k] = 1.0 if struck else on
        rows[GAP * WIDTH + k] = gap
        rows[RATE * WIDTH + k] = rate
        series[k] = gap
        series[WIDTH + k] = rate
        rows[CONTACT_ACCELERATION * WIDTH + k] = -per_square * series[2 * WIDTH + k]
    for c in range(2 * tables.flow.shape[0]):
        _add_kick(tables.unit_impulse[c], rows, tile.end[c * WIDTH : (c + 1) * WIDTH], count)


@fused_kernel
def enter_tile(masses: Masses, tables: LaneTables, cell: int, tile: Tile, count: int) -> None:
    """Set up a tile from tile.start and the rows CLEARANCE, SIDE, PLACE, GAP, RATE, and an impact's SPEED and JUMP.

    A column without an impact (JUMP 0) begins at PLACE with the gap and the rate given.
    """
    rows, series, start = tile.rows, tile.series, tile.start
    forcing = tables.forcing[cell]
    for n in range(TERMS):
        row = series[n * WIDTH : (n + 1) * WIDTH]
        table = tables.series[n]
        steady = forcing[n]
        for k in range(min(count, WIDTH)):
            total = steady
            for c in range(2 * len(masses)):
                total += table[c] * start[c * WIDTH + k]
            row[k] = -rows[SIDE * WIDTH + k] * total
    _shift(series, rows, PLACE, count)
    for j in range(tables.flow.shape[0]):
        f0, f1, f2, f3 = tables.flow[j, 0], tables.flow[j, 1], tables.flow[j, 2], tables.flow[j, 3]
        before, behind = start[2 * j * WIDTH : (2 * j + 2) * WIDTH], tile.end[2 * j * WIDTH : (2 * j + 2) * WIDTH]
        for k in range(min(count, WIDTH)):
            behind[k] = f0 * before[k] + f1 * before[WIDTH + k]
            behind[WIDTH + k] = f2 * before[k] + f3 * before[WIDTH + k]
    for k in range(min(count, WIDTH)):
        rows[ON_STOP * WIDTH + k] = 0.0
    _kick(tables, tile, count)


@fused_inlined
def _polynomial(
    a0: float,
    a1: float,
    a2: float,
    a3: float,
    a4: float,
    a5: float,
    a6: float,
    a7: float,
    a8: float,
    a9: float,
    a10: float,
    a11: float,
    a12: float,
    a13: float,
    a14: float,
    s: float,
) -> tuple[float, float, float]:
    """Return a polynomial of degree 14, its derivative and half its second derivative (Horner, written out)."""
    f = a14
    d = f
    f = f * s + a13
    e = d
    d = d * s + f
    f = f * s + a12
    e = e * s + d
    d = d * s + f
    f = f * s + a11
    e = e * s + d
    d = d * s + f
    f = f * s + a10
    e = e * s + d
    d = d * s + f
    f = f * s + a9
    e = e * s + d
    d = d * s + f
    f = f * s + a8
    e = e * s + d
    d = d * s + f
    f = f * s + a7
    e = e * s + d
    d = d * s + f
    f = f * s + a6
    e = e * s + d
    d = d * s + f
    f = f * s + a5
    e = e * s + d
    d = d * s + f
    f = f * s + a4
    e = e * s + d
    d = d * s + f
    f = f * s + a3
    e = e * s + d
    d = d * s + f
    f = f * s + a2
    e = e * s + d
    d = d * s + f
    f = f * s + a1
    e = e * s + d
    d = d * s + f
    f = f * s + a0
    return f, d, e


@fused_inlined
def _moduli(
    a0: float,
    a1: float,
    a2: float,
    a3: float,
    a4: float,
    a5: float,
    a6: float,
    a7: float,
    a8: float,
    a9: float,
    a10: float,
    a11: float,
    a12: float,
    a13: float,
    a14: float,
    s: float,
) -> tuple[float, float]:
    """Return bounds on [0, s]: the sum of the moduli of all terms, and s^4 times that of the fourth derivative's."""
    size = abs(a14)
    fourth = 24024.0 * abs(a14)
    size = size * s + abs(a13)
    fourth = fourth * s + 17160.0 * abs(a13)
    size = size * s + abs(a12)
    fourth = fourth * s + 11880.0 * abs(a12)
    size = size * s + abs(a11)
    fourth = fourth * s + 7920.0 * abs(a11)
    size = size * s + abs(a10)
    fourth = fourth * s + 5040.0 * abs(a10)
    size = size * s + abs(a9)
    fourth = fourth * s + 3024.0 * abs(a9)
    size = size * s + abs(a8)
    fourth = fourth * s + 1680.0 * abs(a8)
    size = size * s + abs(a7)
    fourth = fourth * s + 840.0 * abs(a7)
    size = size * s + abs(a6)
    fourth = fourth * s + 360.0 * abs(a6)
    size = size * s + abs(a5)
    fourth = fourth * s + 120.0 * abs(a5)
    size = size * s + abs(a4)
    fourth = fourth * s + 24.0 * abs(a4)
    size = size * s + abs(a3)
    size = size * s + abs(a2)
    size = size * s + abs(a1)
    size = size * s + abs(a0)
    return size, fourth * ((s * s) * (s * s))


@fused_inlined
def _off_the_stop(series: Floats, k: int, on: bool) -> Fifteen:
    """Return the coefficients of a column's gap; on the stop the zero there is divided out."""
    c0, c1, c2, c3, c4 = (
        series[k],
        series[WIDTH + k],
        series[2 * WIDTH + k],
        series[3 * WIDTH + k],
        series[4 * WIDTH + k],
    )
    c5, c6, c7, c8, c9 = (
        series[5 * WIDTH + k],
        series[6 * WIDTH + k],
        series[7 * WIDTH + k],
        series[8 * WIDTH + k],
        series[9 * WIDTH + k],
    )
    c10, c11, c12, c13, c14 = (
        series[10 * WIDTH + k],
        series[11 * WIDTH + k],
        series[12 * WIDTH + k],
        series[13 * WIDTH + k],
        series[14 * WIDTH + k],
    )
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
def clear_columns(tables: LaneTables, tile: Tile, count: int) -> None:
    """Certify in which of the first `count` columns there is no contact with its stop up to the end of the cell.

    On return OUTCOME is CLEAR or UNSURE, and END_GAP and END_RATE are those without a contact.

    On the stop the zero there is divided out of the gap first. The certificates are those of `lanes`, with the fourth
    derivative bounded by the series itself, on both sides of the lowest point of the cubic through values and slopes at
    both ends.
    """
    rows, series = tile.rows, tile.series
    half = 0.5 * tables.scalars[lane_tables.STEP]
    margin = tables.scalars[lane_tables.MARGIN]
    for k in range(min(count, WIDTH)):
        on = rows[ON_STOP * WIDTH + k] > 0.0
        a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14 = _off_the_stop(series, k, on)
        left = 1.0 - rows[PLACE * WIDTH + k]
        # value, slope and bounds at the end of the cell
        g, d, _ = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, left)
        size, fourth = _moduli(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, left)
        g1, d1 = g, d * left
        d0 = a1 * left
        h2, h3 = 3.0 * (g1 - a0) - 2.0 * d0 - d1, 2.0 * (a0 - g1) + d0 + d1
        # the lowest point of the cubic, kept off the ends
        second_derivative = h2 * h2 - 3.0 * h3 * d0
        low = np.sqrt(max(second_derivative, 0.0)) + h2
        t = -d0 / (low if low > 0.0 else 1.0)
        t = min(max(t if (low > 0.0) & (second_derivative > 0.0) else 0.5, 0.125), 0.875)
        gm, dm, _ = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, t * left)
        dm *= left
        quartic = fourth / 144.0
        u = 1.0 - t
        before = least_on(a0, d0 * t, gm, dm * t, quartic * ((t * t) * (t * t)))
        behind = least_on(gm, dm * u, g1, d1 * u, quartic * ((u * u) * (u * u)))
        rounding = margin * size
        # the other stop is out of reach
        travel = size * (left if on else 1.0)
        inside = travel + rounding < 1.9 * rows[CLEARANCE * WIDTH + k]
        clear = (min(before, behind) > rounding) & inside
        rows[OUTCOME * WIDTH + k] = CLEAR if clear else UNSURE
        rows[LEVEL * WIDTH + k] = g1
        rows[SLOPE * WIDTH + k] = d1
        rows[SIZE * WIDTH + k] = size
        rows[INSIDE * WIDTH + k] = 1.0 if inside else 0.0
        rows[END_GAP * WIDTH + k] = g1 * (left if on else 1.0)
        rows[END_RATE * WIDTH + k] = (g1 + d1 if on else d1 / left) / half


@fused_kernel
def next_contacts(tables: LaneTables, tile: Tile, count: int) -> None:
    """Find the next contact with its stop in each of the first `count` columns, behind `clear_columns`.

    On return OUTCOME, and LENGTH, SPEED, JUMP with CONTACT (0 elsewhere).

    The guess is the root of the cubic of `clear_columns`; certificates as in `lanes`.
    """
    rows, series = tile.rows, tile.series
    half = 0.5 * tables.scalars[lane_tables.STEP]
    bounce = 1.0 + tables.scalars[lane_tables.RESTITUTION]
    margin = tables.scalars[lane_tables.MARGIN]
    for k in range(min(count, WIDTH)):
        on = rows[ON_STOP * WIDTH + k] > 0.0
        a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14 = _off_the_stop(series, k, on)
        left = 1.0 - rows[PLACE * WIDTH + k]
        g1, d1, size = rows[LEVEL * WIDTH + k], rows[SLOPE * WIDTH + k], rows[SIZE * WIDTH + k]
        d0 = a1 * left
        h2, h3 = 3.0 * (g1 - a0) - 2.0 * d0 - d1, 2.0 * (a0 - g1) + d0 + d1
        falling = max(d0 * d0 - 4.0 * (g1 - a0 - d0) * a0, 0.0)
        t = min(max(2.0 * a0 / max(np.sqrt(falling) - d0, 1e-300), 0.0), 1.0)
        f = ((h3 * t + h2) * t + d0) * t + a0
        d = (3.0 * h3 * t + 2.0 * h2) * t + d0
        e = 3.0 * h3 * t + h2
        t = t - f * d / (d * d - f * e)
        f = ((h3 * t + h2) * t + d0) * t + a0
        d = (3.0 * h3 * t + 2.0 * h2) * t + d0
        e = 3.0 * h3 * t + h2
        t = t - f * d / (d * d - f * e)
        s = min(max(t, 0.0), 1.0) * left
        f, d, e = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, s)
        s -= f * d / (d * d - f * e)
        f, d, e = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, s)
        s -= f * d / (d * d - f * e)
        f, d, e = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, s)
        change = -f * d / (d * d - f * e)
        s += change
        slope = d + 2.0 * e * change
        part, fourth_there = _moduli(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, s)
        quadratic = min(min(a0, 1.5 * a0 + 0.5 * s * a1), -s * slope) - fourth_there / 162.0
        sure = quadratic - LANE_SURE * part
        # round-off of the terms behind the first, which is known to its own precision
        settled = (abs(change) < 1e-8 * s) & (abs(e * change) < 1e-6 * abs(d)) & (s > 0.0) & (s < left)
        within = LANE_SURE * part * left > margin * size * s
        contact = (sure > 0.0) & settled & within & (rows[INSIDE * WIDTH + k] > 0.0)
        clear = (rows[OUTCOME * WIDTH + k] == CLEAR) & (not contact)
        speed = -slope * (s if on else 1.0) / half
        rows[OUTCOME * WIDTH + k] = CONTACT if contact else (CLEAR if clear else UNSURE)
        rows[LENGTH * WIDTH + k] = s if contact else 0.0
        rows[SPEED * WIDTH + k] = speed if contact else 0.0
        rows[JUMP * WIDTH + k] = -rows[SIDE * WIDTH + k] * bounce * speed if contact else 0.0


@fused_kernel
def strike_tile(tables: LaneTables, tile: Tile, count: int) -> None:
    """Carry every column with a contact on to it, and let it begin anew behind the impact; the others stay."""
    rows = tile.rows
    _shift(tile.series, rows, LENGTH, count)
    for k in range(min(count, WIDTH)):
        rows[PLACE * WIDTH + k] += rows[LENGTH * WIDTH + k]
    _kick(tables, tile, count)


@fused_kernel
def leave_tile(tables: LaneTables, cell: int, tile: Tile, count: int) -> None:
    """Write x1, v1 and the limit (`lanes.refresh_limits`) at the end of the cell."""
    rows = tile.rows
    x, v = tables.steady_table[cell + 1, 0], tables.steady_table[cell + 1, 1]
    steady, fourth = tables.scalars[lane_tables.STEADY], tables.scalars[lane_tables.STEADY_FOURTH]
    margin = tables.scalars[lane_tables.MARGIN]
    for k in range(min(count, WIDTH)):
        clearance = rows[CLEARANCE * WIDTH + k]
        rows[END_X * WIDTH + k] = x
        rows[END_V * WIDTH + k] = v
        rows[END_LIMIT * WIDTH + k] = (1.0 - margin) * clearance - margin * steady - fourth
    for j in range(tables.flow.shape[0]):
        r0, r1, r2, r3 = (
            tables.output_row[j, 0],
            tables.output_row[j, 1],
            tables.output_row[j, 2],
            tables.output_row[j, 3],
        )
        frequency, weight = tables.bound[j, 0], margin * tables.bound[j, 1] + tables.bound[j, 2]
        end = tile.end[2 * j * WIDTH : (2 * j + 2) * WIDTH]
        for k in range(min(count, WIDTH)):
            a, b = end[k], end[WIDTH + k]
            rows[END_X * WIDTH + k] += r0 * a + r1 * b
            rows[END_V * WIDTH + k] += r2 * a + r3 * b
            rows[END_LIMIT * WIDTH + k] -= weight * (frequency * abs(a) + abs(b))
