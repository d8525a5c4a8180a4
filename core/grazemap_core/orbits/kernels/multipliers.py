"""Floquet multipliers of a periodic motion with impacts, from the product of flows and saltation matrices.

The matrix is in balanced block coordinates. A perturbation z of the state just before an impact of velocity v becomes

    z - (1 + R) (k z_v + T k z_x - (a/v) k z_x)

just after it, with k the unit impulse, T the blocks' generator, a the acceleration before the impact, and z_x and z_v
the displacement and velocity of the contact in z.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.eigenvalues import QR_CONVERGED, eigenvalues
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, next_phase, rebound_of


@kernel
def block_scale(problem: OrbitProblem, j: int) -> float:
    """Return the unit of a block's coordinates in which the impulse on it and its effect on q have equal size."""
    size = math.hypot(problem.frequency[j] * problem.unit_impulse[j, 0], problem.unit_impulse[j, 1])
    return math.sqrt(size) if size > 0.0 else 1.0


@kernel
def block_scales(problem: OrbitProblem, scales: Floats) -> None:
    """Write `block_scale` of every block into scales (N,)."""
    for j in range(problem.decay.shape[0]):
        scales[j] = block_scale(problem, j)


@kernel
def monodromy_matrix(problem: OrbitProblem, impacts: OrbitImpacts, before: Floats, matrix: Floats) -> None:
    """Write the Floquet matrix over a span from before the first impact, mirrored for `sign` -1, into matrix (2N, 2N).

    Block j has the coordinates (frequency y, y')/scale.
    """
    blocks = problem.decay.shape[0]
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count = phases.shape[0]
    size = 2 * blocks
    for row in range(size):
        for column in range(size):
            matrix[row, column] = problem.sign if row == column else 0.0
    for i in range(count):
        time = (next_phase(problem, phases, i) - phases[i]) / problem.omega
        rebound, pull = rebound_of(stops, sides[i]), problem.omega * before[i, 2] / speeds[i]
        for column in range(size):
            place, rate = 0.0, 0.0
            for j in range(blocks):
                scale = block_scale(problem, j)
                place += scale / problem.frequency[j] * matrix[2 * j, column]
                rate += scale * matrix[2 * j + 1, column]
            for j in range(blocks):
                scale, frequency = block_scale(problem, j), problem.frequency[j]
                square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
                first, second = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
                factor = rebound * (rate - pull * place)
                drift = rebound * place
                y = matrix[2 * j, column] - frequency / scale * (factor * first + drift * second)
                v = matrix[2 * j + 1, column] - (factor * second - drift * (square * first + twice * second)) / scale
                e11, e12, e21, e22 = block_flow(problem.decay[j], problem.discriminant[j], square, time)
                matrix[2 * j, column] = e11 * y + e12 * frequency * v
                matrix[2 * j + 1, column] = e21 / frequency * y + e22 * v


@kernel
def orbit_multipliers(
    problem: OrbitProblem,
    impacts: OrbitImpacts,
    before: Floats,
    matrix: Floats,
    real: Floats,
    imaginary: Floats,
) -> None:
    """Write the multipliers into real (2N,) and imaginary (2N,); NaN where one overflows."""
    monodromy_matrix(problem, impacts, before, matrix)
    if eigenvalues(matrix, real, imaginary) != QR_CONVERGED:
        for i in range(real.shape[0]):
            real[i], imaginary[i] = math.nan, math.nan
