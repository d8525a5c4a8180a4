"""Construction of the arrays that describe an oscillator while mass 1 rests on a stop."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.model.harmonic_response import held_response
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import resonant_modes
from grazemap_core.model.tolerances import HELD_RESONANT_GAIN


@dataclass(frozen=True, eq=False)
class HeldModel:
    """The modal models with mass 1 free and with mass 1 at rest, for every forcing frequency.

    Attributes
    ----------
    oscillator : Oscillator
    free : ModalModel
        Modal model of the whole chain.
    held : ModalModel or None
        Modal model of masses 2 .. N with link 1 to a wall; None for one mass, and if it is ill-conditioned.
    """

    oscillator: Oscillator
    free: ModalModel
    held: ModalModel | None


def held_problem(model: HeldModel, free_steady: Complexes, omega: float, cells: int, phase: float) -> HeldProblem:
    """Return the arrays of the kernels for a resting mass 1 at one forcing frequency.

    Parameters
    ----------
    model : HeldModel
    free_steady : complex, shape (2, N)
        That of the whole chain, from `reference_response`.
    omega, phase : float
        Forcing frequency, and forcing phase at t = 0.
    cells : int
        Per forcing period.
    """
    oscillator = model.oscillator
    count = oscillator.size - 1
    m1, k1, c1 = oscillator.masses[0], oscillator.stiffnesses[0], oscillator.link_damping[0]
    compliance = 1.0 / oscillator.stiffnesses
    # the springs are in series, so the force is the same in all links
    profile = np.cumsum(compliance[::-1])[::-1][1:] / np.sum(compliance)
    steady = np.zeros(count, dtype=np.complex128)
    exists = model.held is not None or count == 0  # otherwise the motion has no accurate closed form
    if model.held is not None:
        chain = oscillator.held_chain
        assert chain is not None
        response, found = held_response(chain, oscillator.forcing[1:].copy(), np.array([omega]))
        steady = response[0]
        exists = bool(found[0]) and not bool(np.any(resonant_modes(model.held, omega, HELD_RESONANT_GAIN)))
    phase_factors = _phase_factors(cells, phase)
    blocks = model.held
    output_row = np.zeros((count, 4))
    if blocks is not None:
        a, b = blocks.shape[0, :, 0], blocks.shape[0, :, 1]
        # x_2, v_2 and the acceleration of mass 2 in (u, u')
        position, velocity = np.stack([a, b]), np.stack([-b * blocks.frequency_squared, a - 2.0 * blocks.decay * b])
        square, twice = blocks.frequency_squared, 2.0 * blocks.decay
        first = (k1 * position + c1 * velocity) / m1
        output_row = np.stack([first[0], first[1], -first[1] * square, first[0] - twice * first[1]], axis=1)
    empty = np.zeros(count)
    square_empty = np.zeros((2 * count, 2 * count))
    return HeldProblem(
        decay=empty if blocks is None else np.ascontiguousarray(blocks.decay),
        discriminant=empty if blocks is None else np.ascontiguousarray(blocks.discriminant),
        frequency_squared=empty if blocks is None else np.ascontiguousarray(blocks.frequency_squared),
        output_row=np.ascontiguousarray(output_row),
        steady_table=real_and_imaginary(_harmonic_acceleration(oscillator, steady, omega, exists) * phase_factors),
        static_acceleration=float(1.0 / np.sum(compliance) / m1),
        viscous_term=float(c1 / m1),
        profile=np.ascontiguousarray(profile),
        phase_factors=real_and_imaginary(phase_factors),
        steady=real_and_imaginary(steady),
        free_steady=real_and_imaginary(free_steady.ravel()),
        to_blocks=square_empty if blocks is None else np.ascontiguousarray(blocks.to_modal),
        from_blocks=square_empty if blocks is None else np.ascontiguousarray(blocks.from_modal),
        to_free=np.ascontiguousarray(model.free.to_modal),
        from_free=np.ascontiguousarray(model.free.from_modal),
        exists=exists,
        state=np.zeros((count, 2)),
        since=np.zeros(2),
        physical=np.zeros(2 * count + 2),
    )


def held_at_phase(held: HeldProblem, model: HeldModel, omega: float, cells: int, phase: float) -> HeldProblem:
    """Return the arrays for another forcing phase at t = 0; mass 1 does not rest."""
    phase_factors = _phase_factors(cells, phase)
    steady = held.steady[:, 0] + 1j * held.steady[:, 1]
    return held._replace(
        phase_factors=real_and_imaginary(phase_factors),
        steady_table=real_and_imaginary(
            _harmonic_acceleration(model.oscillator, steady, omega, held.exists) * phase_factors
        ),
        state=np.zeros_like(held.state),
        since=np.zeros_like(held.since),
        physical=np.zeros_like(held.physical),
    )


def _harmonic_acceleration(oscillator: Oscillator, steady: Complexes, omega: float, exists: bool) -> complex:
    """Return the harmonic part of the acceleration of a resting mass 1 if it were released, at phase 0.

    `steady` is the steady motion of masses 2 .. N, shape (N - 1,).
    """
    m1, k1, c1 = oscillator.masses[0], oscillator.stiffnesses[0], oscillator.link_damping[0]
    if exists and len(steady) > 0:
        return complex((oscillator.forcing[0] + (k1 + 1j * omega * c1) * steady[0]) / m1)
    return complex(oscillator.forcing[0] / m1)


def _phase_factors(cells: int, phase: float) -> Complexes:
    """Return exp(i phase) at the boundaries of the cells, shape (cells + 1,)."""
    return whole_period(np.exp(1j * phase) * half_period_phases(cells))


def half_period_phases(cells: int) -> Complexes:
    """Return exp(2 pi i k / cells) for 0 <= k < cells/2, with an error of one or two roundings.

    Sines and cosines are computed at angles of at most pi/4.
    """
    k = np.arange(cells // 2)
    back = 4 * k > cells
    k = np.where(back, cells // 2 - k, k)
    steep = 8 * k > cells
    angle = np.where(steep, cells - 4 * k, 4 * k) * (math.pi / (2 * cells))
    c, s = np.cos(angle), np.sin(angle)
    return np.where(back, -1.0, 1.0) * np.where(steep, s, c) + 1j * np.where(steep, c, s)


def whole_period(half: Complexes) -> Complexes:
    """Return a table over the cells of a period from that over half of it, shape (cells + 1,).

    The second half mirrors the first exactly, so that symmetric motions are symmetric to the last bit.
    """
    return np.concatenate([half, -half, half[:1]])


def real_and_imaginary(values: Complexes) -> Floats:
    """Return complex numbers as an array of (real, imaginary), shape (n, 2)."""
    return np.ascontiguousarray(np.stack([values.real, values.imag], axis=1))
