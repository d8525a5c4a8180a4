"""Many trajectories side by side: the straight-line arithmetic that carries all lanes through one cell.

Every function here is a few loops over lanes, innermost and without a branch, so that the compiler turns them into
vector instructions; what is unusual about a lane is left to `lockstep`, lane by lane. A row of a work array holds one
quantity for all LANES. The number of masses is a constant to the compiler: it is the length of the tuple `masses`,
of which nothing else matters.

Loops over columns run over whole groups of COLUMNS, filled up with copies: a lane gets the same bytes whatever runs
beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.tolerances import ANCHORED_GAP
from grazemap_core.maps.kernels import lane_tables
from grazemap_core.maps.kernels.lane_tables import TERMS, LaneTables
from grazemap_core.maps.tolerances import LANE_SURE, MOST_FUSED_MASSES
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel, kernel

Masses = tuple[int, ...]

LANES = 128
"""Trajectories in lockstep: many, so that those with an impact in one cell fill vectors; few enough for the caches."""
VECTOR = 8
"""Numbers in the longest vector of any processor: lanes with an impact are solved in groups of so many."""
COLUMNS = 2 * VECTOR
"""Lanes are in use in groups of so many: loops over all of them work on two vectors at a time."""

# A state has 2 N + 2 rows: (u, u') of every block, then x1 and v1.

# rows of `Columns.rows`
START_X, START_V, GAP, END_X, END_V, END_LIMIT = 0, 1, 2, 3, 4, 5
"""On entry x1 and v1 at the start of the cell and the clearance; on return x1, v1 and the limit at its end."""
REACH, FOURTH, PLACE, JUMP, SIDE, SPEED, CONTACT_ACCELERATION, SURE, CERTAIN = 6, 7, 8, 9, 10, 11, 12, 13, 14
"""Bounds at the start; z of the impact; velocity that it adds; stop; speed before it; acceleration toward the stop
behind it; what remains of the certificates, and which of them hold."""
HIGHEST = 15
COLUMN_ROWS = 16

NOTHING, FIRST, ONLY, NONE = 0.0, 1.0, 2.0, 3.0
"""What is certain: nothing; the first impact in the cell; that it is the only one, and wants no closer look; that there
is none."""


class Columns(NamedTuple):
    """The lanes of one cell that have an impact, side by side.

    Attributes
    ----------
    start, end : (2 N * LANES,)
        (u, u') of every block at the start of the cell, and at its end.
    series : (TERMS * LANES,)
        Coefficients of x1 in z.
    rows : (COLUMN_ROWS * LANES,)
    """

    start: Floats
    end: Floats
    series: Floats
    rows: Floats


def columns(masses: int) -> Columns:
    """Return room for all lanes of an oscillator."""
    return Columns(
        start=np.zeros(2 * masses * LANES),
        end=np.zeros(2 * masses * LANES),
        series=np.zeros(TERMS * LANES),
        rows=np.zeros(COLUMN_ROWS * LANES),
    )


@fused_inlined
def _advance_fused(
    masses: Masses,
    tables: LaneTables,
    steady_x: float,
    steady_v: float,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    flow, output_row = tables.flow, tables.output_row
    third = tables.scalars[lane_tables.STEP] / 3.0
    flagged = 0
    at_x, at_v = 2 * len(masses) * LANES, (2 * len(masses) + 1) * LANES
    for lane in range(min(used, LANES)):
        x, v = steady_x, steady_v
        for j in range(len(masses)):
            first, second = here[2 * j * LANES + lane], here[(2 * j + 1) * LANES + lane]
            a = flow[j, 0] * first + flow[j, 1] * second
            b = flow[j, 2] * first + flow[j, 3] * second
            there[2 * j * LANES + lane] = a
            there[(2 * j + 1) * LANES + lane] = b
            x += output_row[j, 0] * a + output_row[j, 1] * b
            v += output_row[j, 2] * a + output_row[j, 3] * b
        x0, v0 = here[at_x + lane], here[at_v + lane]
        highest = max(max(abs(x0), abs(x0 + third * v0)), max(abs(x - third * v), abs(x)))
        flag = 0 if highest < limit[lane] else 1
        flags[lane] = flag
        flagged += flag
        there[at_x + lane] = x
        there[at_v + lane] = v
    return flagged


@fused_kernel
def _advance_by_block(
    blocks: int,
    tables: LaneTables,
    steady_x: float,
    steady_v: float,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    third = tables.scalars[lane_tables.STEP] / 3.0
    used = min(used, LANES)
    start = here[2 * blocks * LANES : (2 * blocks + 2) * LANES]
    end = there[2 * blocks * LANES : (2 * blocks + 2) * LANES]
    for lane in range(used):
        end[lane] = steady_x
        end[LANES + lane] = steady_v
    for j in range(blocks):
        f0, f1, f2, f3 = tables.flow[j, 0], tables.flow[j, 1], tables.flow[j, 2], tables.flow[j, 3]
        r0, r1, r2, r3 = (
            tables.output_row[j, 0],
            tables.output_row[j, 1],
            tables.output_row[j, 2],
            tables.output_row[j, 3],
        )
        before, behind = here[2 * j * LANES : (2 * j + 2) * LANES], there[2 * j * LANES : (2 * j + 2) * LANES]
        for lane in range(used):
            first, second = before[lane], before[LANES + lane]
            a = f0 * first + f1 * second
            b = f2 * first + f3 * second
            behind[lane] = a
            behind[LANES + lane] = b
            end[lane] += r0 * a + r1 * b
            end[LANES + lane] += r2 * a + r3 * b
    flagged = 0
    for lane in range(used):
        x, v = end[lane], end[LANES + lane]
        x0, v0 = start[lane], start[LANES + lane]
        highest = max(max(abs(x0), abs(x0 + third * v0)), max(abs(x - third * v), abs(x)))
        flag = 0 if highest < limit[lane] else 1
        flags[lane] = flag
        flagged += flag
    return flagged


@fused_kernel
def advance(
    masses: Masses,
    tables: LaneTables,
    end: int,
    here: Floats,
    there: Floats,
    limit: Floats,
    flags: Integers,
    used: int,
) -> int:
    """Carry the first `used` lanes over one cell without impacts; certify where there is none (`contact.is_clear`).

    Parameters
    ----------
    end : int
        Cell boundary at which the cell ends.
    here, there : ((2 N + 2) * LANES,)
        State at the start, which is left as it is, and at the end.
    limit : (LANES,)
        What the Bernstein coefficients of |x1| must stay below for a cell to be clear.
    flags : (LANES,)
        On return 1 where the cell may have a contact.
    used : int
        A multiple of COLUMNS.

    Returns
    -------
    The number of lanes flagged.
    """
    x, v = tables.steady_table[end, 0], tables.steady_table[end, 1]
    if len(masses) <= MOST_FUSED_MASSES:
        return _advance_fused(masses, tables, x, v, here, there, limit, flags, used)
    return _advance_by_block(len(masses), tables, x, v, here, there, limit, flags, used)


@fused_kernel
def refresh_limits(
    blocks: int,
    tables: LaneTables,
    state: Floats,
    clearance: Floats,
    limit: Floats,
    reach: Floats,
    used: int,
) -> None:
    """Set limit (LANES,) from the bounds of all that is to come, and reach (LANES,) to that of |x1|."""
    steady, fourth = tables.scalars[lane_tables.STEADY], tables.scalars[lane_tables.STEADY_FOURTH]
    margin = tables.scalars[lane_tables.MARGIN]
    for lane in range(min(used, LANES)):
        reach[lane] = steady
        limit[lane] = fourth
    for j in range(blocks):
        frequency, of_reach, of_fourth = tables.bound[j, 0], tables.bound[j, 1], tables.bound[j, 2]
        block = state[2 * j * LANES : (2 * j + 2) * LANES]
        for lane in range(min(used, LANES)):
            envelope = frequency * abs(block[lane]) + abs(block[LANES + lane])
            reach[lane] += of_reach * envelope
            limit[lane] += of_fourth * envelope
    for lane in range(min(used, LANES)):
        limit[lane] = clearance[lane] - margin * (reach[lane] + clearance[lane]) - limit[lane]


@fused_inlined
def _terms(masses: Masses, row: Floats, start: Floats, forcing: float, column: int) -> float:
    total = forcing
    for c in range(2 * len(masses)):
        total += row[c] * start[c * LANES + column]
    return total


@fused_inlined
def _expand(masses: Masses, table: Floats, forcing: Floats, start: Floats, series: Floats, count: int) -> None:
    """Write the coefficients of x1 in z, three at a time: the state is read seldom, and the tables fit in registers."""
    count = min(count, LANES)
    for n in range(0, TERMS, 3):
        f0, f1, f2 = forcing[n], forcing[n + 1], forcing[n + 2]
        t0, t1, t2 = table[n], table[n + 1], table[n + 2]
        out = series[n * LANES : (n + 3) * LANES]
        for k in range(count):
            out[k] = _terms(masses, t0, start, f0, k)
            out[LANES + k] = _terms(masses, t1, start, f1, k)
            out[2 * LANES + k] = _terms(masses, t2, start, f2, k)


@fused_inlined
def _free_end(blocks: int, tables: LaneTables, end: int, columns: Columns, count: int) -> None:
    """Write the state at the end of the cell as if there were no impact, x1 and v1 there, and the bounds so far."""
    count = min(count, LANES)
    rows = columns.rows
    x, v = tables.steady_table[end, 0], tables.steady_table[end, 1]
    steady, fourth = tables.scalars[lane_tables.STEADY], tables.scalars[lane_tables.STEADY_FOURTH]
    for k in range(count):
        rows[END_X * LANES + k] = x
        rows[END_V * LANES + k] = v
        rows[REACH * LANES + k] = steady
        rows[FOURTH * LANES + k] = fourth
    for j in range(blocks):
        f0, f1, f2, f3 = tables.flow[j, 0], tables.flow[j, 1], tables.flow[j, 2], tables.flow[j, 3]
        r0, r1, r2, r3 = (
            tables.output_row[j, 0],
            tables.output_row[j, 1],
            tables.output_row[j, 2],
            tables.output_row[j, 3],
        )
        frequency, of_reach, of_fourth = tables.bound[j, 0], tables.bound[j, 1], tables.bound[j, 2]
        before = columns.start[2 * j * LANES : (2 * j + 2) * LANES]
        behind = columns.end[2 * j * LANES : (2 * j + 2) * LANES]
        for k in range(count):
            first, second = before[k], before[LANES + k]
            a = f0 * first + f1 * second
            b = f2 * first + f3 * second
            behind[k] = a
            behind[LANES + k] = b
            rows[END_X * LANES + k] += r0 * a + r1 * b
            rows[END_V * LANES + k] += r2 * a + r3 * b
            envelope = frequency * abs(first) + abs(second)
            rows[REACH * LANES + k] += of_reach * envelope
            rows[FOURTH * LANES + k] += of_fourth * envelope


@fused_inlined
def _value_slope_bend(series: Floats, k: int, z: float) -> tuple[float, float, float]:
    """Return a polynomial of degree 14, its derivative and half its second derivative (Horner, written out)."""
    f = series[14 * LANES + k]
    d = f
    e = f
    f = f * z + series[13 * LANES + k]
    d = d * z + f
    f = f * z + series[12 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[11 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[10 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[9 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[8 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[7 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[6 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[5 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[4 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[3 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[2 * LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[LANES + k]
    e = e * z + d
    d = d * z + f
    f = f * z + series[k]
    return f, d, e


@fused_inlined
def _value_slope(series: Floats, k: int, z: float) -> tuple[float, float]:
    """Return a polynomial of degree 14 and its derivative (Horner, written out)."""
    f = series[14 * LANES + k]
    d = f
    f = f * z + series[13 * LANES + k]
    d = d * z + f
    f = f * z + series[12 * LANES + k]
    d = d * z + f
    f = f * z + series[11 * LANES + k]
    d = d * z + f
    f = f * z + series[10 * LANES + k]
    d = d * z + f
    f = f * z + series[9 * LANES + k]
    d = d * z + f
    f = f * z + series[8 * LANES + k]
    d = d * z + f
    f = f * z + series[7 * LANES + k]
    d = d * z + f
    f = f * z + series[6 * LANES + k]
    d = d * z + f
    f = f * z + series[5 * LANES + k]
    d = d * z + f
    f = f * z + series[4 * LANES + k]
    d = d * z + f
    f = f * z + series[3 * LANES + k]
    d = d * z + f
    f = f * z + series[2 * LANES + k]
    d = d * z + f
    f = f * z + series[LANES + k]
    d = d * z + f
    f = f * z + series[k]
    return f, d


@fused_inlined
def least_on(g0: float, d0: float, g1: float, d1: float, quartic: float) -> float:
    """Return a lower bound of a function on [0, 1] from values and slopes at the ends, |fourth derivative| / 144 known.

    Hermite's interpolant in Bernstein's basis of degree four; its error, at most that times 6 t^2 (1 - t)^2, falls on
    the middle coefficient.
    """
    c1, c2 = g0 + d0 / 3.0, g1 - d1 / 3.0
    ends = min(min(g0, g1), min(0.25 * g0 + 0.75 * c1, 0.25 * g1 + 0.75 * c2))
    return min(ends, 0.5 * (c1 + c2) - quartic)


@fused_inlined
def _guess_impact(step: float, margin: float, columns: Columns, count: int) -> None:
    """Guess where x1 reaches the stop that it is nearer to, or certify that it does not.

    The guess is the root of the polynomial of degree five through positions and velocities at both ends and at
    mid-cell, to five digits or so, in two steps of Halley's method from that of a parabola. Second derivatives are
    those of the cubic through both ends. That there is no contact at all is certified more sharply than in `advance`.
    """
    count = min(count, LANES)
    rows, series = columns.rows, columns.series
    for k in range(count):
        x0, v0 = rows[START_X * LANES + k], rows[START_V * LANES + k]
        x1, v1 = rows[END_X * LANES + k], rows[END_V * LANES + k]
        clearance = rows[GAP * LANES + k]
        # the cubic at mid-cell tells the stop
        side = 1.0 if 4.0 * (x0 + x1) + step * (v0 - v1) > 0.0 else -1.0
        g0, g1 = clearance - side * x0, clearance - side * x1
        d0, d1 = -side * v0 * step, -side * v1 * step
        falling = max(d0 * d0 - 4.0 * (g1 - g0 - d0) * g0, 0.0)
        t = min(max(2.0 * g0 / max(np.sqrt(falling) - d0, 1e-300), 0.0), 1.0)
        rows[SIDE * LANES + k] = side
        rows[PLACE * LANES + k] = t
        quartic = (384.0 / 144.0) * rows[FOURTH * LANES + k]
        twice = 2.0 * clearance
        least = min(least_on(g0, d0, g1, d1, quartic), least_on(twice - g0, -d0, twice - g1, -d1, quartic))
        none = least > margin * (rows[REACH * LANES + k] + clearance)
        rows[CERTAIN * LANES + k] = NONE if none else NOTHING
    for k in range(count):
        x0, v0 = rows[START_X * LANES + k], rows[START_V * LANES + k]
        x1, v1 = rows[END_X * LANES + k], rows[END_V * LANES + k]
        clearance, side, t = rows[GAP * LANES + k], rows[SIDE * LANES + k], rows[PLACE * LANES + k]
        g0, g1 = clearance - side * x0, clearance - side * x1
        d0, d1 = -side * v0 * step, -side * v1 * step
        c2, c3 = 3.0 * (g1 - g0) - 2.0 * d0 - d1, 2.0 * (g0 - g1) + d0 + d1
        # what is left of value and slope at mid-cell
        middle = 16.0 * (clearance - side * series[k] - 0.5 * (g0 + g1) - 0.125 * (d0 - d1))
        tilt = 16.0 * (-2.0 * side * series[LANES + k] - 1.5 * (g1 - g0) + 0.25 * (d0 + d1))
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
        rows[CONTACT_ACCELERATION * LANES + k] = -0.25 * side * (3.0 * c3 * t + c2)
        rows[PLACE * LANES + k] = min(max(2.0 * t - 1.0, -1.0), 1.0)


@fused_inlined
def _find_impact(
    step: float, restitution: float, viscous_term: float, margin: float, columns: Columns, count: int
) -> None:
    """Find where x1 reaches the stop that it is nearer to, and certify that it did not do so before.

    Two steps of Halley's method with the whole series take the guess to round-off. The certificate: Hermite's
    interpolant with double nodes at the start of the cell and at the impact errs by
    x''''(xi)/24 tau^2 (tau_i - tau)^2; divided by its zero, (tau_i - tau), what is left is a quadratic, positive if
    its three Bernstein coefficients exceed max|x''''| tau_i^4 / 162.
    """
    count = min(count, LANES)
    _guess_impact(step, margin, columns, count)
    rows, series = columns.rows, columns.series
    per_step = 2.0 / step
    per_square = 2.0 * per_step * per_step
    bounce = 1.0 + restitution
    for k in range(count):
        z, e = rows[PLACE * LANES + k], rows[CONTACT_ACCELERATION * LANES + k]
        f, d = _value_slope(series, k, z)
        f = rows[SIDE * LANES + k] * rows[GAP * LANES + k] - f
        rows[PLACE * LANES + k] = z + f * d / (d * d + f * e)
    for k in range(count):
        z, side, clearance = rows[PLACE * LANES + k], rows[SIDE * LANES + k], rows[GAP * LANES + k]
        f, d, e = _value_slope_bend(series, k, z)
        f = side * clearance - f
        change = f * d / (d * d + f * e)
        z += change
        v = (d + 2.0 * e * change) * per_step
        jump = -bounce * v
        speed = side * v
        passed = 0.5 * (1.0 + z)
        square = passed * passed
        g0, d0 = clearance - side * rows[START_X * LANES + k], -side * rows[START_V * LANES + k] * step
        quadratic = min(min(g0, 1.5 * g0 + 0.5 * passed * d0), passed * step * speed)
        rows[PLACE * LANES + k] = z
        rows[JUMP * LANES + k] = jump
        rows[SPEED * LANES + k] = speed
        rows[CONTACT_ACCELERATION * LANES + k] = side * (e * per_square - viscous_term * jump)
        rows[SURE * LANES + k] = quadratic - (384.0 / 162.0) * square * square * rows[FOURTH * LANES + k]
        rows[HIGHEST * LANES + k] = max(g0, max(g0 + passed * d0 / 3.0, passed * step * speed / 3.0))
        # the change after this one is as good as zero, and so small that the speed is right
        settled = (abs(change) < 1e-8) & (abs(e * change) < 1e-6 * abs(d))
        said = rows[CERTAIN * LANES + k]
        rows[CERTAIN * LANES + k] = NONE if said == NONE else (FIRST if settled & (abs(z) < 1.0) else NOTHING)


@fused_inlined
def horner(table: Floats, z: float) -> float:
    """Return the polynomial of degree 14 with these coefficients."""
    square = z * z
    even = table[14]
    odd = table[13]
    even = even * square + table[12]
    odd = odd * square + table[11]
    even = even * square + table[10]
    odd = odd * square + table[9]
    even = even * square + table[8]
    odd = odd * square + table[7]
    even = even * square + table[6]
    odd = odd * square + table[5]
    even = even * square + table[4]
    odd = odd * square + table[3]
    even = even * square + table[2]
    odd = odd * square + table[1]
    even = even * square + table[0]
    value: float = odd * z + even
    return value


@fused_inlined
def _kicked_end(blocks: int, tables: LaneTables, end: int, columns: Columns, count: int) -> None:
    """Add the impact to the state at the end of the cell; x1, v1 and the limit there."""
    count = min(count, LANES)
    rows = columns.rows
    x, v = tables.steady_table[end, 0], tables.steady_table[end, 1]
    steady, fourth = tables.scalars[lane_tables.STEADY], tables.scalars[lane_tables.STEADY_FOURTH]
    margin = tables.scalars[lane_tables.MARGIN]
    for k in range(count):
        clearance = rows[GAP * LANES + k]
        rows[END_X * LANES + k] = x
        rows[END_V * LANES + k] = v
        rows[END_LIMIT * LANES + k] = (1.0 - margin) * clearance - margin * steady - fourth
    for j in range(blocks):
        first_table, second_table = tables.unit_impulse[2 * j], tables.unit_impulse[2 * j + 1]
        r0, r1, r2, r3 = (
            tables.output_row[j, 0],
            tables.output_row[j, 1],
            tables.output_row[j, 2],
            tables.output_row[j, 3],
        )
        frequency, weight = tables.bound[j, 0], margin * tables.bound[j, 1] + tables.bound[j, 2]
        behind = columns.end[2 * j * LANES : (2 * j + 2) * LANES]
        for k in range(count):
            z, jump = rows[PLACE * LANES + k], rows[JUMP * LANES + k]
            a = behind[k] + jump * horner(first_table, z)
            b = behind[LANES + k] + jump * horner(second_table, z)
            behind[k] = a
            behind[LANES + k] = b
            rows[END_X * LANES + k] += r0 * a + r1 * b
            rows[END_V * LANES + k] += r2 * a + r3 * b
            rows[END_LIMIT * LANES + k] -= weight * (frequency * abs(a) + abs(b))


@fused_inlined
def _certify(tables: LaneTables, columns: Columns, count: int) -> None:
    """Certify the rest of the cell, and that nothing about the impact wants a closer look.

    Behind the impact as before it (`_find_impact`), with the zero at the start. The other stop is out of reach where
    the Bernstein coefficients of both arcs stay short of it. Mass 1 must not be so near to this stop at the end, and
    come back within the next cell, that the gap needs a precision of its own, nor come to rest there.
    """
    count = min(count, LANES)
    rows = columns.rows
    step, restitution = tables.scalars[lane_tables.STEP], tables.scalars[lane_tables.RESTITUTION]
    kick_reach, kick_fourth = tables.scalars[lane_tables.KICK_REACH], tables.scalars[lane_tables.KICK_FOURTH]
    at_rest = 1e-4 * (1.0 - restitution) * step
    for k in range(count):
        clearance, side = rows[GAP * LANES + k], rows[SIDE * LANES + k]
        jump = abs(rows[JUMP * LANES + k])
        left = 0.5 * (1.0 - rows[PLACE * LANES + k])
        time = left * step
        leaving = restitution * rows[SPEED * LANES + k]
        gap, rate = clearance - side * rows[END_X * LANES + k], -side * rows[END_V * LANES + k]
        reach = rows[REACH * LANES + k] + kick_reach * jump
        fourth = rows[FOURTH * LANES + k] + kick_fourth * jump
        square = left * left
        quadratic = min(min(time * leaving, 1.5 * gap - 0.5 * time * rate), gap)
        margin = LANE_SURE * (reach + clearance)
        above = 2.0 * clearance - fourth - margin
        first = min(rows[SURE * LANES + k] - margin, above - rows[HIGHEST * LANES + k])
        rest = quadratic - (384.0 / 162.0) * square * square * fourth - margin
        rest = min(rest, above - max(time * leaving / 3.0, max(gap, gap - time * rate / 3.0)))
        # the parabola through both rates, a cell ahead, times the time left
        ahead = time * gap + step * (time * rate + 0.5 * step * (rate - leaving))
        bouncing = 2.0 * leaving - at_rest * rows[CONTACT_ACCELERATION * LANES + k]
        apart = max(ahead, gap - ANCHORED_GAP * clearance)
        only = min(rest, min(apart, bouncing)) > 0.0
        said = rows[CERTAIN * LANES + k]
        certain = (first > 0.0) & (said == FIRST)
        rows[CERTAIN * LANES + k] = NONE if said == NONE else ((ONLY if only else FIRST) if certain else NOTHING)


@kernel
def solve_impacts(masses: Masses, tables: LaneTables, cell: int, columns: Columns, count: int) -> None:
    """Find the one impact of each column in a cell, and carry it on to the cell's end.

    Parameters
    ----------
    cell : int
        Index in the forcing period.
    columns : Columns
        `start` and the rows START_X, START_V, GAP are read; all else is written. Where CERTAIN is ONLY there is exactly
        one impact in the cell; where it is FIRST, one at PLACE and perhaps more behind it; where it is NONE, none.
    count : int
        Columns filled, a multiple of VECTOR.
    """
    end = cell + 1
    scalars = tables.scalars
    _expand(masses, tables.series, tables.forcing[cell], columns.start, columns.series, count)
    _free_end(len(masses), tables, end, columns, count)
    step, restitution, viscous_term = (
        scalars[lane_tables.STEP],
        scalars[lane_tables.RESTITUTION],
        scalars[lane_tables.DRAG],
    )
    _find_impact(step, restitution, viscous_term, scalars[lane_tables.MARGIN], columns, count)
    _kicked_end(len(masses), tables, end, columns, count)
    _certify(tables, columns, count)
