"""The chain while mass 1 rests on a stop: its state, and the contact acceleration of mass 1.

Masses 2 .. N move as a chain linked to a wall, in closed form: x_i = s b profile_i + steady motion + blocks. A held
state is the pair (u, u') of every block of that chain. The contact acceleration, which mass 1 would have toward the
stop without the stop, is a sum of the same blocks and has a Taylor series in every cell.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel


class HeldProblem(NamedTuple):
    """One oscillator at one forcing frequency, mass 1 at rest; N - 1 = n masses move.

    Attributes
    ----------
    decay, discriminant, frequency_squared : (n,)
        The blocks of the held chain.
    output_row : (n, 4)
        Acceleration of mass 1 at rest, sum r0 u + r1 u', and its rate, sum r2 u + r3 u'.
    steady_table : (cells + 1, 2)
        Harmonic acceleration of mass 1 at rest, as (real, imaginary) at the cell boundaries; it is the imaginary part.
    static_acceleration : float
        Static part of the acceleration of mass 1 at rest per unit of clearance, away from the stop; >= 0.
    viscous_term : float
        C_11/m_1.
    profile : (n,)
        Displacement of masses 2 .. N at equilibrium, per unit displacement of mass 1.
    phase_factors : (cells + 1, 2)
        exp(i phase) at the cell boundaries.
    steady, free_steady : (n, 2), (2 N, 2)
        Amplitudes of the steady motion of masses 2 .. N with mass 1 at rest, and of all masses with mass 1 free: of the
        latter those of the displacements, then those of the velocities divided by i omega, without resonant modes. The
        displacement is the imaginary part of amplitude times exp(i phase).
    to_blocks, from_blocks : (2 n, 2 n)
        Conversions between displacements and velocities of masses 2 .. N and the blocks of the held chain.
    to_free, from_free : (2 N, 2 N)
        These conversions for the whole chain.
    exists : bool
        False if the held chain has no accurate closed form: an undamped resonance with the forcing, or two blocks that
        are nearly defective together.
    state : (n, 2)
        The held state while mass 1 rests; changed in place. It is not a part of the workspace, because every array of
        the workspace is an argument of the kernels of a cell, at a measurable cost.
    since : (2,)
        The half period and the time in it at which mass 1 came to rest; changed in place.
    physical : (2 N,)
        Scratch.
    """

    decay: Floats
    discriminant: Floats
    frequency_squared: Floats
    output_row: Floats
    steady_table: Floats
    static_acceleration: float
    viscous_term: float
    profile: Floats
    phase_factors: Floats
    steady: Floats
    free_steady: Floats
    to_blocks: Floats
    from_blocks: Floats
    to_free: Floats
    from_free: Floats
    exists: bool
    state: Floats
    since: Floats
    physical: Floats


@kernel
def rotated_entry(table: Floats, cell: int, angle: float) -> tuple[float, float]:
    """Return an entry of a table of complex numbers, rotated by an angle, as (real, imaginary)."""
    c, s = math.cos(angle), math.sin(angle)
    re, im = table[cell, 0], table[cell, 1]
    return re * c - im * s, im * c + re * s


@kernel
def held_motion(
    problem: HeldProblem,
    held: Floats,
    place: float,
    omega: float,
    cosine: float,
    sine: float,
    physical: Floats,
) -> None:
    """Write the displacements, then the velocities, of all masses to physical (2 N,).

    Parameters
    ----------
    held : (n, 2)
    place : float
        Displacement of mass 1: stop * clearance.
    omega, cosine, sine : float
        Forcing frequency, and exp(i phase) of the forcing.
    """
    rest = held.shape[0]
    count = rest + 1
    physical[0] = place
    physical[count] = 0.0
    for i in range(rest):
        x = place * problem.profile[i] + problem.steady[i, 1] * cosine + problem.steady[i, 0] * sine
        v = omega * (problem.steady[i, 0] * cosine - problem.steady[i, 1] * sine)
        for j in range(rest):
            for k in range(2):
                x += problem.from_blocks[i, 2 * j + k] * held[j, k]
                v += problem.from_blocks[rest + i, 2 * j + k] * held[j, k]
        physical[1 + i] = x
        physical[count + 1 + i] = v


@kernel
def held_from_free(
    problem: HeldProblem,
    u: Floats,
    place: float,
    omega: float,
    cosine: float,
    sine: float,
    physical: Floats,
    held: Floats,
) -> None:
    """Write the held state of masses 2 .. N in the free state u (N, 2) into held (n, 2).

    Other parameters as `held_motion`; physical is scratch.
    """
    count = u.shape[0]
    rest = count - 1
    for i in range(rest):
        x = problem.free_steady[1 + i, 1] * cosine + problem.free_steady[1 + i, 0] * sine
        x -= problem.steady[i, 1] * cosine + problem.steady[i, 0] * sine
        x -= place * problem.profile[i]
        v = omega * (problem.free_steady[count + 1 + i, 0] * cosine - problem.free_steady[count + 1 + i, 1] * sine)
        v -= omega * (problem.steady[i, 0] * cosine - problem.steady[i, 1] * sine)
        for j in range(count):
            for k in range(2):
                x += problem.from_free[1 + i, 2 * j + k] * u[j, k]
                v += problem.from_free[count + 1 + i, 2 * j + k] * u[j, k]
        physical[i] = x
        physical[rest + i] = v
    for j in range(rest):
        for k in range(2):
            value = 0.0
            for i in range(2 * rest):
                value += problem.to_blocks[2 * j + k, i] * physical[i]
            held[j, k] = value


@kernel
def free_from_held(
    problem: HeldProblem,
    held: Floats,
    place: float,
    omega: float,
    cosine: float,
    sine: float,
    physical: Floats,
    u: Floats,
) -> None:
    """Write the free state that corresponds to a held state into u (N, 2). Other parameters as `held_motion`."""
    count = u.shape[0]
    held_motion(problem, held, place, omega, cosine, sine, physical)
    for i in range(count):
        physical[i] -= problem.free_steady[i, 1] * cosine + problem.free_steady[i, 0] * sine
        physical[count + i] -= omega * (
            problem.free_steady[count + i, 0] * cosine - problem.free_steady[count + i, 1] * sine
        )
    for j in range(count):
        for k in range(2):
            value = 0.0
            for i in range(2 * count):
                value += problem.to_free[2 * j + k, i] * physical[i]
            u[j, k] = value
