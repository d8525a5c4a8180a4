"""Two changes of the state each, carried along many lanes side by side through a half period with impacts only.

A pair of changes and the impacts of its lane's half period flow in; the pair at the end of the half period flows out.
As in `bounces`, WIDTH lanes stand side by side in a tile and every loop over them is straight-line arithmetic. Impact
after impact, all lanes go on to their next one; one that has no more goes on to the end, and waits there.

The flow between impacts is one over whole cells, which is in a table, and a short one, of less than half a cell either
way, a series. The arithmetic is that of `tangent.flow_tangent` and `tangent.apply_saltation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.workspace import TIME, VELOCITY
from grazemap_core.maps.kernels.lockstep import CONTACT_ACCELERATION
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel

WIDTH = 16
"""Lanes of a tile: two of the longest vectors of any processor."""

FLOW_DEGREE = 13
"""Of the series of a flow over half a cell at most, so of exponents up to 1/2: 2^-14/14! = 7e-16 is left out, of a
critically damped block's 3e-13."""

# rows of `PairTile.rows`
SHORT, FACTOR, RATIO, PASSED = 0, 1, 2, 3
"""The short time of a flow; 1 + R, or 0 where there is no impact; the acceleration at the impact over the velocity,
less what the drag adds; the time of the last impact."""
X_FIRST, V_FIRST, X_SECOND, V_SECOND = 4, 5, 6, 7
"""Of both changes, place and velocity of mass 1; then by how much they are kicked."""
ROWS = 8


class PairTile(NamedTuple):
    """WIDTH lanes.

    Attributes
    ----------
    lanes, first, impacts : (WIDTH,)
        Which lanes, the row of the half period's first impact in a lane's events, and how many there are.
    pairs : (4 N * WIDTH,)
        Of every block u of the first change and of the second, then u' of both.
    flow : (4 N * WIDTH,)
        The flow over whole cells, row by row.
    rows : (ROWS * WIDTH,)
    series : (2, N, FLOW_DEGREE)
        Of each block's answer to a unit rate over a short time: coefficients from that of the first power on, and those
        of the derivative, from the constant on.
    """

    lanes: Integers
    first: Integers
    impacts: Integers
    pairs: Floats
    flow: Floats
    rows: Floats
    series: Floats


def pair_tile(decay: Floats, frequency_squared: Floats) -> PairTile:
    """Return an empty tile for a chain's blocks."""
    masses = len(decay)
    return PairTile(
        lanes=np.zeros(WIDTH, dtype=np.int64),
        first=np.zeros(WIDTH, dtype=np.int64),
        impacts=np.zeros(WIDTH, dtype=np.int64),
        pairs=np.zeros(4 * masses * WIDTH),
        flow=np.zeros(4 * masses * WIDTH),
        rows=np.zeros(ROWS * WIDTH),
        series=flow_series(decay, frequency_squared),
    )


def flow_series(decay: Floats, frequency_squared: Floats) -> Floats:
    """Return `PairTile.series`: y'' = -w^2 y - 2 eta y' from y = 0, y' = 1."""
    series = np.zeros((2, len(decay), FLOW_DEGREE))
    before, term = np.zeros(len(decay)), np.ones(len(decay))
    for power in range(1, FLOW_DEGREE + 1):
        series[0, :, power - 1], series[1, :, power - 1] = term, power * term
        following = -(2.0 * decay * power * term + frequency_squared * before) / (power * (power + 1.0))
        before, term = term, following
    return series


@fused_inlined
def _series(s: Floats, t: float) -> float:
    """Return the polynomial of degree 12 with these coefficients."""
    value: float = s[12]
    value = value * t + s[11]
    value = value * t + s[10]
    value = value * t + s[9]
    value = value * t + s[8]
    value = value * t + s[7]
    value = value * t + s[6]
    value = value * t + s[5]
    value = value * t + s[4]
    value = value * t + s[3]
    value = value * t + s[2]
    value = value * t + s[1]
    value = value * t + s[0]
    return value


