"""What the lockstep kernels read of one oscillator at one forcing frequency: polynomials over a cell.

Within a cell everything is a polynomial in z, which runs from -1 to 1: x1 of the state at the start of the cell, and
what a kick of mass 1 at z amounts to at the cell's end. Expanded about the middle of the cell, LANE_DEGREE suffices
for round-off: the next term is below (CELL_REACH / 2)^15 / 15! = 2e-17 of a block's amplitude.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels.block_flow import block_flow
from grazemap_core.kernels.cells import CellProblem
from grazemap_core.kernels.held import turned
from grazemap_core.tolerances import CONTACT_ROUNDING, LANE_DEGREE

FloatArray = NDArray[np.float64]

TERMS = LANE_DEGREE + 1
assert TERMS == 15, "lanes and bounces are written out for 15 terms"

# entries of `scalars`
STEP, RESTITUTION, DRAG, STEADY, STEADY_FOURTH, KICK_REACH, KICK_FOURTH, MARGIN = 0, 1, 2, 3, 4, 5, 6, 7
"""Length of a cell; R; C_11/m_1; |G|; h^4/384 |G| omega^4; what a unit of velocity given to mass 1 adds to the bounds
of |x1| and of h^4/384 |x1''''|; and the round-off of a gap relative to the sum of its terms."""
SCALARS = 8


class LaneTables(NamedTuple):
    """Attributes: all shared by the lanes of a group.

    flow, readout : (N, 4)
        As in `cells.CellProblem`.
    gain : (cells + 1, 2)
        Steady motion of mass 1 at the cell boundaries: position and velocity.
    bound : (N, 3)
        Frequency of a block; and what a unit of its envelope adds to the bounds of |x1| and of h^4/384 |x1''''|.
    series : (TERMS, 2 N)
        Coefficients in z of x1 over a cell, per component of the state at the start of the cell.
    forcing : (cells, TERMS)
        The same of the steady motion.
    kick : (2 N, TERMS)
        Coefficients in z of the state at the end of the cell that a unit of velocity given to mass 1 at z amounts to.
    response : (TERMS,)
        Coefficients in s, half cells since a unit of velocity was given to mass 1, of x1.
    scalars : (SCALARS,)
    """

    flow: FloatArray
    readout: FloatArray
    gain: FloatArray
    bound: FloatArray
    series: FloatArray
    forcing: FloatArray
    kick: FloatArray
    response: FloatArray
    scalars: FloatArray


@njit(cache=True, nogil=True, error_model="numpy")
def lane_tables(problem: CellProblem, drag: float) -> LaneTables:
    """Return the tables of an oscillator at one forcing frequency; `drag` is C_11/m_1."""
    blocks, cells = problem.decay.shape[0], problem.cells
    half = 0.5 * problem.step
    quartic = problem.step**4 / 384.0
    series = np.empty((TERMS, 2 * blocks))
    kick = np.empty((2 * blocks, TERMS))
    response = np.zeros(TERMS)
    bound = np.empty((blocks, 3))
    kick_reach, kick_fourth = 0.0, 0.0
    for j in range(blocks):
        decay, square = problem.decay[j], problem.frequency_squared[j]
        e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, half)
        first, second = problem.readout[j, 0], problem.readout[j, 1]
        row_first, row_second = first * e11 + second * e21, first * e12 + second * e22
        first, second = problem.kick[j, 0], problem.kick[j, 1]
        at_first, at_second = e11 * first + e12 * second, e21 * first + e22 * second
        for n in range(TERMS):
            series[n, 2 * j], series[n, 2 * j + 1] = row_first, row_second
            kick[2 * j, n], kick[2 * j + 1, n] = at_first, at_second
            scale = half / (n + 1)
            row_first, row_second = -scale * square * row_second, scale * (row_first - 2.0 * decay * row_second)
            at_first, at_second = -scale * at_second, scale * (square * at_first + 2.0 * decay * at_second)
        at_first, at_second = kick[2 * j, 0], kick[2 * j + 1, 0]
        for n in range(TERMS):
            response[n] += problem.readout[j, 0] * at_first + problem.readout[j, 1] * at_second
            scale = half / (n + 1)
            at_first, at_second = scale * at_second, -scale * (square * at_first + 2.0 * decay * at_second)
        envelope = problem.frequency[j] * abs(problem.kick[j, 0]) + abs(problem.kick[j, 1])
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
        real, imag = turned(problem.gain, cell, problem.omega * half)
        for n in range(TERMS):
            forcing[cell, n] = imag
            forcing[cell + cells // 2, n] = -imag  # mirrored exactly, as the table of the steady motion
            scale = problem.omega * half / (n + 1)
            real, imag = -scale * imag, scale * real
    gain = np.empty((cells + 1, 2))
    for cell in range(cells + 1):
        gain[cell, 0], gain[cell, 1] = problem.gain[cell, 1], problem.omega * problem.gain[cell, 0]
    scalars = np.empty(SCALARS)
    scalars[STEP] = problem.step
    scalars[RESTITUTION] = problem.restitution
    scalars[DRAG] = drag
    scalars[STEADY] = problem.steady_bound
    scalars[STEADY_FOURTH] = problem.steady_bound * problem.omega**4 * quartic
    scalars[KICK_REACH] = kick_reach
    scalars[KICK_FOURTH] = kick_fourth
    scalars[MARGIN] = CONTACT_ROUNDING
    return LaneTables(problem.cell_flow, problem.readout, gain, bound, series, forcing, kick, response, scalars)
