"""Tables of an oscillator at a forcing frequency for the lockstep kernels: polynomials over a cell.

A lane is one of the trajectories that a lockstep kernel computes together; q is the contact coordinate. Within a cell,
z runs from -1 to 1. Two quantities are polynomials in z: q, from the state at the start of the cell, and how much an
impulse on the contact at z changes the state at the end of the cell. Expanded about the middle of the cell, the degree
LANE_DEGREE suffices for round-off: the next term is below (CELL_REACH / 2)^15 / 15! = 2e-17 of a block's amplitude.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem, Forced
from grazemap_core.contact.kernels.sticking_flow import rotated_entry
from grazemap_core.maps.tolerances import LANE_DEGREE
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE
from grazemap_core.orbits.kernels.verification import ImpulseBlocks
from grazemap_core.records import NamedTuple

TERMS = LANE_DEGREE + 1
assert TERMS == 15, "first_pass and second_pass are written out for 15 terms"

LANES = 128
"""Lanes of a group: enough that those with an impact in the same cell fill vectors, few enough for the caches."""

RESPONSE_PARTS = 4
"""Number of parts of a cell; the responses of the blocks are tabulated at the end of each part."""

FLOW_DEGREE = 7
"""Degree of the series of a flow over half a part of a cell, with exponents up to CELL_REACH / (2 RESPONSE_PARTS) =
1/8. The omitted term is 2^-24/8! = 1.5e-12, and growth is not known to more than three digits."""

BLOCK_NUMBERS = 4
"""How many numbers `LaneTables.block` has for each block."""

HERMITE_DIVISOR = 384.0
"""A function differs from its cubic Hermite interpolant over a cell of length h by at most h^4/384 max |q''''|."""

# entries of `scalars`
STEP, VISCOUS_TERM, STEADY, STEADY_FOURTH, IMPULSE_REACH, IMPULSE_FOURTH = 0, 1, 2, 3, 4, 5
"""Length h of a cell; the viscous term of `sticking_flow.HeldProblem`; bounds of the reference motion, and of h^4/384
times its fourth derivative; contributions of a unit of velocity given to q to the bounds of |q| and of h^4/384
|q''''|."""
SCALAR_COUNT = 6


class LaneTables(NamedTuple):
    """Tables that all lanes of a group share; or, from `lane_values`, one for each lane, lanes last."""

    flow: Floats
    """(N * 4,) As `cells.CellProblem.cell_flow`."""
    output_row: Floats
    """(N * 4,) As in `cells.CellProblem`."""
    steady_table: Floats
    """((cells + 1) * 2,) Position and velocity of the reference motion of q at every boundary of cells."""
    bound: Floats
    """(N * 3,) Frequency of a block, and contributions of a unit of its envelope to the bounds of |q| and of h^4/384
    |q''''|."""
    series: Floats
    """(TERMS * 2 N,) Coefficients in z of q over a cell, per component of the state at the start of the cell."""
    forcing: Floats
    """(cells * TERMS,) Coefficients in z of the reference motion of q over each cell."""
    unit_impulse: Floats
    """(2 N * TERMS,) Coefficients in z of the change of the state at the end of the cell by a unit of velocity given to
    q at z."""
    response: Floats
    """(TERMS,) Coefficients of q in s, the time in half cells since a unit of velocity was given to it."""
    block_response: Floats
    """(RESPONSE_PARTS * cells + 1, 2 N) (u, u') of every block, row by row a part of a cell later, after a start with
    (0, 1); no rows where `CellProblem.flow_table` has not all cells of a period, or every lane has its own."""
    change_series: Floats
    """(2 * N * FLOW_DEGREE,) Each block's response to a unit velocity over a short time: coefficients from the linear
    one on, and those of the derivative, from the constant on."""
    block: Floats
    """(N * BLOCK_NUMBERS,) Of every block decay, frequency_squared, and both numbers of `CellProblem.unit_impulse`."""
    displacement_scale: Floats
    """(N * 2,) As in `cells.CellProblem`."""
    scalars: Floats
    """(SCALAR_COUNT,) Single numbers; STEP to IMPULSE_FOURTH are their positions."""


class LaneModel(NamedTuple):
    """One oscillator at one forcing frequency."""

    forced: Forced
    """The oscillator for the kernels of a single trajectory."""
    tables: LaneTables
    """Tables for the lockstep kernels."""
    blocks: ImpulseBlocks
    """Blocks for the kernels that verify orbits."""


