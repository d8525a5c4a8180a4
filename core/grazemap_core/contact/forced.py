"""A structure under its forces at one frequency, from which the arrays of the trajectory kernels are made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact import tolerances
from grazemap_core.contact.held_problem import HeldModel, held_problem, held_steady
from grazemap_core.contact.kernels.cell_factors import cell_length, shortfall, tabulate_flow
from grazemap_core.contact.kernels.cells import CellProblem, Forced
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.reference_motion import reference_motion
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model.held_structure import held_structure
from grazemap_core.model.modal import KEPT_MODELS, ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import reference_response
from grazemap_core.records import dataclass

MAX_CELLS_PER_PERIOD = 200_000
"""Maximum number of cells per forcing period; a chain that needs more is too stiff for its forcing frequency.
At the maximum a period of one trajectory takes about 10 ms, a point of a map with a thousand periods about 10 s."""

MAX_TABLED_CELLS = 64
"""Maximum number of cells of a tabulated flow; longer flows are composed of several."""


@dataclass(frozen=True, eq=False)
class ForcedStructure:
    """A structure under its forces at one frequency: what all its trajectories share, whatever their stops and start.

    Arrays are computed when they are first asked for, and kept.
    """

    models: HeldModel
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
        free, cells = self.models.free, self.cells
        step, step_low = cell_length(self.omega, cells)
        flow_table = np.empty(((cells if cells // 2 <= MAX_TABLED_CELLS else MAX_TABLED_CELLS) + 1, free.size, 8))
        tabulate_flow(free.decay, free.frequency_squared, (step, step_low), flow_table)
        fixed = _fixed_arrays(self.models, 0.0 if np.all(free.frequency_squared > 0.0) else self.omega)
        problem = CellProblem(
            **fixed,
            cell_flow=np.ascontiguousarray(flow_table[1, :, :4]),
            flow_table=flow_table,
            **self._reference(step, 0.0, fixed["output_row"]),
            omega=float(self.omega),
            step=step,
            cells=cells,
        )
        return Forced(problem, self._held(0.0))

    def at_phase(self, phase: float) -> Forced:
        """Return the arrays of the kernels for a forcing phase at t = 0."""
        free = self.kernels.free
        if phase == 0.0:
            return self.kernels
        return Forced(free._replace(**self._reference(free.step, phase, free.output_row)), self._held(phase))

    def _reference(self, step: float, phase: float, output_row: Floats) -> dict[str, Any]:
        """Return the fields of `CellProblem` that depend on the phase."""
        return reference_motion(self.models, self.steady, self.omega, step, self.cells, phase, output_row)

    def _held(self, phase: float) -> HeldProblem:
        return held_problem(self.models, self.steady, self._held_steady, self.omega, self.cells, phase)

    @cached_property
    def _held_steady(self) -> tuple[Complexes, bool]:
        return held_steady(self.models, self.omega)

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


def forced_structures(models: HeldModel, omega: Floats) -> list[ForcedStructure]:
    """Return a structure at each of several forcing frequencies (m,).

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    """
    steady = reference_response(models.oscillator, models.free, omega)
    return [ForcedStructure(models, float(at), amplitudes) for at, amplitudes in zip(omega, steady, strict=True)]


@lru_cache(maxsize=KEPT_MODELS)
def trajectory_models(oscillator: Oscillator) -> HeldModel:
    """Return the modal models with the contact free and with it held; the last ones are kept, by the object."""
    free, constrained = modal_model(oscillator), held_structure(oscillator)
    try:
        held = None if constrained.structure is None else modal_model(constrained.structure)
    except (ConditioningError, ParameterError):  # only trajectories that come to rest end for this reason
        held = None
    return HeldModel(oscillator, free, constrained, held)


def cells_per_period(models: Sequence[ModalModel], omega: float, order: int = 1) -> int:
    """Return the even number of cells per forcing period such that exponents are at most CELL_REACH per cell.

    `order` is the largest of the harmonics.

    Raises
    ------
    ParameterError
        The fastest exponent is so much larger than omega that a period would need more than MAX_CELLS_PER_PERIOD cells.
    """
    fastest = max(model.fastest_exponent for model in models)
    needed = 2.0 * math.pi * max(float(order), fastest / omega) / tolerances.CELL_REACH
    if not needed <= MAX_CELLS_PER_PERIOD:
        raise ParameterError(
            "omega", f"must be greater than the fastest exponent of the structure / {MAX_CELLS_PER_PERIOD // 6}"
        )
    return 2 * math.ceil(max(needed, tolerances.MIN_CELLS_PER_PERIOD) / 2)


@lru_cache(maxsize=KEPT_MODELS)
def _fixed_arrays(models: HeldModel, omega: float) -> dict[str, Any]:
    """Return the fields of `CellProblem` that do not depend on the forcing frequency, unless there is a free mode.

    A free mode, which contact does not see, has the forcing's unit of time: `omega`, which else counts for nothing.
    """
    model, oscillator = models.free, models.oscillator
    count = model.size
    frequency = np.where(model.frequency_squared > 0.0, np.sqrt(model.frequency_squared), omega)
    a, b = model.contact_row.T
    unit_displacement = (model.to_modal[:, :count] @ oscillator.jump).reshape(count, 2)
    seen = np.any(model.contact_row != 0.0, axis=1)
    output_row = np.stack([a, b, -b * model.frequency_squared, a - 2.0 * model.decay * b], axis=1)
    reach, fourth = np.empty(count), np.empty(count)
    for j in range(count):
        generator = np.array([[0.0, 1.0], [-model.frequency_squared[j], -2.0 * model.decay[j]]])
        row = output_row[j, :2]
        reach[j] = math.hypot(row[0] / frequency[j], row[1])
        row = row @ np.linalg.matrix_power(generator, 4)
        fourth[j] = math.hypot(row[0] / frequency[j], row[1])
    size = np.max(np.abs(model.shape[:, :, 0]) + frequency * np.abs(model.shape[:, :, 1]), axis=0)
    size = np.where(seen | ~model.undamped, size / np.max(np.abs(oscillator.jump)), 0.0)
    return {
        "decay": np.ascontiguousarray(model.decay),
        "discriminant": np.ascontiguousarray(model.discriminant),
        "frequency_squared": np.ascontiguousarray(model.frequency_squared),
        "frequency": frequency,
        "output_row": np.ascontiguousarray(output_row),
        "unit_impulse": np.ascontiguousarray(model.unit_impulse),
        "unit_impulse_low": _unit_impulse_low(model, unit_displacement, output_row),
        "unit_displacement": unit_displacement,
        "reach": reach,
        "fourth": fourth,
        "displacement_scale": np.stack([size, size / frequency], axis=1),
        "damped": not bool(np.any(model.undamped & seen)),
    }


def _unit_impulse_low(model: ModalModel, unit_displacement: Floats, output_row: Floats) -> Floats:
    """Return the rounding error of `unit_impulse`, shape (N, 2).

    Without it the energy would drift in one direction by a few roundings at every impact.
    """
    displacement = shortfall(output_row[:, :2], model.unit_impulse, 0.0)
    velocity = shortfall(output_row[:, 2:], model.unit_impulse, 1.0)
    return np.ascontiguousarray(displacement * unit_displacement + velocity * model.unit_impulse)
