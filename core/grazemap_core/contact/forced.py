"""A structure under its forces at one frequency, from which the arrays of the trajectory kernels are made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.cell_factors import cell_length, tabulate_flow
from grazemap_core.contact.kernels.cells import CellProblem, Forced, HeldProblem
from grazemap_core.contact.reference_motion import (
    half_period_phases,
    real_and_imaginary,
    reference_motion,
    whole_period,
)
from grazemap_core.contact.tolerances import (
    CELL_REACH,
    MAX_CELLS_PER_PERIOD,
    MAX_TABLED_CELLS,
    MIN_CELLS_PER_PERIOD,
)
from grazemap_core.contact.trajectory_models import TrajectoryModels, free_arrays
from grazemap_core.errors import ParameterError
from grazemap_core.model.harmonic_response import reference_response, resonant_modes
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import HELD_RESONANT_GAIN
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class ForcedStructure:
    """A structure under its forces at one frequency: what all its trajectories share, whatever their stops and start.

    Arrays are computed when they are first asked for, and kept.
    """

    models: TrajectoryModels
    """The modal models with the contact free and at rest, and the oscillator."""
    omega: float
    """Angular frequency of the forces."""
    steady: Complexes
    """(H, 2, N + 1) Amplitudes of the reference motion by harmonic, from `reference_response`."""

    @property
    def oscillator(self) -> Oscillator:
        """The oscillator."""
        return self.models.oscillator

    @property
    def orders(self) -> Floats:
        """Orders of the harmonics of the forces, (H,)."""
        return self.models.orders

    @cached_property
    def cells(self) -> int:
        """Number of cells in a forcing period.

        Raises
        ------
        ParameterError
            The fastest exponent is so much larger than omega that a period would need more than MAX_CELLS_PER_PERIOD.
        """
        models = [self.models.free] if self.models.held is None else [self.models.free, self.models.held]
        return cells_per_period(models, self.omega, int(np.max(self.orders)))

    @cached_property
    def kernels(self) -> Forced:
        """The arrays of the kernels, at phase 0."""
        return self._from_phase(0.0)

    def at_phase(self, phase: float) -> Forced:
        """Return the arrays of the kernels for a forcing phase at t = 0."""
        return self.kernels if phase == 0.0 else self._from_phase(phase)

    def _from_phase(self, phase: float) -> Forced:
        steady, omega, fixed = self.steady, self.omega, self._at_any_phase
        reference = reference_motion(self.models, steady, omega, fixed["step"], self.cells, phase, fixed["output_row"])
        return Forced(CellProblem(**fixed, **reference), self._held(phase))

    @cached_property
    def _at_any_phase(self) -> dict[str, Any]:
        """The fields of `CellProblem` that do not depend on the phase."""
        free, cells = self.models.free, self.cells
        length = cell_length(self.omega, cells)
        flow_table = np.empty(((cells if cells // 2 <= MAX_TABLED_CELLS else MAX_TABLED_CELLS) + 1, free.size, 8))
        tabulate_flow(free.decay, free.frequency_squared, length, flow_table)
        return {
            **free_arrays(self.models, 0.0 if np.all(free.frequency_squared > 0.0) else self.omega),
            "cell_flow": np.ascontiguousarray(flow_table[1, :, :4]),
            "flow_table": flow_table,
            "omega": float(self.omega),
            "step": length.high,
            "cells": cells,
        }

    def _held(self, phase: float) -> HeldProblem:
        """Return the arrays of the kernels for a resting contact."""
        size, (steady, exists, acceleration) = self.oscillator.size, self._steady_at_rest
        orders = [harmonic.order for harmonic in self.oscillator.forces]
        factors = np.stack(
            [whole_period(np.exp(1j * (k * phase)) * half_period_phases(self.cells, k), k) for k in orders]
        )
        return HeldProblem(
            **self.models.held_arrays,
            steady_table=real_and_imaginary(acceleration[:, None] * factors),
            phase_factors=real_and_imaginary(factors),
            steady=real_and_imaginary(steady @ self.models.constrained.basis.T),
            free_steady=real_and_imaginary(self.steady[:, :, :size].reshape(len(self.steady), -1)),
            exists=exists,
            omega=float(self.omega),
        )

    @cached_property
    def _steady_at_rest(self) -> tuple[Complexes, bool, Complexes]:
        """The steady motion of the constrained structure: amplitudes, whether they exist, acceleration of the contact.

        The amplitudes are (H, N - 1) by harmonic. The acceleration (H,), at phase 0, is that of a contact at rest if it
        were released.
        """
        oscillator, constrained, blocks = self.oscillator, self.models.constrained, self.models.held
        at, exists = np.array([self.omega]), blocks is not None or oscillator.size == 1  # else there is no closed form
        steady = np.zeros((len(oscillator.forces), oscillator.size - 1), dtype=np.complex128)
        forces = [harmonic.amplitudes(at)[0] for harmonic in oscillator.forces]
        if blocks is not None:
            assert constrained.structure is not None
            row = constrained.stiffness_row if np.any(constrained.stiffness_row) else np.ones(blocks.size)
            for h, harmonic in enumerate(oscillator.forces):
                on_basis = forces[h][None] @ constrained.basis
                if np.any(on_basis):
                    response = constrained.structure.response(harmonic.order * at, on_basis, row)
                    steady[h] = response.amplitudes[0]
                    resonant = resonant_modes(blocks, at, harmonic.order, HELD_RESONANT_GAIN)
                    exists = exists and bool(response.exists[0]) and not bool(np.any(resonant))
        acceleration = np.zeros(len(steady), dtype=np.complex128)
        for h, harmonic in enumerate(oscillator.forces):
            force = complex(np.sum(oscillator.jump * forces[h]))
            if exists:
                rows = zip(constrained.stiffness_row.tolist(), constrained.damping_row.tolist(), strict=True)
                for (stiff, viscous), amplitude in zip(rows, steady[h].tolist(), strict=True):
                    force -= (stiff + 1j * harmonic.order * self.omega * viscous) * amplitude
            acceleration[h] = force / oscillator.effective_mass
        return steady, exists, acceleration

    def free_state(self, displacement: Floats, velocity: Floats, phase: float) -> Floats:
        """Return a state minus the reference motion at this phase, in block coordinates, shape (N, 2).

        `displacement` and `velocity` (N,) are from the static equilibrium; resonant modes are at rest in the reference
        motion at this moment.
        """
        free = self.models.free
        rest = np.concatenate([displacement, velocity]) - self.reference_state(phase)
        return np.ascontiguousarray((free.to_modal @ rest).reshape(free.size, 2))

    def reference_state(self, phase: float) -> Floats:
        """Return displacements, then velocities, (2 N,), of the reference motion where a half period begins."""
        at_phase = self.steady[:, :, :-1] * np.exp(1j * self.orders * phase)[:, None, None]
        velocity = self.omega * np.sum(self.orders[:, None] * at_phase[:, 1].real, axis=0)
        return np.concatenate([np.sum(at_phase[:, 0].imag, axis=0), velocity])


def forced_structures(models: TrajectoryModels, omega: Floats) -> list[ForcedStructure]:
    """Return a structure at each of several forcing frequencies (m,).

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    """
    steady = reference_response(models.oscillator, models.free, omega)
    return [ForcedStructure(models, float(at), amplitudes) for at, amplitudes in zip(omega, steady, strict=True)]


def cells_per_period(models: Sequence[ModalModel], omega: float, order: int = 1) -> int:
    """Return the even number of cells per forcing period such that exponents are at most CELL_REACH per cell.

    `order` is the largest of the harmonics.

    Raises
    ------
    ParameterError
        The fastest exponent is so much larger than omega that a period would need more than MAX_CELLS_PER_PERIOD cells.
    """
    fastest = max(model.fastest_exponent for model in models)
    needed = 2.0 * math.pi * max(float(order), fastest / omega) / CELL_REACH
    if not needed <= MAX_CELLS_PER_PERIOD:
        most = math.floor(MAX_CELLS_PER_PERIOD * CELL_REACH / (2.0 * math.pi))
        if order > most:
            raise ParameterError("forcing", f"must have harmonics of orders up to {most}")
        raise ParameterError("omega", f"must be greater than the fastest exponent of the structure / {most}")
    return 2 * math.ceil(max(needed, MIN_CELLS_PER_PERIOD) / 2)
