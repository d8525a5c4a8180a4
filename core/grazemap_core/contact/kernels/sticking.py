"""The contact at rest on a stop: how it comes to rest, by complete chatter or at once, and how it is released.

If the contact is accelerated toward the stop, it bounces with decreasing speed and comes to rest after infinitely many
impacts in a finite time (complete chatter). Let a > 0 be the *contact acceleration*, the acceleration toward the stop
that the contact at rest would have without the stop, a' its rate, d the viscous term and q = R v/(1 - R) with v
the speed before an impact. The remaining impacts take the time

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
from grazemap_core.contact.kernels import workspace
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    add_harmonic,
    contact_acceleration_of,
    contact_motion,
    expand,
    flow_state,
    forced_part,
    reference_at,
    reference_at_half,
)
from grazemap_core.contact.kernels.event_loop import run_cell
from grazemap_core.contact.kernels.sticking_flow import (
    HeldProblem,
    free_from_held,
    held_from_free,
    rotated_entry,
    turn_to,
)
from grazemap_core.contact.kernels.stops import Stops, gap_of, restitution_of
from grazemap_core.contact.kernels.workspace import Workspace, record_event, write_state
from grazemap_core.contact.tolerances import CHATTER_ACCURACY, CONTACT_ROUNDING
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.kernels.bernstein import BECOMES_NEGATIVE, GRAZE_UNDECIDED, first_negative
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE


@kernel
def expand_contact_acceleration(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    stop: int,
    cell: int,
    offset: float,
    length: float,
    work: Workspace,
) -> float:
    """Write the series of the contact acceleration over the next `length`, scaled to t in [0, 1], into work.distance.

    `offset` is the time since the start of the cell. Returns a bound of the error of its Bernstein coefficients.
    """
    frequency = held.orders[0] * problem.omega
    steady = rotated_entry(held.steady_table[0], cell, frequency * offset)
    size, _, rest = expand(held, held.state, frequency, steady, length, work.distance, work.terms)
    for h in range(1, held.orders.shape[0]):
        frequency = held.orders[h] * problem.omega
        steady = rotated_entry(held.steady_table[h], cell, frequency * offset)
        more, more_rest = add_harmonic(steady, frequency, length, work.distance)
        size, rest = size + more, rest + more_rest
    static_acceleration = held.static_acceleration * gap_of(stops, stop)
    for k in range(TAYLOR_DEGREE + 1):
        work.distance[k] *= stop
    work.distance[0] -= static_acceleration
    return CONTACT_ROUNDING * (size + abs(static_acceleration)) + rest


@kernel
def begin_rest(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    cell: int,
    offset: float,
    half: int,
    work: Workspace,
) -> tuple[bool, float]:
    """Bring the contact to rest on the anchor if the remaining impacts may be summed; held.state is then that at rest.

    Parameters
    ----------
    u : (N, 2)
        Free state on the stop; changed by round-off only.
    cell, offset, half
        Cell of the forcing period, time since its start, and index of the half period.
    work : Workspace
        Its anchor is the stop, and work.near[ANCHOR_RATE] the speed at which the contact leaves it; 0 at rest.

    Returns
    -------
    rests : bool
    delay : float
        Time until the contact is at rest.
    """
    stop, leaving = work.cursor[workspace.ANCHOR], work.near[workspace.ANCHOR_RATE]
    time = problem.step * (cell % (problem.cells // 2)) + offset
    turn_to(held, cell, problem.omega * offset)
    forced_part(problem, u, half, time, 1.0)
    held_from_free(held, u, stop * gap_of(stops, stop), problem.omega)
    forced_part(problem, u, half, time, -1.0)
    error = expand_contact_acceleration(problem, held, stops, stop, cell, offset, problem.step, work)
    contact_acceleration = work.distance[0]
    delay = 0.0
    if leaving > 0.0:
        if not contact_acceleration > error:
            return False, 0.0
        q = leaving / (1.0 - restitution_of(stops, stop))
        rate = work.distance[1] / problem.step
        share = 2.0 * q / (contact_acceleration * problem.step)
        change = 0.0
        power = share
        for k in range(1, TAYLOR_DEGREE + 1):
            change += abs(work.distance[k]) * power
            power *= share
        change /= contact_acceleration
        if not (change < 0.5 and share * (change + share) ** 2 <= CHATTER_ACCURACY):
            return False, 0.0
        second_derivative = 2.0 * held.viscous_term / (
            3.0 * contact_acceleration * contact_acceleration
        ) + 4.0 * rate / (3.0 * contact_acceleration**3)
        delay = 2.0 * q / contact_acceleration - second_derivative * q * q
    elif not contact_acceleration >= -error:
        return False, 0.0
    work.cursor[workspace.ANCHOR] = stop
    work.cursor[workspace.HELD] = stop
    held.since[0] = half
    held.since[1] = time + delay
    work.tally[workspace.HELD_RIGHT if stop > 0 else workspace.HELD_LEFT] = 1.0
    return True, delay


@kernel
def rest_after_impact(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    cell: int,
    offset: float,
    half: int,
    work: Workspace,
) -> int:
    """Bring the contact to rest after an impact if the remaining impacts may be summed. Returns OK or NO_HELD_FLOW."""
    stop, leaving = work.cursor[workspace.ANCHOR], work.near[workspace.ANCHOR_RATE]
    if not held.exists:
        _, _, acceleration = reference_at(problem, cell, offset)
        return (
            workspace.NO_HELD_FLOW if stop * contact_acceleration_of(problem, u, acceleration) > 0.0 else workspace.OK
        )
    rests, delay = begin_rest(problem, held, stops, u, cell, offset, half, work)
    if not rests:
        return workspace.OK
    if leaving > 0.0:
        work.tally[workspace.RIGHT_IMPACTS if stop > 0 else workspace.LEFT_IMPACTS] = np.inf
        work.tally[workspace.MIN_SPEED] = 0.0
    row = work.cursor[workspace.EVENT_COUNT] - 1  # of this impact
    if 0 <= row < work.events.shape[0]:
        work.events[row, workspace.KIND] = workspace.CHATTER if leaving > 0.0 else workspace.IMPACT_AND_REST
        work.events[row, workspace.DELAY] = delay
        write_state(work.events[row], held.state)
    return workspace.OK


@kernel
def carry_rest(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    cell: int,
    offset: float,
    half: int,
    work: Workspace,
) -> float:
    """Advance the state to the end of the cell, or to the release of the contact, and return the time in the cell.

    After a release work.cursor[HELD] is 0 and u is the free state; otherwise u is not changed.
    """
    stop = work.cursor[workspace.HELD]
    length = problem.step - offset
    error = expand_contact_acceleration(problem, held, stops, stop, cell, offset, length, work)
    work.tally[workspace.HELD_RIGHT if stop > 0 else workspace.HELD_LEFT] = 1.0
    # the contact acceleration may be zero to within round-off at the start; it is released where it turns negative
    degree = plain(TAYLOR_DEGREE)
    status, t = first_negative(work.distance, degree, degree, error, work.stack, work.start, work.width)
    if status != BECOMES_NEGATIVE:
        # where nothing moves and no force acts, nothing is undecided
        if status == GRAZE_UNDECIDED and error > 0.0:
            work.tally[workspace.UNDECIDED] += 1.0
        flow_state(held, held.state, length)
        return problem.step
    passed = t * length
    flow_state(held, held.state, passed)
    offset += passed
    write_free_state(problem, held, stops, u, cell, offset, work)
    work.cursor[workspace.HELD] = 0
    work.cursor[workspace.ZERO_ORDER] = 3
    before = problem.step * (cell % (problem.cells // 2))
    record_event(work, half, before + offset, stop, 0.0, workspace.RELEASE, u)
    return offset


@kernel
def write_free_state(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    cell: int,
    offset: float,
    work: Workspace,
) -> None:
    """Write the free state of a resting contact into u (N, 2)."""
    turn_to(held, cell, problem.omega * offset)
    stop = work.cursor[workspace.HELD]
    free_from_held(held, stop * gap_of(stops, stop), problem.omega, u)
    half = cell // (problem.cells // 2)
    forced_part(problem, u, half, problem.step * (cell - half * (problem.cells // 2)) + offset, -1.0)


@kernel
def start_on_stop(problem: CellProblem, held: HeldProblem, stops: Stops, u: Floats, stop: int, work: Workspace) -> int:
    """Start at rest on a stop; the contact stays there if pressed against it. Returns OK or NO_HELD_FLOW."""
    work.cursor[workspace.ANCHOR] = stop
    work.cursor[workspace.ZERO_ORDER] = 2
    work.near[workspace.ANCHOR_GAP] = 0.0
    work.near[workspace.ANCHOR_RATE] = 0.0
    if not held.exists:
        _, _, acceleration = reference_at(problem, plain(0), 0.0)
        return (
            workspace.NO_HELD_FLOW if stop * contact_acceleration_of(problem, u, acceleration) > 0.0 else workspace.OK
        )
    begin_rest(problem, held, stops, u, plain(0), 0.0, plain(0), work)
    return workspace.OK


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


@kernel
def rest_in_cell(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    cell: int,
    half: int,
    work: Workspace,
) -> int:
    """Advance a state to the end of the cell after AT_STOP. Returns a status of `run_cell`, or NO_HELD_FLOW.

    u (N, 2) is the free state; on return it is meaningless if the contact rests.
    """
    status = workspace.AT_STOP
    while status == workspace.AT_STOP:
        offset = work.near[workspace.CELL_OFFSET]
        if work.cursor[workspace.HELD] == 0:
            status = rest_after_impact(problem, held, stops, u, cell, offset, half, work)
            if status != workspace.OK:
                return status
        if work.cursor[workspace.HELD] != 0:
            offset = carry_rest(problem, held, stops, u, cell, offset, half, work)
            if work.cursor[workspace.HELD] != 0:
                return workspace.OK
        status = run_cell(problem, stops, u, cell, offset, half, work)
    return status