@fused_inlined
def _aim(
    tile: PairTile,
    count: int,
    step_index: int,
    events: Floats,
    flow_table: Floats,
    step: float,
    factor: float,
    viscous_term: float,
    end: float,
) -> None:
    """Write what carries every lane to its next impact, or to the end, and through the impact."""
    rows, flow = tile.rows, tile.flow
    blocks = flow_table.shape[1]
    for k in range(count):
        lane, row = tile.lanes[k], tile.first[k] + step_index
        time, ratio, kicked = end, 0.0, 0.0
        if step_index < tile.impacts[k]:
            time, kicked = events[lane, row, TIME], factor
            ratio = events[lane, row, CONTACT_ACCELERATION] / abs(events[lane, row, VELOCITY]) - viscous_term * factor
        away = time - rows[PASSED * WIDTH + k]
        cells = int(away / step + 0.5)
        rows[SHORT * WIDTH + k] = away - cells * step
        rows[FACTOR * WIDTH + k] = kicked
        rows[RATIO * WIDTH + k] = ratio
        rows[PASSED * WIDTH + k] = time
        for j in range(blocks):
            for i in range(4):
                flow[(4 * j + i) * WIDTH + k] = flow_table[cells, j, i]


@fused_inlined
def _flow(tile: PairTile, decay: Floats, frequency_squared: Floats) -> None:
    """Carry all pairs over whole cells and the short time; what mass 1 does then is summed up."""
    rows, flow, pairs, series = tile.rows, tile.flow, tile.pairs, tile.series
    for j in range(decay.shape[0]):
        square, twice = frequency_squared[j], 2.0 * decay[j]
        answer, slope = series[0, j], series[1, j]
        over = flow[4 * j * WIDTH : (4 * j + 4) * WIDTH]
        both = pairs[4 * j * WIDTH : (4 * j + 4) * WIDTH]
        for k in range(WIDTH):
            short = rows[SHORT * WIDTH + k]
            y = _series(answer, short) * short
            rate = _series(slope, short)
            stays = rate + twice * y
            t11, t12, t21, t22 = over[k], over[WIDTH + k], over[2 * WIDTH + k], over[3 * WIDTH + k]
            e11, e12 = stays * t11 + y * t21, stays * t12 + y * t22
            e21, e22 = rate * t21 - square * y * t11, rate * t22 - square * y * t12
            u, w, du, dw = both[k], both[WIDTH + k], both[2 * WIDTH + k], both[3 * WIDTH + k]
            both[k] = e11 * u + e12 * du
            both[WIDTH + k] = e11 * w + e12 * dw
            both[2 * WIDTH + k] = e21 * u + e22 * du
            both[3 * WIDTH + k] = e21 * w + e22 * dw


