"""The modal models of a structure, with its contact free and at rest, and what the kernels take of them."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cell_factors import shortfall
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model.held_structure import HeldStructure, held_structure
from grazemap_core.model.modal import KEPT_MODELS, ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class TrajectoryModels:
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
    def held_arrays(self) -> dict[str, Any]:
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


@lru_cache(maxsize=KEPT_MODELS)
def trajectory_models(oscillator: Oscillator) -> TrajectoryModels:
    """Return the modal models with the contact free and with it held; the last ones are kept, by the object."""
    free, constrained = modal_model(oscillator), held_structure(oscillator)
    try:
        held = None if constrained.structure is None else modal_model(constrained.structure)
    except (ConditioningError, ParameterError):  # only trajectories that come to rest end for this reason
        held = None
    return TrajectoryModels(oscillator, free, constrained, held)


@lru_cache(maxsize=KEPT_MODELS)
def free_arrays(models: TrajectoryModels, omega: float) -> dict[str, Any]:
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


def _output_row(model: TrajectoryModels, blocks: ModalModel) -> Floats:
    """Return `HeldProblem.output_row`."""
    constrained, square, twice = model.constrained, blocks.frequency_squared, 2.0 * blocks.decay
    a, b = blocks.shape[:, :, 0], blocks.shape[:, :, 1]
    rates = np.stack([-b * square, a - twice * b], axis=2)  # velocities in (u, u')
    forces = np.einsum("i,ijk->kj", constrained.stiffness_row, blocks.shape)
    forces = forces + np.einsum("i,ijk->kj", constrained.damping_row, rates)
    first = -forces / model.oscillator.effective_mass
    return np.stack([first[0], first[1], -first[1] * square, first[0] - twice * first[1]], axis=1)