@njit(cache=True, nogil=True, error_model="numpy")
def _steady_tables(problem: CellProblem) -> tuple[Floats, Floats]:
    """Return `LaneTables.forcing` and `LaneTables.steady_table`."""
    cells, half = problem.cells, 0.5 * problem.step
    forcing = np.empty((cells, TERMS))
    for cell in range(problem.reference_series.shape[0]):
        series, power = problem.reference_series[cell].copy(), 1.0
        for lowest in range(TAYLOR_DEGREE):  # expanded about the middle
            for k in range(TAYLOR_DEGREE - 1, lowest - 1, -1):
                series[k] += 0.5 * series[k + 1]
        for n in range(TERMS):
            forcing[cell, n] = power * series[n]
            power *= 0.5
    for cell in range(cells // 2 if problem.reference_series.shape[0] == 0 else 0):
        real, imag = rotated_entry(problem.steady_table, cell, problem.omega * half)
        for n in range(TERMS):
            forcing[cell, n] = imag
            forcing[cell + cells // 2, n] = -imag  # an exact mirror image, as in the table of the steady motion
            scale = problem.omega * half / (n + 1)
            real, imag = -scale * imag, scale * real
    steady_table = np.empty((cells + 1, 2))
    for cell in range(cells + 1):
        steady_table[cell, 0], steady_table[cell, 1] = (
            problem.steady_table[cell, 1],
            problem.omega * problem.steady_table[cell, 0],
        )
    return forcing.reshape(-1), steady_table.reshape(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def _block_response(problem: CellProblem) -> Floats:
    """Return `LaneTables.block_response`."""
    rows = RESPONSE_PARTS * problem.cells + 1 if problem.flow_table.shape[0] > problem.cells else 0
    table = np.empty((rows, 2 * problem.decay.shape[0]))
    for j in range(problem.decay.shape[0]):
        decay, square = problem.decay[j], problem.frequency_squared[j]
        e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, problem.step / RESPONSE_PARTS)
        first, second = 0.0, 1.0
        for row in range(rows):
            table[row, 2 * j], table[row, 2 * j + 1] = first, second
            first, second = e11 * first + e12 * second, e21 * first + e22 * second
    return table


@njit(cache=True, nogil=True, error_model="numpy")
def _change_series(problem: CellProblem) -> Floats:
    """Return `LaneTables.change_series`: y'' = -frequency_squared y - 2 decay y' from y = 0, y' = 1."""
    blocks = problem.decay.shape[0]
    series = np.empty((2, blocks, FLOW_DEGREE))
    for j in range(blocks):
        before, term = 0.0, 1.0
        for power in range(1, FLOW_DEGREE + 1):
            series[0, j, power - 1], series[1, j, power - 1] = term, power * term
            following = -(2.0 * problem.decay[j] * power * term + problem.frequency_squared[j] * before)
            before, term = term, following / (power * (power + 1.0))
    return series.reshape(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def lane_tables(forced: Forced) -> LaneTables:
    """Return the tables of an oscillator at one forcing frequency."""
    problem = forced.free
    blocks = problem.decay.shape[0]
    half = 0.5 * problem.step
    quartic = problem.step**4 / HERMITE_DIVISOR
    series = np.empty((TERMS, 2 * blocks))
    unit_impulse = np.empty((2 * blocks, TERMS))
    response = np.zeros(TERMS)
    bound, block = np.empty((blocks, 3)), np.empty((blocks, BLOCK_NUMBERS))
    impulse_reach, impulse_fourth = 0.0, 0.0
    for j in range(blocks):
        decay, square = problem.decay[j], problem.frequency_squared[j]
        e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, half)
        first, second = problem.output_row[j, 0], problem.output_row[j, 1]
        row_first, row_second = first * e11 + second * e21, first * e12 + second * e22
        first, second = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        at_first, at_second = e11 * first + e12 * second, e21 * first + e22 * second
        for n in range(TERMS):
            series[n, 2 * j], series[n, 2 * j + 1] = row_first, row_second
            unit_impulse[2 * j, n], unit_impulse[2 * j + 1, n] = at_first, at_second
            scale = half / (n + 1)
            row_first, row_second = -scale * square * row_second, scale * (row_first - 2.0 * decay * row_second)
            at_first, at_second = -scale * at_second, scale * (square * at_first + 2.0 * decay * at_second)
        at_first, at_second = unit_impulse[2 * j, 0], unit_impulse[2 * j + 1, 0]
        for n in range(TERMS):
            response[n] += problem.output_row[j, 0] * at_first + problem.output_row[j, 1] * at_second
            scale = half / (n + 1)
            at_first, at_second = scale * at_second, -scale * (square * at_first + 2.0 * decay * at_second)
        envelope = problem.frequency[j] * abs(problem.unit_impulse[j, 0]) + abs(problem.unit_impulse[j, 1])
        bound[j, 0] = problem.frequency[j]
        bound[j, 1] = problem.reach[j]
        bound[j, 2] = problem.fourth[j] * quartic
        block[j, 0], block[j, 1] = decay, square
        block[j, 2], block[j, 3] = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        impulse_reach += bound[j, 1] * envelope
        impulse_fourth += bound[j, 2] * envelope
    # so far about half a cell after the impulse, where TERMS suffice for a whole cell; now about the impulse itself
    for i in range(TERMS - 1):
        for n in range(TERMS - 2, i - 1, -1):
            response[n] -= response[n + 1]
    forcing, steady_table = _steady_tables(problem)
    of_steady = problem.steady_bound, problem.steady_fourth * quartic
    scalars = np.array(
        [problem.step, forced.held.viscous_term, of_steady[0], of_steady[1], impulse_reach, impulse_fourth]
    )
    return LaneTables(
        problem.cell_flow.copy().reshape(-1),
        problem.output_row.copy().reshape(-1),
        steady_table,
        bound.reshape(-1),
        series.reshape(-1),
        forcing,
        unit_impulse.reshape(-1),
        response,
        _block_response(problem),
        _change_series(problem),
        block.reshape(-1),
        problem.displacement_scale.copy().reshape(-1),
        scalars,
    )
