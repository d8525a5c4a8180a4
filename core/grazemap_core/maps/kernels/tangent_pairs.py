"""Propagation of pairs of small changes of the state, for many lanes side by side, along half periods without rests.

As in `multi_impact_cell`, WIDTH lanes are side by side in a batch, and every loop over them is straight-line
arithmetic. In each step all lanes advance to their next impact; a lane without a further impact advances to the end of
the half period and stays there.

The flow between impacts is a flow over whole cells, from a table, followed by one over at most half a cell forward or
backward, from a series. The arithmetic is that of `tangent.flow_tangent` and `tangent.apply_saltation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.workspace import TIME, VELOCITY
from grazemap_core.maps.kernels.lockstep import CONTACT_ACCELERATION
from grazemap_core.numerics.jit.compiled import fused_inlined, fused_kernel

WIDTH = 16
"""Lanes of a batch: two of the longest vectors of any processor."""

FLOW_DEGREE = 13
"""Degree of the series of a flow over half a cell, with exponents up to CELL_REACH / 2 = 1/2. The omitted term is
2^-14/14! = 7e-16, for a critically damped block 3e-13."""

# rows of `PairBatch.rows`
SHORT, FACTOR, RATIO, PASSED = 0, 1, 2, 3
"""The short time of a flow; 1 + R, or 0 without an impact; ratio of acceleration and velocity at the impact, without
the viscous term; time of the last impact."""
X_FIRST, V_FIRST, X_SECOND, V_SECOND = 4, 5, 6, 7
"""Position and velocity of mass 1 in both changes; then their jumps at the impact."""
ROWS = 8


class PairBatch(NamedTuple):
    """WIDTH lanes.

    Attributes
    ----------
    lanes, first, impacts : (WIDTH,)
        Index of a lane, row of the half period's first impact in its events, and number of impacts.
    pairs : (4 N * WIDTH,)
        For every block, u of the first change and of the second, then u' of both.
    flow : (4 N * WIDTH,)
        The flow over whole cells, row by row.
    rows : (ROWS * WIDTH,)
    series : (2, N, FLOW_DEGREE)
        Each block's response to a unit velocity over a short time: coefficients from the linear one on, and those of
        the derivative, from the constant on.
    """

    lanes: Integers
    first: Integers
    impacts: Integers
    pairs: Floats
    flow: Floats
    rows: Floats
    series: Floats


def pair_batch(decay: Floats, frequency_squared: Floats) -> PairBatch:
    """Return an empty batch for a chain's blocks."""
    masses = len(decay)
    return PairBatch(
        lanes=np.zeros(WIDTH, dtype=np.int64),
        first=np.zeros(WIDTH, dtype=np.int64),
        impacts=np.zeros(WIDTH, dtype=np.int64),
        pairs=np.zeros(4 * masses * WIDTH),
        flow=np.zeros(4 * masses * WIDTH),
        rows=np.zeros(ROWS * WIDTH),
        series=flow_series(decay, frequency_squared),
    )


def flow_series(decay: Floats, frequency_squared: Floats) -> Floats:
    """Return `PairBatch.series`: y'' = -w^2 y - 2 eta y' from y = 0, y' = 1."""
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
def _set_targets(
    batch: PairBatch, count: int, index: int, events: Floats, problem: CellProblem, viscous_term: float
) -> None:
    """Write the flow of every lane to its impact number `index`, or to the end, and the factors of the impact."""
    flow_table, step, factor = problem.flow_table, problem.step, 1.0 + problem.restitution
    end = step * (problem.cells // 2)
    rows, flow = batch.rows, batch.flow
    blocks = flow_table.shape[1]
    for k in range(count):
        lane, row = batch.lanes[k], batch.first[k] + index
        time, ratio, jump = end, 0.0, 0.0
        if index < batch.impacts[k]:
            time, jump = events[lane, row, TIME], factor
            ratio = events[lane, row, CONTACT_ACCELERATION] / abs(events[lane, row, VELOCITY]) - viscous_term * factor
        away = time - rows[PASSED * WIDTH + k]
        cells = int(away / step + 0.5)
        rows[SHORT * WIDTH + k] = away - cells * step
        rows[FACTOR * WIDTH + k] = jump
        rows[RATIO * WIDTH + k] = ratio
        rows[PASSED * WIDTH + k] = time
        for j in range(blocks):
            for i in range(4):
                flow[(4 * j + i) * WIDTH + k] = flow_table[cells, j, i]


@fused_inlined
def _flow_pairs(batch: PairBatch, decay: Floats, frequency_squared: Floats) -> None:
    """Carry all pairs over whole cells and the short time."""
    rows, flow, pairs, series = batch.rows, batch.flow, batch.pairs, batch.series
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
def _strike_pairs(
    batch: PairBatch, decay: Floats, frequency_squared: Floats, output_row: Floats, unit_impulse: Floats
) -> None:
    """Carry all pairs through an impact; those with FACTOR 0 do not change."""
    rows, pairs = batch.rows, batch.pairs
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
    batch: PairBatch,
    count: int,
    most: int,
    events: Floats,
    pair: Floats,
    problem: CellProblem,
    viscous_term: float,
) -> None:
    """Propagate pairs along the half period of their lanes, in place.

    Parameters
    ----------
    batch : PairBatch
        Input: `lanes`, `first` and `impacts` of the first `count` lanes; all else is scratch.
    most : int
        Maximum number of impacts.
    events : (LANES, capacity, LANE_EVENT_COLUMNS)
    pair : (LANES, 2 N, 2)
    problem : CellProblem
        Its flow_table must have all cells of half a period.
    viscous_term : float
        Damping that changes sign with the velocity at an impact, C_11/m_1.
    """
    rows, pairs = batch.rows, batch.pairs
    decay, frequency_squared = problem.decay, problem.frequency_squared
    output_row, unit_impulse = problem.output_row, problem.unit_impulse
    blocks = decay.shape[0]
    for k in range(WIDTH):
        rows[PASSED * WIDTH + k] = 0.0
        rows[SHORT * WIDTH + k] = 0.0
        rows[FACTOR * WIDTH + k] = 0.0
        rows[RATIO * WIDTH + k] = 0.0
    for k in range(count):
        lane = batch.lanes[k]
        for j in range(blocks):
            for c in range(2):
                pairs[(4 * j + c) * WIDTH + k] = pair[lane, 2 * j, c]
                pairs[(4 * j + 2 + c) * WIDTH + k] = pair[lane, 2 * j + 1, c]
    for index in range(most + 1):
        _set_targets(batch, count, index, events, problem, viscous_term)
        _flow_pairs(batch, decay, frequency_squared)
        if index < most:
            _strike_pairs(batch, decay, frequency_squared, output_row, unit_impulse)
    for k in range(count):
        lane = batch.lanes[k]
        for j in range(blocks):
            for c in range(2):
                pair[lane, 2 * j, c] = pairs[(4 * j + c) * WIDTH + k]
                pair[lane, 2 * j + 1, c] = pairs[(4 * j + 2 + c) * WIDTH + k]
