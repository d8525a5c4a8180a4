"""Floquet multipliers of a periodic motion with impacts: the product of flows and saltation matrices.

A motion's phases, speeds and states before its impacts flow in; out flow the matrix in balanced block coordinates and
its eigenvalues. A change z of a state just before an impact of speed v becomes

    z - (1 + R) (k z_v + T k z_x - (a/v) k z_x)

behind it, with k the kick, T the blocks' generator, a the acceleration before the impact and z_x, z_v what the change
is in displacement and velocity of mass 1.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.eigenvalues import OK, eigenvalues
from grazemap_core.orbits.kernels.equations import OrbitProblem


@kernel
def block_scale(problem: OrbitProblem, j: int) -> float:
    """Return the length of a block's coordinates in which kick and readout are alike in size."""
    size = math.hypot(problem.frequency[j] * problem.unit_impulse[j, 0], problem.unit_impulse[j, 1])
    return math.sqrt(size) if size > 0.0 else 1.0


@kernel
def monodromy_matrix(problem: OrbitProblem, phases: Floats, speeds: Floats, before: Floats, matrix: Floats) -> None:
    """Write what a change before the first impact is a span later, mirrored where `sign` is -1, into matrix (2N, 2N).

    Block j has the coordinates (frequency y, y')/scale.
    """
    blocks = problem.decay.shape[0]
    count = phases.shape[0]
    size = 2 * blocks
    for row in range(size):
        for column in range(size):
            matrix[row, column] = problem.sign if row == column else 0.0
    for i in range(count):
        end = phases[0] + problem.turn if i == count - 1 else phases[i + 1]
        time = (end - phases[i]) / problem.omega
        pull = problem.omega * before[i, 2] / speeds[i]
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
                factor = problem.rebound * (rate - pull * place)
                drift = problem.rebound * place
                y = matrix[2 * j, column] - frequency / scale * (factor * first + drift * second)
                v = matrix[2 * j + 1, column] - (factor * second - drift * (square * first + twice * second)) / scale
                e11, e12, e21, e22 = block_flow(problem.decay[j], problem.discriminant[j], square, time)
                matrix[2 * j, column] = e11 * y + e12 * frequency * v
                matrix[2 * j + 1, column] = e21 / frequency * y + e22 * v


@kernel
def orbit_multipliers(
    problem: OrbitProblem,
    phases: Floats,
    speeds: Floats,
    before: Floats,
    matrix: Floats,
    real: Floats,
    imaginary: Floats,
) -> bool:
    """Write the eigenvalues into real (2N,) and imaginary (2N,); NaN, and False, where one is beyond all numbers."""
    monodromy_matrix(problem, phases, speeds, before, matrix)
    if eigenvalues(matrix, real, imaginary) == OK:
        return True
    for i in range(real.shape[0]):
        real[i], imaginary[i] = math.nan, math.nan
    return False
