"""Construction of the arrays that the trajectory kernels take, from an oscillator and a forcing frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence

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
from grazemap_core.contact.reference_motion import reference_motion
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator

MAX_CELLS_PER_PERIOD = 200_000
"""Maximum number of cells per forcing period; a chain that needs more is too stiff for its forcing frequency.
At the maximum a period of one trajectory takes about 10 ms, a point of a map with a thousand periods about 10 s."""

MAX_TABLED_CELLS = 64
"""Maximum number of cells of a tabulated flow; longer flows are composed of several."""


def trajectory_models(oscillator: Oscillator) -> HeldModel:
    """Return the modal models of the whole chain and of the chain while mass 1 rests."""
    free, chain = modal_model(oscillator), oscillator.held_chain
    try:
        return HeldModel(oscillator, free, None if chain is None else modal_model(chain))
    except ConditioningError:  # only trajectories that come to rest end for this reason
        return HeldModel(oscillator, free, None)


def cells_per_period(models: Sequence[ModalModel], omega: float) -> int:
    """Return the even number of cells per forcing period such that exponents are at most CELL_REACH per cell.

    Raises
    ------
    ParameterError
        The fastest exponent is so much larger than omega that a period would need more than MAX_CELLS_PER_PERIOD cells.
    """
    fastest = 0.0
    for model in models:
        exponents = np.where(
            model.discriminant < 0.0,
            model.decay + np.sqrt(np.maximum(-model.discriminant, 0.0)),
            np.sqrt(model.frequency_squared),
        )
        fastest = max(fastest, float(np.max(exponents)))
    needed = 2.0 * math.pi * max(1.0, fastest / omega) / tolerances.CELL_REACH
    if not needed <= MAX_CELLS_PER_PERIOD:
        raise ParameterError(
            "omega", f"must be greater than the fastest exponent of the chain / {MAX_CELLS_PER_PERIOD // 6}"
        )
    return 2 * math.ceil(max(needed, tolerances.MIN_CELLS_PER_PERIOD) / 2)


def cell_problem(
    models: HeldModel, steady: Complexes, omega: float, phase: float = 0.0
) -> tuple[CellProblem, HeldProblem]:
    """Return the arrays of the kernels for one forcing frequency, with mass 1 free and with mass 1 at rest.

    Parameters
    ----------
    models : HeldModel
        From `trajectory_models`.
    steady : complex, shape (2, N)
        From `reference_response`: amplitudes of the displacements, and of the velocities divided by i omega; the motion
        is ``Im(steady exp(i (omega t + phase)))``. Or (N,), the steady motion of all modes: then none is resonant.
    omega : float
        Forcing frequency.
    phase : float
        Forcing phase at t = 0.
    """
    model = models.free
    count = model.size
    cells = cells_per_period([model] if models.held is None else [model, models.held], omega)
    step = cell_length(omega, cells)
    frequency = np.sqrt(model.frequency_squared)
    a, b = model.shape[0, :, 0], model.shape[0, :, 1]
    output_row = np.stack([a, b, -b * model.frequency_squared, a - 2.0 * model.decay * b], axis=1)
    reach, fourth = np.empty(count), np.empty(count)
    flow_table = np.empty(((cells if cells // 2 <= MAX_TABLED_CELLS else MAX_TABLED_CELLS) + 1, count, 8))
    tabulate_flow(model.decay, model.frequency_squared, step, flow_table)
    for j in range(count):
        generator = np.array([[0.0, 1.0], [-model.frequency_squared[j], -2.0 * model.decay[j]]])
        row = output_row[j, :2]
        reach[j] = math.hypot(row[0] / frequency[j], row[1])
        row = row @ np.linalg.matrix_power(generator, 4)
        fourth[j] = math.hypot(row[0] / frequency[j], row[1])
    size = np.max(np.abs(model.shape[:, :, 0]) + frequency * np.abs(model.shape[:, :, 1]), axis=0)
    problem = CellProblem(
        decay=np.ascontiguousarray(model.decay),
        discriminant=np.ascontiguousarray(model.discriminant),
        frequency_squared=np.ascontiguousarray(model.frequency_squared),
        frequency=frequency,
        output_row=np.ascontiguousarray(output_row),
        unit_impulse=np.ascontiguousarray(model.unit_impulse),
        unit_impulse_low=_unit_impulse_low(model, output_row),
        reach=reach,
        fourth=fourth,
        displacement_scale=np.stack([size, size / frequency], axis=1),
        cell_flow=np.ascontiguousarray(flow_table[1, :, :4]),
        flow_table=flow_table,
        **reference_motion(models.oscillator, model, steady, omega, step[0], cells, phase, output_row)._asdict(),
        omega=float(omega),
        step=step[0],
        restitution=models.oscillator.restitution,
        cells=cells,
        chatter_impacts=tolerances.COMPLETE_CHATTERS * followed_chatter_impacts(models.oscillator.restitution, cells),
        damped=not bool(np.any(model.undamped)),
    )
    return problem, held_problem(models, np.broadcast_to(steady, (2, count)), omega, cells, phase)


def at_phase(
    problem: CellProblem, held: HeldProblem, models: HeldModel, steady: Complexes, phase: float
) -> tuple[CellProblem, HeldProblem]:
    """Return the arrays for another forcing phase at t = 0, bitwise equal to those of `cell_problem`.

    Mass 1 does not rest. Arrays that kernels change in place are new.
    """
    reference = reference_motion(
        models.oscillator, models.free, steady, problem.omega, problem.step, problem.cells, phase, problem.output_row
    )
    return (
        problem._replace(**reference._asdict()),
        held_at_phase(held, models, problem.omega, problem.cells, phase),
    )


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


def _unit_impulse_low(model: ModalModel, output_row: Floats) -> Floats:
    """Return the rounding error of `unit_impulse`, shape (N, 2).

    Without it the energy would drift in one direction by a few roundings at every impact.
    """
    unit_displacement = model.to_modal[:, 0].reshape(model.size, 2)
    displacement = shortfall(output_row[:, :2], model.unit_impulse, 0.0)
    velocity = shortfall(output_row[:, 2:], model.unit_impulse, 1.0)
    return np.ascontiguousarray(displacement * unit_displacement + velocity * model.unit_impulse)


def free_state(
    model: ModalModel,
    steady: Complexes,
    omega: float,
    displacement: Floats,
    velocity: Floats,
    phase: float,
) -> Floats:
    """Return a physical state minus the reference motion at this phase, in block coordinates, shape (N, 2).

    `steady` is that of `cell_problem`; resonant modes are at rest in the reference motion at this moment.
    """
    at_phase = np.broadcast_to(steady, (2, model.size)) * np.exp(1j * phase)
    rest = np.concatenate([displacement - at_phase[0].imag, velocity - omega * at_phase[1].real])
    return np.ascontiguousarray((model.to_modal @ rest).reshape(model.size, 2))
