"""Construction of the arrays that the trajectory kernels take, from an oscillator and a forcing frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact import tolerances
from grazemap_core.contact.held_problem import (
    HeldModel,
    held_at_phase,
    held_problem,
)
from grazemap_core.contact.kernels.cell_factors import cell_length, shortfall, tabulate_flow
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.reference_motion import reference_motion
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model.drive import is_half_wave_symmetric
from grazemap_core.model.equilibrium import effective_gaps
from grazemap_core.model.held_structure import held_structure
from grazemap_core.model.modal import KEPT_MODELS, ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

MAX_CELLS_PER_PERIOD = 200_000
"""Maximum number of cells per forcing period; a chain that needs more is too stiff for its forcing frequency.
At the maximum a period of one trajectory takes about 10 ms, a point of a map with a thousand periods about 10 s."""

MAX_TABLED_CELLS = 64
"""Maximum number of cells of a tabulated flow; longer flows are composed of several."""

STOPS_UNIT = Stops._fields.index("unit")
"""Column of `stops_table`."""


Clearance = float | tuple[float | None, float | None]
"""Distance of both stops, or of the right and of the left one, from q = 0; None: there is no such stop."""


def both_clearances(clearance: Clearance) -> tuple[float, float]:
    """Return the clearances of the right and of the left stop; infinite for an absent one."""
    right, left = clearance if isinstance(clearance, tuple) else (clearance, clearance)
    return math.inf if right is None else right, math.inf if left is None else left


@lru_cache(maxsize=KEPT_MODELS)
def trajectory_models(oscillator: Oscillator) -> HeldModel:
    """Return the modal models with the contact free and with it held; the last ones are kept, by the object."""
    free, constrained = modal_model(oscillator), held_structure(oscillator)
    try:
        held = None if constrained.structure is None else modal_model(constrained.structure)
    except (ConditioningError, ParameterError):  # only trajectories that come to rest end for this reason
        held = None
    return HeldModel(oscillator, free, constrained, held)


def stops_of(oscillator: Oscillator, clearance: Clearance, problem: CellProblem) -> Stops:
    """Return the stops as the kernels of trajectories take them. Raises as `stops_between`, but the unit may be 0."""
    gaps = _gaps(oscillator, clearance)
    both = oscillator.restitution_of(1), oscillator.restitution_of(-1)
    (row,) = stops_table(oscillator, np.array([gaps]), np.array([both]), problem.cells, problem.steady_bound)
    right, left, restitution_right, restitution_left, unit, chatter, settling, symmetric = row.tolist()
    return Stops(right, left, restitution_right, restitution_left, unit, chatter, settling, symmetric != 0.0)


def stops_between(oscillator: Oscillator, clearance: Clearance, amplitude: float) -> Stops:
    """Return the stops without the limits of chatter; `amplitude` is a bound of the steady motion of q.

    Raises
    ------
    ParameterError
        A clearance is out of its range, both stops are absent, or the equilibrium lies beyond both.
    """
    gaps = _gaps(oscillator, clearance)
    unit = float(unit_of_stops(*gaps, amplitude))
    require_length(unit)
    both = oscillator.restitution_of(1), oscillator.restitution_of(-1)
    alike = gaps[0] == gaps[1] and both[0] == both[1] and has_odd_harmonics_only(oscillator)
    return Stops(*gaps, *both, unit, 0.0, 0.0, alike)


def _gaps(oscillator: Oscillator, clearance: Clearance) -> tuple[float, float]:
    """Return the gaps of both stops from the equilibrium. Raises as `stops_between`."""
    right, left = clearance if isinstance(clearance, tuple) else (clearance, clearance)
    for gap in (right, left):
        if gap is not None and not (gap == 0.0 or SMALLEST_NUMBER <= abs(gap) <= LARGEST_NUMBER):
            raise ParameterError(
                "clearance", f"every number must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in size"
            )
    if right is None and left is None:
        raise ParameterError("clearance", "has neither a right nor a left stop")
    return effective_gaps(oscillator, right, left)


def require_length(unit: float, moved_by: str = "the forces do not move") -> None:
    """Raise ParameterError unless the unit of length is positive; `moved_by` says what else has no length."""
    if not unit > 0.0:
        raise ParameterError("clearance", f"has a stop at the equilibrium, and {moved_by} the contact")


def unit_of_stops(right: float | Floats, left: float | Floats, amplitude: float | Floats = 0.0) -> Floats:
    """Return `Stops.unit` for gaps (n,) of both stops; `amplitude` is a bound of the steady motion of q."""
    of_nearer = np.maximum(np.abs(np.minimum(right, left)), amplitude)
    return np.minimum(0.5 * np.add(right, left), of_nearer)


def has_odd_harmonics_only(oscillator: Oscillator) -> bool:
    """Return whether the forces change their sign after half of their period."""
    return is_half_wave_symmetric(oscillator.drive)


def stops_table(
    oscillator: Oscillator, gaps: Floats, restitution: Floats, cells: int, amplitude: float | Floats
) -> Floats:
    """Return the fields of `Stops`, (n, fields), for stops with gaps from the equilibrium and restitutions.

    `gaps` and `restitution` (n, 2) are those of the right and of the left stop, `cells` are in a period, and
    `amplitude`, or (n,), bounds the steady motion of q.
    """
    numbers = restitution.ravel().tolist()
    known = {number: followed_chatter_impacts(number, cells) for number in set(numbers)}
    chatter = np.array([known[number] for number in numbers]).reshape(-1, 2)
    settling = np.where(chatter < tolerances.MAX_CHATTER_IMPACTS, chatter, 0.0)
    right, left = gaps.T
    alike = (right == left) & (restitution[:, 0] == restitution[:, 1]) & has_odd_harmonics_only(oscillator)
    unit = unit_of_stops(right, left, amplitude)
    return np.column_stack([gaps, restitution, unit, chatter.sum(axis=1), settling.sum(axis=1), alike])


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


def cell_problem(
    models: HeldModel, steady: Complexes, omega: float, phase: float = 0.0
) -> tuple[CellProblem, HeldProblem]:
    """Return the arrays of the kernels for one forcing frequency, with the contact free and with the contact at rest.

    Parameters
    ----------
    models : HeldModel
        From `trajectory_models`.
    steady : complex, shape (H, 2, N + 1)
        From `reference_response`.
    omega : float
        Forcing frequency.
    phase : float
        Forcing phase at t = 0.
    """
    model, oscillator = models.free, models.oscillator
    highest = max(harmonic.order for harmonic in oscillator.forces)
    cells = cells_per_period([model] if models.held is None else [model, models.held], omega, highest)
    step = cell_length(omega, cells)
    flow_table = np.empty(((cells if cells // 2 <= MAX_TABLED_CELLS else MAX_TABLED_CELLS) + 1, model.size, 8))
    tabulate_flow(model.decay, model.frequency_squared, step, flow_table)
    fixed = _fixed_arrays(models, 0.0 if np.all(model.frequency_squared > 0.0) else omega)
    problem = CellProblem(
        **fixed,
        cell_flow=np.ascontiguousarray(flow_table[1, :, :4]),
        flow_table=flow_table,
        **reference_motion(oscillator, model, steady, omega, step[0], cells, phase, fixed["output_row"]),
        omega=float(omega),
        step=step[0],
        cells=cells,
    )
    return problem, held_problem(models, steady, omega, cells, phase)


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


def at_phase(
    problem: CellProblem, held: HeldProblem, models: HeldModel, steady: Complexes, phase: float
) -> tuple[CellProblem, HeldProblem]:
    """Return the arrays for another forcing phase at t = 0, bitwise equal to those of `cell_problem`.

    The contact does not rest. Arrays that kernels change in place are new.
    """
    reference = reference_motion(
        models.oscillator, models.free, steady, problem.omega, problem.step, problem.cells, phase, problem.output_row
    )
    return (
        problem._replace(**reference),
        held_at_phase(held, models, problem.omega, problem.cells, phase),
    )


@lru_cache(maxsize=16)
def followed_chatter_impacts(restitution: float, cells: int) -> float:
    """Return how many impacts of a complete chatter are computed one by one, at most MAX_CHATTER_IMPACTS.

    The chatter may last half a forcing period; `cells` is the number of cells of a period.
    """
    if restitution == 0.0:
        return 1.0
    if restitution == 1.0:
        return float(tolerances.MAX_CHATTER_IMPACTS)
    return min(
        float(tolerances.MAX_CHATTER_IMPACTS),
        1.0 + (math.log(tolerances.CHATTER_ACCURACY) / 3.0 - math.log(0.5 * cells)) / math.log(restitution),
    )


def _unit_impulse_low(model: ModalModel, unit_displacement: Floats, output_row: Floats) -> Floats:
    """Return the rounding error of `unit_impulse`, shape (N, 2).

    Without it the energy would drift in one direction by a few roundings at every impact.
    """
    displacement = shortfall(output_row[:, :2], model.unit_impulse, 0.0)
    velocity = shortfall(output_row[:, 2:], model.unit_impulse, 1.0)
    return np.ascontiguousarray(displacement * unit_displacement + velocity * model.unit_impulse)


def free_state(
    model: ModalModel,
    steady: Complexes,
    orders: Floats,
    omega: float,
    displacement: Floats,
    velocity: Floats,
    phase: float,
) -> Floats:
    """Return a state minus the reference motion at this phase, in block coordinates, shape (N, 2).

    `displacement` and `velocity` (N,) are from the static equilibrium, `steady` and `orders` those of the problem;
    resonant modes are at rest in the reference motion at this moment.
    """
    rest = np.concatenate([displacement, velocity]) - reference_state(steady, orders, omega, phase)
    return np.ascontiguousarray((model.to_modal @ rest).reshape(model.size, 2))


def reference_state(steady: Complexes, orders: Floats, omega: float, phase: float) -> Floats:
    """Return displacements, then velocities, (2 N,), of the reference motion where a half period begins."""
    at_phase = steady[:, :, :-1] * np.exp(1j * orders * phase)[:, None, None]
    velocity = omega * np.sum(orders[:, None] * at_phase[:, 1].real, axis=0)
    return np.concatenate([np.sum(at_phase[:, 0].imag, axis=0), velocity])
