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
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels import lane_tables
from grazemap_core.kernels.lane_tables import TERMS, LaneTables
from grazemap_core.kernels.lanes import Masses
from grazemap_core.tolerances import LANE_SURE

FloatArray = NDArray[np.float64]

WIDTH = 16
"""Columns of a tile."""

# rows of `Tile.rows`
CLEARANCE, SIDE, PLACE, ON_STOP, GAP, RATE = 0, 1, 2, 3, 4, 5
"""The stop, z where the series begins, 1 on the stop (behind an impact) or 0, and the gap and its rate in s there."""
OUTCOME, LENGTH, SPEED, JUMP, PRESSING = 6, 7, 8, 9, 10
"""Of the last round: what it found, s of the contact, speed before it, kick, and pressing behind it (in velocity and
time of the problem)."""
END_GAP, END_RATE, END_X, END_V, END_LIMIT = 11, 12, 13, 14, 15
ROWS = 16

UNSURE, CLEAR, CONTACT = 0.0, 1.0, 2.0
"""Outcomes: nothing is claimed; no contact up to the end of the cell; the next contact."""


class Tile(NamedTuple):
    """WIDTH columns.

    Attributes
    ----------
    start, end : (2 N, WIDTH)
        (u, u') of every block at the start of the cell, and at its end.
    series : (TERMS, WIDTH)
        Coefficients of the gap in s.
    rows : (ROWS, WIDTH)
    """

    start: FloatArray
    end: FloatArray
    series: FloatArray
    rows: FloatArray