@fused_inlined
def _strike(tile: PairTile, decay: Floats, frequency_squared: Floats, output_row: Floats, unit_impulse: Floats) -> None:
    """Carry all pairs through the impacts at which they stand; those with FACTOR 0 stay."""
    rows, pairs = tile.rows, tile.pairs
    for k in range(WIDTH):
        rows[X_FIRST * WIDTH + k] = 0.0
        rows[V_FIRST * WIDTH + k] = 0.0
        rows[X_SECOND * WIDTH + k] = 0.0
        rows[V_SECOND * WIDTH + k] = 0.0
    for j in range(decay.shape[0]):
        r0, r1, r2, r3 = output_row[j, 0], output_row[j, 1], output_row[j, 2], output_row[j, 3]
        both = pairs[4 * j * WIDTH : (4 * j + 4) * WIDTH]
        for k in range(WIDTH):
            u, w, du, dw = both[k], both[WIDTH + k], both[2 * WIDTH + k], both[3 * WIDTH + k]
            rows[X_FIRST * WIDTH + k] += r0 * u + r1 * du
            rows[V_FIRST * WIDTH + k] += r2 * u + r3 * du
            rows[X_SECOND * WIDTH + k] += r0 * w + r1 * dw
            rows[V_SECOND * WIDTH + k] += r2 * w + r3 * dw
    for k in range(WIDTH):
        factor, ratio = rows[FACTOR * WIDTH + k], rows[RATIO * WIDTH + k]
        x, y = rows[X_FIRST * WIDTH + k], rows[X_SECOND * WIDTH + k]
        rows[V_FIRST * WIDTH + k] = -factor * (rows[V_FIRST * WIDTH + k] - ratio * x)
        rows[V_SECOND * WIDTH + k] = -factor * (rows[V_SECOND * WIDTH + k] - ratio * y)
        rows[X_FIRST * WIDTH + k] = -factor * x
        rows[X_SECOND * WIDTH + k] = -factor * y
    for j in range(decay.shape[0]):
        k0, k1 = unit_impulse[j, 0], unit_impulse[j, 1]
        second_derivative = frequency_squared[j] * k0 + 2.0 * decay[j] * k1
        both = pairs[4 * j * WIDTH : (4 * j + 4) * WIDTH]
        for k in range(WIDTH):
            x, v = rows[X_FIRST * WIDTH + k], rows[V_FIRST * WIDTH + k]
            y, w = rows[X_SECOND * WIDTH + k], rows[V_SECOND * WIDTH + k]
            both[k] += v * k0 + x * k1
            both[WIDTH + k] += w * k0 + y * k1
            both[2 * WIDTH + k] += v * k1 - x * second_derivative
            both[3 * WIDTH + k] += w * k1 - y * second_derivative


@fused_kernel
def carry_pairs(
    tile: PairTile,
    count: int,
    most: int,
    events: Floats,
    pair: Floats,
    flow_table: Floats,
    decay: Floats,
    frequency_squared: Floats,
    output_row: Floats,
    unit_impulse: Floats,
    step: float,
    factor: float,
    viscous_term: float,
    end: float,
) -> None:
    """Carry pairs along the half period that their lanes have been through, in place.

    Parameters
    ----------
    tile : PairTile
        `lanes`, `first` and `impacts` say of the first `count` columns what they are; all else is scratch.
    most : int
        The largest number of impacts.
    events : (LANES, capacity, LANE_EVENT_COLUMNS)
    pair : (LANES, 2 N, 2)
    flow_table : (n, N, 8)
        As in `cells.CellProblem`; the caller sees to it that it has all cells of half a period.
    factor, viscous_term, end : float
        1 + R; the damping that turns with the velocity at an impact; length of half a period.
    """
    rows, pairs = tile.rows, tile.pairs
    blocks = decay.shape[0]
    for k in range(WIDTH):
        rows[PASSED * WIDTH + k] = 0.0
        rows[SHORT * WIDTH + k] = 0.0
        rows[FACTOR * WIDTH + k] = 0.0
        rows[RATIO * WIDTH + k] = 0.0
    for k in range(count):
        lane = tile.lanes[k]
        for j in range(blocks):
            for c in range(2):
                pairs[(4 * j + c) * WIDTH + k] = pair[lane, 2 * j, c]
                pairs[(4 * j + 2 + c) * WIDTH + k] = pair[lane, 2 * j + 1, c]
    for step_index in range(most + 1):
        _aim(tile, count, step_index, events, flow_table, step, factor, viscous_term, end)
        _flow(tile, decay, frequency_squared)
        if step_index < most:
            _strike(tile, decay, frequency_squared, output_row, unit_impulse)
    for k in range(count):
        lane = tile.lanes[k]
        for j in range(blocks):
            for c in range(2):
                pair[lane, 2 * j, c] = pairs[(4 * j + c) * WIDTH + k]
                pair[lane, 2 * j + 1, c] = pairs[(4 * j + 2 + c) * WIDTH + k]
