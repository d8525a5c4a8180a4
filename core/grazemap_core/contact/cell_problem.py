"""From an oscillator and a forcing frequency to the arrays that the trajectory kernels read."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.held_problem import HeldModel, held_at_phase, held_model, held_problem
from grazemap_core.contact.kernels.cell_factors import cell_length, shortfall, tabulate_flow
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.phase_table import half_circle
from grazemap_core.contact.tolerances import (
    CELL_REACH,
    CHATTER_ACCURACY,
    COMPLETE_CHATTERS,
    LEAST_CELLS,
    LONGEST_CHATTER,
)
from grazemap_core.errors import ParameterError
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator

MOST_CELLS = 200_000
"""Cells per forcing period beyond which a chain is refused as too stiff for its forcing frequency: a period of one
trajectory costs some 10 ms there, a point of a map with a thousand periods some 10 s."""

MOST_TABLED = 64
"""Longest flow that is tabulated, in cells; longer ones are made up of it."""


def trajectory_models(oscillator: Oscillator) -> HeldModel:
    """Return the modal models that a trajectory needs: of the whole chain, and of what moves while mass 1 rests."""
    return held_model(oscillator, modal_model(oscillator))


def cells_per_period(models: Sequence[ModalModel], omega: float) -> int:
    """Return the even number of cells that one forcing period is cut into, short against every exponent of the models.

    Raises
    ------
    ParameterError
        The fastest exponent is so much larger than omega that a period would need more than MOST_CELLS cells.
    """
    fastest = 0.0
    for model in models:
        exponents = np.where(
            model.discriminant < 0.0,
            model.decay + np.sqrt(np.maximum(-model.discriminant, 0.0)),
            np.sqrt(model.frequency_squared),
        )
        fastest = max(fastest, float(np.max(exponents)))
    needed = 2.0 * math.pi * max(1.0, fastest / omega) / CELL_REACH
    if not needed <= MOST_CELLS:
        raise ParameterError("omega", f"must be greater than the fastest exponent of the chain / {MOST_CELLS // 6}")
    return 2 * math.ceil(max(needed, LEAST_CELLS) / 2)


def cell_problem(
    models: HeldModel, steady: Complexes, omega: float, phase: float = 0.0
) -> tuple[CellProblem, HeldProblem]:
    """Return the kernels' views of an oscillator forced at one frequency: on its way, and with mass 1 at rest.

    Parameters
    ----------
    models : HeldModel
        As `trajectory_models` returns it.
    steady : complex, shape (N,)
        Steady response of every mass: its motion is ``Im(steady exp(i (omega t + phase)))``.
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
    flow_table = np.empty((min(cells // 2, MOST_TABLED) + 1, count, 8))
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
        unit_impulse_low=_kick_low(model, output_row),
        reach=reach,
        fourth=fourth,
        closeness=np.stack([size, size / frequency], axis=1),
        cell_flow=np.ascontiguousarray(flow_table[1, :, :4]),
        flow_table=flow_table,
        steady_table=_gain(steady, cells, phase),
        steady_bound=float(abs(steady[0])),
        omega=float(omega),
        step=step[0],
        restitution=models.oscillator.restitution,
        cells=cells,
        chatter_impacts=COMPLETE_CHATTERS * chatter_bounces(models.oscillator.restitution, cells),
        damped=not bool(np.any(model.undamped)),
    )
    return problem, held_problem(models, steady, omega, cells, phase)


def at_phase(
    problem: CellProblem, held: HeldProblem, models: HeldModel, steady: Complexes, phase: float
) -> tuple[CellProblem, HeldProblem]:
    """Return the same views with another forcing phase at t = 0, to the bit as `cell_problem` returns them for it.

    Mass 1 does not rest in them, and what changes in place is their own.
    """
    return (
        problem._replace(steady_table=_gain(steady, problem.cells, phase)),
        held_at_phase(held, models, problem.omega, problem.cells, phase),
    )


def _gain(steady: Complexes, cells: int, phase: float) -> Floats:
    """Return the steady motion of mass 1 at the boundaries of the cells, as (real, imaginary), shape (cells + 1, 2)."""
    # the second half of the table mirrors the first exactly, so that symmetric motions are symmetric to the last bit
    half = steady[0] * np.exp(1j * phase) * half_circle(cells)
    steady_table = np.concatenate([half, -half, half[:1]])
    return np.stack([steady_table.real, steady_table.imag], axis=1)


def chatter_bounces(restitution: float, cells: int) -> float:
    """Return how many bounces of a complete chatter are followed one by one, at most LONGEST_CHATTER.

    `cells` are those of a forcing period, half of which it may take.
    """
    if restitution == 0.0:
        return 1.0
    if restitution == 1.0:
        return float(LONGEST_CHATTER)
    return min(
        float(LONGEST_CHATTER), 1.0 + (math.log(CHATTER_ACCURACY) / 3.0 - math.log(0.5 * cells)) / math.log(restitution)
    )


def _kick_low(model: ModalModel, output_row: Floats) -> Floats:
    """Return what the rounded kick leaves out of a unit velocity of mass 1, shape (N, 2).

    Without it every impact would change the energy by the same few roundings, in one direction.
    """
    place = model.to_modal[:, 0].reshape(model.size, 2)
    displacement = shortfall(output_row[:, :2], model.unit_impulse, 0.0)
    velocity = shortfall(output_row[:, 2:], model.unit_impulse, 1.0)
    return np.ascontiguousarray(displacement * place + velocity * model.unit_impulse)


def free_state(
    model: ModalModel,
    steady: Complexes,
    omega: float,
    displacement: Floats,
    velocity: Floats,
    phase: float,
) -> Floats:
    """Return a physical state, less the steady motion at this phase, in block coordinates, shape (N, 2)."""
    turned = steady * np.exp(1j * phase)
    rest = np.concatenate([displacement - turned.imag, velocity - omega * turned.real])
    return np.ascontiguousarray((model.to_modal @ rest).reshape(model.size, 2))