def tile(masses: int) -> Tile:
    """Return an empty tile for an oscillator."""
    return Tile(
        start=np.zeros((2 * masses, WIDTH)),
        end=np.zeros((2 * masses, WIDTH)),
        series=np.zeros((TERMS, WIDTH)),
        rows=np.zeros((ROWS, WIDTH)),
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _shift(series: FloatArray, by: FloatArray) -> None:
    """Expand every column about a point that lies `by` (WIDTH,) further on (repeated synthetic division)."""
    for i in range(TERMS - 1):
        for n in range(TERMS - 2, i - 1, -1):
            low, high = series[n], series[n + 1]
            for k in range(WIDTH):
                low[k] += by[k] * high[k]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _horner_row(table: FloatArray, z: FloatArray, jump: FloatArray, out: FloatArray) -> None:
    """Add jump times a polynomial at z to `out`; all (WIDTH,)."""
    t0, t1, t2, t3, t4 = table[0], table[1], table[2], table[3], table[4]
    t5, t6, t7, t8, t9 = table[5], table[6], table[7], table[8], table[9]
    t10, t11, t12, t13, t14 = table[10], table[11], table[12], table[13], table[14]
    for k in range(WIDTH):
        x = z[k]
        high = (((t14 * x + t13) * x + t12) * x + t11) * x + t10
        middle = ((((high * x + t9) * x + t8) * x + t7) * x + t6) * x + t5
        out[k] += jump[k] * (((((middle * x + t4) * x + t3) * x + t2) * x + t1) * x + t0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _kick(tables: LaneTables, tile: Tile) -> None:
    """Let every column with a JUMP (0 elsewhere) begin behind an impact where it stands."""
    rows, series = tile.rows, tile.series
    half = 0.5 * tables.scalars[lane_tables.STEP]
    restitution = tables.scalars[lane_tables.RESTITUTION]
    side, jump, speed = rows[SIDE], rows[JUMP], rows[SPEED]
    for n in range(2, TERMS):
        response = tables.response[n]
        row = series[n]
        for k in range(WIDTH):
            row[k] -= side[k] * jump[k] * response
    for k in range(WIDTH):
        struck = jump[k] != 0.0
        rows[ON_STOP, k] = 1.0 if struck else rows[ON_STOP, k]
        rows[GAP, k] = 0.0 if struck else rows[GAP, k]
        rows[RATE, k] = restitution * speed[k] * half if struck else rows[RATE, k]
        series[0, k] = rows[GAP, k]
        series[1, k] = rows[RATE, k]
        rows[PRESSING, k] = -2.0 * series[2, k] / (half * half)
    for c in range(tile.end.shape[0]):
        _horner_row(tables.kick[c], rows[PLACE], jump, tile.end[c])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def enter_tile(masses: Masses, tables: LaneTables, cell: int, tile: Tile) -> None:
    """Set up a tile from tile.start and the rows CLEARANCE, SIDE, PLACE, GAP, RATE, and an impact's SPEED and JUMP.

    A column without an impact (JUMP 0) begins at PLACE with the gap and the rate given.
    """
    rows, series = tile.rows, tile.series
    side, place = rows[SIDE], rows[PLACE]
    forcing = tables.forcing[cell]
    for n in range(TERMS):
        row = series[n]
        table = tables.series[n]
        steady = forcing[n]
        for k in range(WIDTH):
            total = steady
            for c in range(2 * len(masses)):
                total += table[c] * tile.start[c, k]
            row[k] = -side[k] * total
    _shift(series, place)
    for j in range(tables.flow.shape[0]):
        f0, f1, f2, f3 = tables.flow[j, 0], tables.flow[j, 1], tables.flow[j, 2], tables.flow[j, 3]
        first, second = tile.start[2 * j], tile.start[2 * j + 1]
        a, b = tile.end[2 * j], tile.end[2 * j + 1]
        for k in range(WIDTH):
            a[k] = f0 * first[k] + f1 * second[k]
            b[k] = f2 * first[k] + f3 * second[k]
    for k in range(WIDTH):
        rows[ON_STOP, k] = 0.0
    _kick(tables, tile)


@njit(nogil=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
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


@njit(nogil=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
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


@njit(nogil=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
def _least_on(g0: float, d0: float, g1: float, d1: float, quartic: float) -> float:
    """Return a lower bound of a function on [0, 1] from values and slopes at the ends, |fourth derivative| / 144 known.

    Hermite's interpolant in Bernstein's basis of degree four; its error, at most that times 6 t^2 (1 - t)^2, falls on
    the middle coefficient.
    """
    c1, c2 = g0 + d0 / 3.0, g1 - d1 / 3.0
    ends = min(min(g0, g1), min(0.25 * g0 + 0.75 * c1, 0.25 * g1 + 0.75 * c2))
    return min(ends, 0.5 * (c1 + c2) - quartic)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def next_contacts(tables: LaneTables, tile: Tile) -> None:
    """Find in every column the next contact with its stop up to the end of the cell, or certify that there is none.

    On return OUTCOME, and LENGTH, SPEED, JUMP with CONTACT (0 elsewhere), END_GAP and END_RATE with CLEAR.

    On the stop the zero there is divided out of the gap first. The guess is the root of the cubic through values and
    slopes at both ends; certificates as in `lanes`, with the fourth derivative bounded by the series itself. That there
    is no contact is certified on both sides of the lowest point of that cubic.
    """
    rows, series = tile.rows, tile.series
    half = 0.5 * tables.scalars[lane_tables.STEP]
    bounce = 1.0 + tables.scalars[lane_tables.RESTITUTION]
    for k in range(WIDTH):
        on = rows[ON_STOP, k] > 0.0
        a0 = series[1, k] if on else series[0, k]
        a1 = series[2, k] if on else series[1, k]
        a2 = series[3, k] if on else series[2, k]
        a3 = series[4, k] if on else series[3, k]
        a4 = series[5, k] if on else series[4, k]
        a5 = series[6, k] if on else series[5, k]
        a6 = series[7, k] if on else series[6, k]
        a7 = series[8, k] if on else series[7, k]
        a8 = series[9, k] if on else series[8, k]
        a9 = series[10, k] if on else series[9, k]
        a10 = series[11, k] if on else series[10, k]
        a11 = series[12, k] if on else series[11, k]
        a12 = series[13, k] if on else series[12, k]
        a13 = series[14, k] if on else series[13, k]
        a14 = 0.0 if on else series[14, k]
        left = 1.0 - rows[PLACE, k]
        # value, slope and bounds at the end of the cell
        g, d, _ = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, left)
        size, fourth = _moduli(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, left)
        g1, d1 = g, d * left
        d0 = a1 * left
        c2, c3 = 3.0 * (g1 - a0) - 2.0 * d0 - d1, 2.0 * (a0 - g1) + d0 + d1
        # the lowest point of the cubic, kept off the ends
        bend = c2 * c2 - 3.0 * c3 * d0
        low = np.sqrt(max(bend, 0.0)) + c2
        t = -d0 / (low if low > 0.0 else 1.0)
        t = min(max(t if (low > 0.0) & (bend > 0.0) else 0.5, 0.125), 0.875)
        gm, dm, _ = _polynomial(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, t * left)
        dm *= left
        quartic = fourth / 144.0
        u = 1.0 - t
        before = _least_on(a0, d0 * t, gm, dm * t, quartic * ((t * t) * (t * t)))
        behind = _least_on(gm, dm * u, g1, d1 * u, quartic * ((u * u) * (u * u)))
        rounding = tables.scalars[lane_tables.MARGIN] * size
        clear = min(before, behind) > rounding

        falling = max(d0 * d0 - 4.0 * (g1 - a0 - d0) * a0, 0.0)
        t = min(max(2.0 * a0 / max(np.sqrt(falling) - d0, 1e-300), 0.0), 1.0)
        f = ((c3 * t + c2) * t + d0) * t + a0
        d = (3.0 * c3 * t + 2.0 * c2) * t + d0
        e = 3.0 * c3 * t + c2
        t = t - f * d / (d * d - f * e)
        f = ((c3 * t + c2) * t + d0) * t + a0
        d = (3.0 * c3 * t + 2.0 * c2) * t + d0
        e = 3.0 * c3 * t + c2
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
        within = LANE_SURE * part > tables.scalars[lane_tables.MARGIN] * size * s / left
        contact = (sure > 0.0) & settled & within
        # the other stop is out of reach
        travel = size * (left if on else 1.0)
        inside = travel + rounding < 1.9 * rows[CLEARANCE, k]
        contact = contact & inside
        clear = clear & inside & (not contact)
        speed = -slope * (s if on else 1.0) / half
        rows[OUTCOME, k] = CONTACT if contact else (CLEAR if clear else UNSURE)
        rows[LENGTH, k] = s if contact else 0.0
        rows[SPEED, k] = speed if contact else 0.0
        rows[JUMP, k] = -rows[SIDE, k] * bounce * speed if contact else 0.0
        rows[END_GAP, k] = g1 * (left if on else 1.0)
        rows[END_RATE, k] = (g1 + d1 if on else d1 / left) / half


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def strike_tile(tables: LaneTables, tile: Tile) -> None:
    """Carry every column with a contact on to it, and let it begin anew behind the impact; the others stay."""
    rows = tile.rows
    _shift(tile.series, rows[LENGTH])
    for k in range(WIDTH):
        rows[PLACE, k] += rows[LENGTH, k]
    _kick(tables, tile)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def leave_tile(tables: LaneTables, cell: int, tile: Tile) -> None:
    """Write x1, v1 and the limit (`lanes.refresh_limits`) at the end of the cell."""
    rows = tile.rows
    x, v = tables.gain[cell + 1, 0], tables.gain[cell + 1, 1]
    steady, fourth = tables.scalars[lane_tables.STEADY], tables.scalars[lane_tables.STEADY_FOURTH]
    margin = tables.scalars[lane_tables.MARGIN]
    end_x, end_v, end_limit, clearance = rows[END_X], rows[END_V], rows[END_LIMIT], rows[CLEARANCE]
    for k in range(WIDTH):
        end_x[k] = x
        end_v[k] = v
        end_limit[k] = (1.0 - margin) * clearance[k] - margin * steady - fourth
    for j in range(tables.flow.shape[0]):
        r0, r1, r2, r3 = tables.readout[j, 0], tables.readout[j, 1], tables.readout[j, 2], tables.readout[j, 3]
        frequency, weight = tables.bound[j, 0], margin * tables.bound[j, 1] + tables.bound[j, 2]
        a, b = tile.end[2 * j], tile.end[2 * j + 1]
        for k in range(WIDTH):
            end_x[k] += r0 * a[k] + r1 * b[k]
            end_v[k] += r2 * a[k] + r3 * b[k]
            end_limit[k] -= weight * (frequency * abs(a[k]) + abs(b[k]))
