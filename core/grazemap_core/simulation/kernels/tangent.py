"""The linearised flow along a recorded trajectory.

The columns of a matrix are perturbations of the state at one time, with the phase of the forcing unchanged. Between the
events of half a forcing period blocks are advanced in closed form; at an impact a saltation matrix is applied, because
the perturbed trajectory meets the stop earlier or later. With q, q' of a perturbation u before an impact at velocity v
and acceleration a, T the generator of the blocks and k the change of the blocks by a unit of q',

    u+ = u - (1 + R) (k (q' - (a/v) q) + T k q)

which has the determinant R^2. At the last impact of a complete chatter, or at an impact with R = 0 after which the
contact rests, the perturbation is that of u - T k q, without its part of q and q' in the direction of the jump. A
release changes nothing, since the contact starts without acceleration.

References
----------
A. B. Nordmark, J. Sound Vib. 145 (1991) 279-297; M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk,
*Piecewise-smooth Dynamical Systems*, Springer 2008, chapter 2.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem, Forced, HeldProblem, contact_acceleration_of, reference_at
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.runs import Run, copy_state
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.model.kernels.block_flow import advance_columns
from grazemap_core.numerics.jit.compiled import kernel

GRAZED = 101
"""There is an impact at zero velocity, where the flow has no derivative."""


@kernel
def _add_impulse(problem: CellProblem, tangent: Floats, column: int, velocity: float, displacement: float) -> None:
    """Add k times a velocity and T k times a displacement of the contact to one column, in place."""
    for j in range(problem.decay.shape[0]):
        k0, k1 = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        tangent[2 * j, column] += velocity * k0 + displacement * k1
        tangent[2 * j + 1, column] += velocity * k1 - displacement * (
            problem.frequency_squared[j] * k0 + 2.0 * problem.decay[j] * k1
        )


@kernel
def _of_contact(problem: CellProblem, tangent: Floats, column: int) -> tuple[float, float]:
    """Return q and q' of one column."""
    x, v = 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        first, second = tangent[2 * j, column], tangent[2 * j + 1, column]
        x += problem.output_row[j, 0] * first + problem.output_row[j, 1] * second
        v += problem.output_row[j, 2] * first + problem.output_row[j, 3] * second
    return x, v


@kernel
def apply_saltation(
    problem: CellProblem, restitution: float, velocity: float, acceleration: float, tangent: Floats
) -> None:
    """Apply the saltation matrix of an impact to tangent, in place.

    Parameters
    ----------
    velocity, acceleration : float
        Velocity and acceleration of q before the impact; the velocity is not zero.
    tangent : (2 N, k)
    """
    factor = 1.0 + restitution
    ratio = acceleration / velocity
    for c in range(tangent.shape[1]):
        x, v = _of_contact(problem, tangent, c)
        _add_impulse(problem, tangent, c, -factor * (v - ratio * x), -factor * x)


@kernel
def stick_tangent(forced: Forced, tangent: Floats, physical: Floats) -> None:
    """Convert perturbations of the free state before the contact comes to rest into those of the held state, in place.

    The latter are the first 2 (N - 1) rows of tangent (2 N, k); the last two become zero. physical (2 N,) is scratch.
    """
    problem, held = forced.free, forced.held
    count = problem.decay.shape[0]
    rest = count - 1
    for c in range(tangent.shape[1]):
        x, _ = _of_contact(problem, tangent, c)
        _add_impulse(problem, tangent, c, 0.0, -x)
        for i in range(2 * count):
            physical[i] = 0.0
            for row in range(2 * count):
                physical[i] += held.from_free[i, row] * tangent[row, c]
        for row in range(2 * rest):
            value = 0.0
            for i in range(2 * count):
                value += held.to_blocks[row, i] * physical[i]
            tangent[row, c] = value
        tangent[2 * rest, c] = 0.0
        tangent[2 * rest + 1, c] = 0.0


