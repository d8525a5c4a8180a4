"""The structure while the contact rests on a stop: its state, and the contact acceleration.

The contact coordinate is a constraint, q = stop * gap, so the structure has n = N - 1 degrees of freedom. It moves in
closed form: y = q profile + steady motion + blocks, with y the displacements from the static equilibrium. A held state
is the pair (u, u') of every block of the constrained structure. The contact acceleration, which q would have toward the
stop without the stop, is a sum of the same blocks and has a Taylor series in every cell.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.runs import HeldRun
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.records import NamedTuple


class HeldProblem(NamedTuple):
    """One oscillator at one forcing frequency, the contact at rest on a stop; forces with H harmonics."""

    decay: Floats
    """(n,) Of the blocks of the constrained structure."""
    discriminant: Floats
    """(n,) Of the blocks of the constrained structure."""
    frequency_squared: Floats
    """(n,) Of the blocks of the constrained structure."""
    output_row: Floats
    """(n, 4) Acceleration of q at rest, sum r0 u + r1 u', and its rate, sum r2 u + r3 u'."""
    orders: Floats
    """(H,) Orders of the harmonics."""
    steady_table: Floats
    """(H, cells + 1, 2) Acceleration of q at rest by each harmonic, as (real, imaginary) at the cell boundaries; it is
    the imaginary part."""
    static_acceleration: float
    """Static part of the acceleration of q at rest per unit of the gap, away from the stop."""
    viscous_term: float
    """h^T M^-1 C a, with a the direction of the jump: the rate at which damping alone slows q after an impulse."""
    profile: Floats
    """(N,) Displacements at the equilibrium with q held, per unit of q."""
    phase_factors: Floats
    """(H, cells + 1, 2) exp(i order phase) at the cell boundaries."""
    steady: Floats
    """(H, N, 2) Amplitudes of the displacements of the steady motion with q held at 0. The displacement is the
    imaginary part of amplitude times exp(i order phase)."""
    free_steady: Floats
    """(H, 2 N, 2) Amplitudes of the steady motion with q free, without resonant modes: those of the displacements, then
    those of the velocities divided by i order omega."""
    to_blocks: Floats
    """(2 n, 2 N) From displacements and velocities, of which a motion of q is taken away in the direction of the jump,
    to the blocks of the constrained structure."""
    from_blocks: Floats
    """(2 N, 2 n) The reverse of `to_blocks`."""
    to_free: Floats
    """(2 N, 2 N) From displacements and velocities to the blocks of the free structure."""
    from_free: Floats
    """(2 N, 2 N) The reverse of `to_free`."""
    exists: bool
    """False if the constrained structure has no accurate closed form: an undamped resonance with the forcing, or two
    blocks that are nearly defective together."""
    omega: float
    """Forcing frequency."""


@kernel
def rotated_entry(table: Floats, cell: int, angle: float) -> tuple[float, float]:
    """Return an entry of a table of complex numbers, rotated by an angle, as (real, imaginary)."""
    c, s = math.cos(angle), math.sin(angle)
    re, im = table[cell, 0], table[cell, 1]
    return re * c - im * s, im * c + re * s


@kernel
def turn_to(held: HeldProblem, run: HeldRun, cell: int, angle: float) -> None:
    """Write exp(i order phase) of the harmonics into run.turn; `angle` is the phase since the start of the cell."""
    for h in range(held.orders.shape[0]):
        run.turn[h, 0], run.turn[h, 1] = rotated_entry(held.phase_factors[h], cell, held.orders[h] * angle)


@kernel
def held_motion(held: HeldProblem, run: HeldRun, place: float) -> None:
    """Write displacements, then velocities, from the static equilibrium to run.physical.

    Parameters
    ----------
    run : HeldRun
        Its `turn` is that of the moment.
    place : float
        The contact coordinate: stop * gap.
    """
    count, state = held.profile.shape[0], run.state
    for i in range(count):
        x, v = place * held.profile[i], 0.0
        for h in range(held.orders.shape[0]):
            cosine, sine = run.turn[h, 0], run.turn[h, 1]
            real, imag = held.steady[h, i, 0], held.steady[h, i, 1]
            x += imag * cosine
            x += real * sine
            v += held.orders[h] * held.omega * (real * cosine - imag * sine)
        for j in range(state.shape[0]):
            for k in range(2):
                x += held.from_blocks[i, 2 * j + k] * state[j, k]
                v += held.from_blocks[count + i, 2 * j + k] * state[j, k]
        run.physical[i] = x
        run.physical[count + i] = v


@kernel
def held_from_free(held: HeldProblem, run: HeldRun, u: Floats, place: float) -> None:
    """Write the held state in the free state u (N, 2) into run.state. Other parameters as `held_motion`.

    What the free state has of q - place and of q' is taken away in the direction of the jump.
    """
    count, blocks = u.shape[0], run.state.shape[0]
    for i in range(count):
        x, v = 0.0, 0.0
        for h in range(held.orders.shape[0]):
            cosine, sine = run.turn[h, 0], run.turn[h, 1]
            frequency = held.orders[h] * held.omega
            x += held.free_steady[h, i, 1] * cosine + held.free_steady[h, i, 0] * sine
            x -= held.steady[h, i, 1] * cosine + held.steady[h, i, 0] * sine
            v += frequency * (held.free_steady[h, count + i, 0] * cosine - held.free_steady[h, count + i, 1] * sine)
            v -= frequency * (held.steady[h, i, 0] * cosine - held.steady[h, i, 1] * sine)
        x -= place * held.profile[i]
        for j in range(count):
            for k in range(2):
                x += held.from_free[i, 2 * j + k] * u[j, k]
                v += held.from_free[count + i, 2 * j + k] * u[j, k]
        run.physical[i] = x
        run.physical[count + i] = v
    for j in range(blocks):
        for k in range(2):
            value = 0.0
            for i in range(2 * count):
                value += held.to_blocks[2 * j + k, i] * run.physical[i]
            run.state[j, k] = value


@kernel
def free_from_held(held: HeldProblem, run: HeldRun, place: float, u: Floats) -> None:
    """Write the free state that corresponds to run.state into u (N, 2). Other parameters as `held_motion`."""
    count = u.shape[0]
    held_motion(held, run, place)
    for i in range(count):
        for h in range(held.orders.shape[0]):
            cosine, sine = run.turn[h, 0], run.turn[h, 1]
            steady = held.free_steady[h]
            run.physical[i] -= steady[i, 1] * cosine + steady[i, 0] * sine
            run.physical[count + i] -= (
                held.orders[h] * held.omega * (steady[count + i, 0] * cosine - steady[count + i, 1] * sine)
            )
    for j in range(count):
        for k in range(2):
            value = 0.0
            for i in range(2 * count):
                value += held.to_free[2 * j + k, i] * run.physical[i]
            u[j, k] = value
