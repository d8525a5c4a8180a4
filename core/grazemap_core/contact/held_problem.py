"""Construction of the arrays that describe an oscillator while its contact rests on a stop."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.model.held_structure import HeldStructure
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import resonant_modes
from grazemap_core.model.tolerances import HELD_RESONANT_GAIN
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class HeldModel:
    """The modal models with the contact free and with the contact at rest, for every forcing frequency."""

    oscillator: Oscillator
    """The structure, its forces and its contact."""
    free: ModalModel
    """Modal model of the whole structure."""
    constrained: HeldStructure
    """The structure with the contact held."""
    held: ModalModel | None
    """Modal model of `constrained`; None for one degree of freedom, and if it has no accurate one."""

    @cached_property
    def orders(self) -> Floats:
        """Orders of the harmonics of the forces, (H,), as the kernels take them."""
        return np.array([float(harmonic.order) for harmonic in self.oscillator.forces])

    @cached_property
    def fixed_arrays(self) -> dict[str, Any]:
        """The fields of `HeldProblem` that depend neither on the forcing frequency nor on its phase."""
        oscillator, constrained, blocks = self.oscillator, self.constrained, self.held
        size, count = oscillator.size, oscillator.size - 1
        output_row, empty = np.zeros((count, 4)), np.zeros(count)
        to_blocks, from_blocks = np.zeros((2 * count, 2 * size)), np.zeros((2 * size, 2 * count))
        if blocks is not None:
            output_row = _output_row(self, blocks)
            # a motion of q is taken away in the direction of the jump
            aside = np.eye(size)[constrained.others] - np.outer(oscillator.jump[constrained.others], oscillator.contact)
            for half in (0, 1):
                rows, columns = slice(half * count, (half + 1) * count), slice(half * size, (half + 1) * size)
                to_blocks[:, columns] = blocks.to_modal[:, rows] @ aside
                from_blocks[columns] = constrained.basis @ blocks.from_modal[rows]
        return {
            "decay": empty if blocks is None else np.ascontiguousarray(blocks.decay),
            "discriminant": empty if blocks is None else np.ascontiguousarray(blocks.discriminant),
            "frequency_squared": empty if blocks is None else np.ascontiguousarray(blocks.frequency_squared),
            "output_row": np.ascontiguousarray(output_row),
            "orders": self.orders,
            "static_acceleration": constrained.static_stiffness / oscillator.effective_mass,
            "viscous_term": constrained.viscous_term,
            "profile": np.ascontiguousarray(constrained.profile),
            "to_blocks": to_blocks,
            "from_blocks": from_blocks,
            "to_free": np.ascontiguousarray(self.free.to_modal),
            "from_free": np.ascontiguousarray(self.free.from_modal),
        }


def held_problem(
    model: HeldModel,
    free_steady: Complexes,
    steady: tuple[Complexes, bool],
    omega: float,
    cells: int,
    phase: float,
) -> HeldProblem:
    """Return the arrays of the kernels for a resting contact at one forcing frequency.

    Parameters
    ----------
    free_steady : complex, shape (H, 2, N + 1)
        Steady motion of the whole structure, from `reference_response`.
    steady : (H, N - 1), and a truth value
        From `held_steady`.
    omega, phase : float
        Forcing frequency, and forcing phase at t = 0.
    cells : int
        Per forcing period.
    """
    size, (amplitudes, exists) = model.oscillator.size, steady
    factors = _phase_factors(model.oscillator, cells, phase)
    acceleration = _harmonic_acceleration(model, amplitudes, omega, exists)
    return HeldProblem(
        **model.fixed_arrays,
        steady_table=real_and_imaginary(acceleration[:, None] * factors),
        phase_factors=real_and_imaginary(factors),
        steady=real_and_imaginary(amplitudes @ model.constrained.basis.T),
        free_steady=real_and_imaginary(free_steady[:, :, :size].reshape(len(free_steady), -1)),
        exists=exists,
        omega=float(omega),
    )


def held_steady(model: HeldModel, omega: float) -> tuple[Complexes, bool]:
    """Return the steady amplitudes of the constrained structure by harmonic, (H, N - 1), and whether they exist."""
    constrained, blocks, count = model.constrained, model.held, model.oscillator.size - 1
    steady, exists = np.zeros((len(model.oscillator.forces), count), dtype=np.complex128), True
    if blocks is None:  # without a motion to compute, or without an accurate closed form of it
        return steady, count == 0
    assert constrained.structure is not None
    row = constrained.stiffness_row if np.any(constrained.stiffness_row) else np.ones(blocks.size)
    for h, harmonic in enumerate(model.oscillator.forces):
        on_basis = harmonic.amplitudes(np.array([omega]))[0][None] @ constrained.basis
        if np.any(on_basis):
            response = constrained.structure.response(np.array([harmonic.order * omega]), on_basis, row)
            steady[h] = response.amplitudes[0]
            resonant = resonant_modes(blocks, np.array([omega]), harmonic.order, HELD_RESONANT_GAIN)
            exists = exists and bool(response.exists[0]) and not bool(np.any(resonant))
    return steady, exists


def _output_row(model: HeldModel, blocks: ModalModel) -> Floats:
    """Return `HeldProblem.output_row`."""
    constrained, square, twice = model.constrained, blocks.frequency_squared, 2.0 * blocks.decay
    a, b = blocks.shape[:, :, 0], blocks.shape[:, :, 1]
    rates = np.stack([-b * square, a - twice * b], axis=2)  # velocities in (u, u')
    forces = np.einsum("i,ijk->kj", constrained.stiffness_row, blocks.shape)
    forces = forces + np.einsum("i,ijk->kj", constrained.damping_row, rates)
    first = -forces / model.oscillator.effective_mass
    return np.stack([first[0], first[1], -first[1] * square, first[0] - twice * first[1]], axis=1)


def _harmonic_acceleration(model: HeldModel, steady: Complexes, omega: float, exists: bool) -> Complexes:
    """Return the acceleration of a resting contact by each harmonic if it were released, at phase 0, (H,).

    `steady` is the steady motion of the constrained structure, shape (H, N - 1).
    """
    oscillator, constrained = model.oscillator, model.constrained
    result = np.zeros(len(steady), dtype=np.complex128)
    for h, harmonic in enumerate(oscillator.forces):
        force = complex(np.sum(oscillator.jump * harmonic.amplitudes(np.array([omega]))[0]))
        if exists:
            rows = zip(constrained.stiffness_row.tolist(), constrained.damping_row.tolist(), strict=True)
            for (stiff, viscous), amplitude in zip(rows, steady[h].tolist(), strict=True):
                force -= (stiff + 1j * harmonic.order * omega * viscous) * amplitude
        result[h] = force / oscillator.effective_mass
    return result


def _phase_factors(oscillator: Oscillator, cells: int, phase: float) -> Complexes:
    """Return exp(i order phase) of every harmonic at the boundaries of the cells, shape (H, cells + 1)."""
    orders = [harmonic.order for harmonic in oscillator.forces]
    return np.stack([whole_period(np.exp(1j * (k * phase)) * half_period_phases(cells, k), k) for k in orders])


def whole_period(half: Complexes, order: int = 1) -> Complexes:
    """Return a table of a harmonic over the cells of a period from that over half of it, shape (cells + 1,).

    The second half mirrors or repeats the first exactly, so that symmetric motions are symmetric to the last bit.
    """
    return np.concatenate([half, -half if order % 2 == 1 else half, half[:1]])


@lru_cache(maxsize=16)
def half_period_phases(cells: int, order: int = 1) -> Complexes:
    """Return exp(2 pi i order k / cells) for 0 <= k < cells/2, with an error of one or two roundings; read-only.

    Sines and cosines are computed at angles of at most pi/4.
    """
    k = order * np.arange(cells // 2) % cells
    below = 2 * k >= cells  # the lower half of the circle
    k = np.where(below, k - cells // 2, k)
    back = 4 * k > cells
    k = np.where(back, cells // 2 - k, k)
    steep = 8 * k > cells
    angle = np.where(steep, cells - 4 * k, 4 * k) * (math.pi / (2 * cells))
    c, s = np.cos(angle), np.sin(angle)
    first = np.where(back, -1.0, 1.0) * np.where(steep, s, c) + 1j * np.where(steep, c, s)
    factors = np.where(below, -first, first)
    factors.setflags(write=False)
    return factors


def real_and_imaginary(values: Complexes) -> Floats:
    """Return complex numbers (...) as an array of (real, imaginary), shape (..., 2)."""
    return np.ascontiguousarray(values).view(np.float64).reshape(*values.shape, 2)