@kernel
def release_tangent(held: HeldProblem, tangent: Floats, physical: Floats) -> None:
    """Convert perturbations of the held state into those of the free state, in place. As `stick_tangent`."""
    rest = held.decay.shape[0]
    count = rest + 1
    for c in range(tangent.shape[1]):
        for i in range(2 * count):
            physical[i] = 0.0
            for row in range(2 * rest):
                physical[i] += held.from_blocks[i, row] * tangent[row, c]
        for row in range(2 * count):
            value = 0.0
            for i in range(count):
                value += held.to_free[row, i] * physical[i] + held.to_free[row, count + i] * physical[count + i]
            tangent[row, c] = value


@kernel
def carry_tangent(forced: Forced, stops: Stops, run: Run, half: int, resting: bool, tangent: Floats) -> int:
    """Apply the linearised flow over the half period whose events are in run.events to tangent, in place.

    Parameters
    ----------
    half : int
        Index of the half period.
    resting : bool
        Whether the contact rests on a stop at its start.
    tangent : (2 N, k)
        Perturbations of the free state in block coordinates, at the start and, on return, at the end of the half
        period; while the contact rests, those that keep it at rest.

    Returns
    -------
    status : OK, or GRAZED; after GRAZED, tangent is that before the graze.
    """
    problem, held, physical = forced.free, forced.held, run.held.physical
    first_cell = (half % 2) * (problem.cells // 2)
    blocks = problem.decay.shape[0]
    passed = 0.0
    if resting:
        # a displaced contact returns to the stop at once; only the effect of dampers that it moves remains
        stick_tangent(forced, tangent, physical)
    for row in range(run.cursor[runs.EVENT_COUNT] + 1):
        last = row == run.cursor[runs.EVENT_COUNT]
        time = problem.step * (problem.cells // 2) if last else run.events[row, runs.TIME]
        if resting:
            advance_columns(held, tangent, time - passed)
        else:
            advance_columns(problem, tangent, time - passed)
        passed = time
        if last:
            break
        if run.events[row, runs.KIND] == runs.RELEASE:
            release_tangent(held, tangent, physical)
            resting = False
        elif run.events[row, runs.KIND] == runs.GRAZE:
            return GRAZED
        elif run.events[row, runs.KIND] == runs.IMPACT:
            velocity = run.events[row, runs.VELOCITY]
            if velocity == 0.0:
                return GRAZED
            after = run.events[row, runs.EVENT_COLUMNS : runs.EVENT_COLUMNS + 2 * blocks].reshape((blocks, 2))
            _, _, acceleration = reference_at(problem, first_cell, time)
            acceleration = contact_acceleration_of(problem, after, acceleration)
            restitution = restitution_of(stops, run.events[row, runs.STOP])
            # the viscous term before the impact
            acceleration -= held.viscous_term * (1.0 + restitution) * velocity
            apply_saltation(problem, restitution, velocity, acceleration, tangent)
        else:
            stick_tangent(forced, tangent, physical)
            resting = True
    if resting:
        release_tangent(held, tangent, physical)
    return runs.OK


@kernel
def run_half_linearised(forced: Forced, stops: Stops, run: Run, half: int, tangent: Floats, began: Run) -> int:
    """Advance a run and the linearised flow along it over half a forcing period, both in place.

    Parameters
    ----------
    run : Run
        Its record has capacity for the events of half a period.
    half : int
        Index of the half period.
    tangent : (2 N, k)
        As in `carry_tangent`.
    began : Run
        Scratch.

    Returns
    -------
    status : OK; RECORD_FULL if run.events is too short, with all arguments as before the call; GRAZED; or the status
        with which the trajectory ended.
    """
    copy_state(began, run)
    run.cursor[runs.EVENT_COUNT] = 0
    status = run_half(forced, stops, run, half)
    if run.cursor[runs.EVENT_COUNT] > run.events.shape[0]:
        copy_state(run, began)
        return runs.RECORD_FULL
    if status != runs.OK:
        return status
    return carry_tangent(forced, stops, run, half, began.cursor[runs.HELD] != 0, tangent)
