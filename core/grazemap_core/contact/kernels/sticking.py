"""The contact at rest on a stop: the motion of the structure, how the contact comes to rest, and how it is released.

At rest the contact coordinate is a constraint, q = stop * gap, so the structure has n = N - 1 degrees of freedom. It
moves in closed form: y = q profile + steady motion + blocks, with y the displacements from the static equilibrium. A
held state is the pair (u, u') of every block of the constrained structure. The contact acceleration, which q would have
toward the stop without the stop, is a sum of the same blocks and has a Taylor series in every cell.

The contact comes to rest at once, or by complete chatter: if it is accelerated toward the stop, it bounces with
decreasing speed, infinitely many times in a finite time. Let a > 0 be the contact acceleration, a' its rate, d the
viscous term and q = R v/(1 - R) with v the speed before an impact. The remaining impacts take the time

    2 q/a - (2 d/(3 a^2) + 4 a'/(3 a^3)) q^2 + O(v^3)

and their effect on the structure is the flow with the contact held from that impact on, to O(v^3). The impacts are no
longer computed one by one when this is accurate to CHATTER_ACCURACY. The contact stays at rest until the contact
acceleration *crosses* zero; a touch of zero is no release.

References
----------
A. B. Nordmark, P. T. Piiroinen, "Simulation and stability analysis of impacting systems with complete chattering",
Nonlinear Dynamics 58 (2009) 85-106.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    Forced,
    HeldProblem,
    add_harmonic,
    contact_acceleration_of,
    contact_motion,
    expand,
    forced_part,
    reference_at,
    reference_at_half,
    rotated_entry,
)
from grazemap_core.contact.kernels.runs import HeldRun, Moment, Run, put_on_stop, record_event, write_state
from grazemap_core.contact.kernels.stops import Stops, gap_of, restitution_of
from grazemap_core.contact.tolerances import CHATTER_ACCURACY, CHATTER_CHANGE, CONTACT_ROUNDING
from grazemap_core.model.kernels.block_flow import advance_state
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.kernels.bernstein import BECOMES_NEGATIVE, GRAZE_UNDECIDED, first_negative
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE


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


@kernel
def expand_contact_acceleration(
    held: HeldProblem, stops: Stops, run: Run, stop: int, moment: Moment, length: float
) -> float:
    """Write the series of the contact acceleration over the next `length`, scaled to t in [0, 1], into run.distance.

    Returns a bound of the error of its Bernstein coefficients.
    """
    cell, offset, _ = moment
    frequency = held.orders[0] * held.omega
    steady = rotated_entry(held.steady_table[0], cell, frequency * offset)
    size, _, rest = expand(held, run.held.state, frequency, steady, length, run.distance, run.terms)
    for h in range(1, held.orders.shape[0]):
        frequency = held.orders[h] * held.omega
        steady = rotated_entry(held.steady_table[h], cell, frequency * offset)
        more, more_rest = add_harmonic(steady, frequency, length, run.distance)
        size, rest = size + more, rest + more_rest
    static_acceleration = held.static_acceleration * gap_of(stops, stop)
    for k in range(TAYLOR_DEGREE + 1):
        run.distance[k] *= stop
    run.distance[0] -= static_acceleration
    return CONTACT_ROUNDING * (size + abs(static_acceleration)) + rest


@kernel
def begin_rest(forced: Forced, stops: Stops, run: Run, moment: Moment) -> tuple[bool, float]:
    """Bring the contact to rest on the anchor if the remaining impacts may be summed; its held state is then at rest.

    Parameters
    ----------
    run : Run
        Its anchor is the stop, and run.near[ANCHOR_RATE] the speed at which the contact leaves it; 0 at rest. Its free
        state is on the stop, and changed by round-off only.

    Returns
    -------
    rests : bool
    delay : float
        Time until the contact is at rest.
    """
    stop, leaving = run.cursor[runs.ANCHOR], run.near[runs.ANCHOR_RATE]
    problem, held, u = forced.free, forced.held, run.u
    cell, offset, half = moment
    time = problem.step * (cell % (problem.cells // 2)) + offset
    turn_to(held, run.held, cell, problem.omega * offset)
    forced_part(problem, u, half, time, 1.0)
    held_from_free(held, run.held, u, stop * gap_of(stops, stop))
    forced_part(problem, u, half, time, -1.0)
    error = expand_contact_acceleration(held, stops, run, stop, moment, problem.step)
    contact_acceleration = run.distance[0]
    delay = 0.0
    if leaving > 0.0:
        if not contact_acceleration > error:
            return False, 0.0
        q = leaving / (1.0 - restitution_of(stops, stop))
        rate = run.distance[1] / problem.step
        share = 2.0 * q / (contact_acceleration * problem.step)
        change = 0.0
        power = share
        for k in range(1, TAYLOR_DEGREE + 1):
            change += abs(run.distance[k]) * power
            power *= share
        change /= contact_acceleration
        if not (change < CHATTER_CHANGE and share * (change + share) ** 2 <= CHATTER_ACCURACY):
            return False, 0.0
        second_derivative = 2.0 * held.viscous_term / (
            3.0 * contact_acceleration * contact_acceleration
        ) + 4.0 * rate / (3.0 * contact_acceleration**3)
        delay = 2.0 * q / contact_acceleration - second_derivative * q * q
    elif not contact_acceleration >= -error:
        return False, 0.0
    run.cursor[runs.ANCHOR] = stop
    run.cursor[runs.HELD] = stop
    run.held.since[0] = half
    run.held.since[1] = time + delay
    run.tally[runs.HELD_RIGHT if stop > 0 else runs.HELD_LEFT] = 1.0
    return True, delay


@kernel
def _no_rest(problem: CellProblem, run: Run, cell: int, offset: float) -> int:
    """Return NO_HELD_FLOW if the contact is pressed against its anchor, where it would rest; otherwise OK."""
    _, _, acceleration = reference_at(problem, cell, offset)
    pressed = run.cursor[runs.ANCHOR] * contact_acceleration_of(problem, run.u, acceleration) > 0.0
    return runs.NO_HELD_FLOW if pressed else runs.OK


@kernel
def rest_after_impact(forced: Forced, stops: Stops, run: Run, moment: Moment) -> int:
    """Bring the contact to rest after an impact if the remaining impacts may be summed. Returns OK or NO_HELD_FLOW."""
    stop, leaving = run.cursor[runs.ANCHOR], run.near[runs.ANCHOR_RATE]
    if not forced.held.exists:
        return _no_rest(forced.free, run, moment.cell, moment.offset)
    rests, delay = begin_rest(forced, stops, run, moment)
    if not rests:
        return runs.OK
    if leaving > 0.0:
        run.tally[runs.RIGHT_IMPACTS if stop > 0 else runs.LEFT_IMPACTS] = np.inf
        run.tally[runs.MIN_SPEED] = 0.0
    row = run.cursor[runs.EVENT_COUNT] - 1  # of this impact
    if 0 <= row < run.events.shape[0]:
        run.events[row, runs.KIND] = runs.CHATTER if leaving > 0.0 else runs.IMPACT_AND_REST
        run.events[row, runs.DELAY] = delay
        write_state(run.events[row], run.held.state)
    return runs.OK


@kernel
def carry_rest(forced: Forced, stops: Stops, run: Run, moment: Moment) -> float:
    """Advance a resting contact to the end of the cell, or to its release, and return the time in the cell.

    After a release run.cursor[HELD] is 0 and run.u is the free state; otherwise run.u is not changed.
    """
    problem, held = forced.free, forced.held
    cell, offset, half = moment
    stop = run.cursor[runs.HELD]
    length = problem.step - offset
    error = expand_contact_acceleration(held, stops, run, stop, moment, length)
    run.tally[runs.HELD_RIGHT if stop > 0 else runs.HELD_LEFT] = 1.0
    # the contact acceleration may be zero to within round-off at the start; it is released where it turns negative
    degree = plain(TAYLOR_DEGREE)
    status, t = first_negative(run.distance, degree, degree, error, run.stack, run.start, run.width)
    if status != BECOMES_NEGATIVE:
        # where nothing moves and no force acts, nothing is undecided
        if status == GRAZE_UNDECIDED and error > 0.0:
            run.tally[runs.UNDECIDED] += 1.0
        advance_state(held, run.held.state, length)
        return problem.step
    passed = t * length
    advance_state(held, run.held.state, passed)
    offset += passed
    write_free_state(forced, stops, run, cell, offset)
    run.cursor[runs.HELD] = 0
    run.cursor[runs.ZERO_ORDER] = 3
    before = problem.step * (cell % (problem.cells // 2))
    record_event(run, half, before + offset, stop, 0.0, runs.RELEASE)
    return offset


@kernel
def write_free_state(forced: Forced, stops: Stops, run: Run, cell: int, offset: float) -> None:
    """Write the free state of a resting contact into run.u."""
    problem, held = forced.free, forced.held
    turn_to(held, run.held, cell, problem.omega * offset)
    stop = run.cursor[runs.HELD]
    free_from_held(held, run.held, stop * gap_of(stops, stop), run.u)
    half = cell // (problem.cells // 2)
    forced_part(problem, run.u, half, problem.step * (cell - half * (problem.cells // 2)) + offset, -1.0)


@kernel
def start_on_stop(forced: Forced, stops: Stops, run: Run, stop: int) -> int:
    """Start at rest on a stop; the contact stays there if pressed against it. Returns OK or NO_HELD_FLOW."""
    put_on_stop(run.cursor, run.near, stop, 0.0)
    if not forced.held.exists:
        return _no_rest(forced.free, run, plain(0), 0.0)
    begin_rest(forced, stops, run, Moment(plain(0), 0.0, plain(0)))
    return runs.OK


@kernel
def put_between_stops(problem: CellProblem, stops: Stops, u: Floats, rests: bool) -> int:
    """Move a state u (N, 2) at phase 0 onto the stop that the contact is on or beyond, and return that stop, or 0.

    The contact bounces off the stop if it moves into it; `rests`: it has no velocity there.
    """
    x, v = contact_motion(problem, u, *reference_at_half(problem, plain(0)))
    if -stops.left < x < stops.right:
        return 0
    stop = 1 if x >= stops.right else -1
    moved, jump = stop * gap_of(stops, stop) - x, 0.0
    if rests:
        jump = -v
    elif stop * v > 0.0:
        jump = -(1.0 + restitution_of(stops, stop)) * v
    for j in range(u.shape[0]):
        for c in range(2):
            u[j, c] += problem.unit_displacement[j, c] * moved + problem.unit_impulse[j, c] * jump
    return stop
