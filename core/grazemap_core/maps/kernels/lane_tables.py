"""What the lockstep kernels read of one oscillator at one forcing frequency: polynomials over a cell.

Within a cell everything is a polynomial in z, which runs from -1 to 1: x1 of the state at the start of the cell, and
what a kick of mass 1 at z amounts to at the cell's end. Expanded about the middle of the cell, LANE_DEGREE suffices
for round-off: the next term is below (CELL_REACH / 2)^15 / 15! = 2e-17 of a block's amplitude.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.sticking_flow import rotated_entry
from grazemap_core.contact.tolerances import CONTACT_ROUNDING
from grazemap_core.maps.tolerances import LANE_DEGREE
from grazemap_core.model.kernels.block_flow import block_flow

TERMS = LANE_DEGREE + 1
assert TERMS == 15, "lanes and bounces are written out for 15 terms"

# entries of `scalars`
STEP, RESTITUTION, DRAG, STEADY, STEADY_FOURTH, KICK_REACH, KICK_FOURTH, MARGIN = 0, 1, 2, 3, 4, 5, 6, 7
"""Length of a cell; R; C_11/m_1; |G|; h^4/384 |G| omega^4; what a unit of velocity given to mass 1 adds to the bounds
of |x1| and of h^4/384 |x1''''|; and the round-off of a gap relative to the sum of its terms."""
SCALARS = 8


class LaneTables(NamedTuple):
    """Attributes: all shared by the lanes of a group.

    flow, output_row : (N, 4)
        As in `cells.CellProblem`.
    steady_table : (cells + 1, 2)
        Steady motion of mass 1 at the cell boundaries: position and velocity.
    bound : (N, 3)
        Frequency of a block; and what a unit of its envelope adds to the bounds of |x1| and of h^4/384 |x1''''|.
    series : (TERMS, 2 N)
        Coefficients in z of x1 over a cell, per component of the state at the start of the cell.
    forcing : (cells, TERMS)
        The same of the steady motion.
    unit_impulse : (2 N, TERMS)
        Coefficients in z of the state at the end of the cell that a unit of velocity given to mass 1 at z amounts to.
    response : (TERMS,)
        Coefficients in s, half cells since a unit of velocity was given to mass 1, of x1.
    scalars : (SCALARS,)
    """

    flow: Floats
    output_row: Floats
    steady_table: Floats
    bound: Floats
    series: Floats
    forcing: Floats
    unit_impulse: Floats
    response: Floats
    scalars: Floats


@njit(cache=True, nogil=True, error_model="numpy")
def lane_tables(problem: CellProblem, viscous_term: float) -> LaneTables:
    """Return the tables of an oscillator at one forcing frequency; `viscous_term` is C_11/m_1."""
    blocks, cells = problem.decay.shape[0], problem.cells
    half = 0.5 * problem.step
    quartic = problem.step**4 / 384.0
    series = np.empty((TERMS, 2 * blocks))
    unit_impulse = np.empty((2 * blocks, TERMS))
    response = np.zeros(TERMS)
    bound = np.empty((blocks, 3))
    kick_reach, kick_fourth = 0.0, 0.0
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
        kick_reach += bound[j, 1] * envelope
        kick_fourth += bound[j, 2] * envelope
    # expanded half a cell behind the kick, where TERMS suffice up to a whole one; then about the kick itself
    for i in range(TERMS - 1):
        for n in range(TERMS - 2, i - 1, -1):
            response[n] -= response[n + 1]
    forcing = np.empty((cells, TERMS))
    for cell in range(cells // 2):
        real, imag = rotated_entry(problem.steady_table, cell, problem.omega * half)
        for n in range(TERMS):
            forcing[cell, n] = imag
            forcing[cell + cells // 2, n] = -imag  # mirrored exactly, as the table of the steady motion
            scale = problem.omega * half / (n + 1)
            real, imag = -scale * imag, scale * real
    steady_table = np.empty((cells + 1, 2))
    for cell in range(cells + 1):
        steady_table[cell, 0], steady_table[cell, 1] = (
            problem.steady_table[cell, 1],
            problem.omega * problem.steady_table[cell, 0],
        )
    scalars = np.empty(SCALARS)
    scalars[STEP] = problem.step
    scalars[RESTITUTION] = problem.restitution
    scalars[DRAG] = viscous_term
    scalars[STEADY] = problem.steady_bound
    scalars[STEADY_FOURTH] = problem.steady_bound * problem.omega**4 * quartic
    scalars[KICK_REACH] = kick_reach
    scalars[KICK_FOURTH] = kick_fourth
    scalars[MARGIN] = CONTACT_ROUNDING
    return LaneTables(
        problem.cell_flow, problem.output_row, steady_table, bound, series, forcing, unit_impulse, response, scalars
    )
