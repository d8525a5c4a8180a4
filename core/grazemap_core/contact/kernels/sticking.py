"""Mass 1 at rest on a stop: how it comes to rest, through infinitely many impacts or at once, and how it leaves.

Pressed against the stop, mass 1 bounces ever lower and comes to rest after infinitely many impacts in a finite time.
With pressing a > 0 (what mass 1 at rest would be accelerated by toward the stop), its rate a', the drag C_11/m_1 and
q = R v/(1 - R), v the speed before an impact, the bounces still to come take

    2 q/a - (2 drag/(3 a^2) + 4 a'/(3 a^3)) q^2 + O(v^3)

and leave the other masses where the held flow from that impact takes them, to O(v^3). Once that is exact to
CHATTER_ACCURACY the bounces are no longer followed. Mass 1 stays at rest until the pressing *crosses* zero; a touch is
no release.

References
----------
A. B. Nordmark, P. T. Piiroinen, "Simulation and stability analysis of impacting systems with complete chattering",
Nonlinear Dynamics 58 (2009) 85-106.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem, first_acceleration, sum_series, turned_gain
from grazemap_core.contact.kernels.event_loop import walk_cell
from grazemap_core.contact.kernels.events import enter_event
from grazemap_core.contact.kernels.sticking_flow import HeldProblem, flow_held, hold, let_go, turned
from grazemap_core.contact.kernels.workspace import (
    ANCHOR,
    AT_STOP,
    CHATTER,
    DELAY,
    EVENT_COLUMNS,
    HELD,
    HELD_LEFT,
    HELD_RIGHT,
    IMPACT_AND_REST,
    KIND,
    LEAST_SPEED,
    LEFT,
    NO_HELD_FLOW,
    OK,
    RELEASE,
    RIGHT,
    ROOTS,
    ROWS,
    UNDECIDED,
    Workspace,
)
from grazemap_core.contact.tolerances import CHATTER_ACCURACY, CONTACT_ROUNDING
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.kernels.bernstein import CONTACT, GRAZE_UNDECIDED, first_negative
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE


@kernel
def expand_pressing(
    problem: CellProblem,
    held: HeldProblem,
    clearance: float,
    stop: int,
    cell: int,
    offset: float,
    length: float,
    work: Workspace,
) -> float:
    """Write the series of the pressing over the coming `length`, scaled to t in [0, 1], into work.distance.

    `offset` is the time since the start of the cell. Returns a bound of the error of its Bernstein coefficients.
    """
    terms = work.terms
    blocks = held.state.shape[0]
    for j in range(blocks):
        first, second = held.state[j, 0], held.state[j, 1]
        terms[j, 0] = held.output_row[j, 0] * first + held.output_row[j, 1] * second
        terms[j, 1] = (held.output_row[j, 2] * first + held.output_row[j, 3] * second) * length
        terms[j, 2] = 2.0 * held.decay[j] * length
        terms[j, 3] = held.frequency_squared[j] * length * length
    gain_real, gain_imag = turned(held.steady_table, cell, problem.omega * offset)
    terms[blocks, 0] = gain_imag
    terms[blocks, 1] = problem.omega * gain_real * length
    terms[blocks, 2] = 0.0
    terms[blocks, 3] = (problem.omega * length) ** 2
    size, _, rest = sum_series(terms, blocks, work.distance)
    inward = held.inward * clearance
    for k in range(TAYLOR_DEGREE + 1):
        work.distance[k] *= stop
    work.distance[0] -= inward
    return CONTACT_ROUNDING * (size + inward) + rest


@kernel
def begin_rest(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    stop: int,
    leaving: float,
    cell: int,
    offset: float,
    half: int,
    time: float,
    work: Workspace,
) -> tuple[bool, float]:
    """Let mass 1, on a stop, come to rest there if it does so before anything else can happen.

    Parameters
    ----------
    u : (N, 2)
        Free state on the stop. Left as it is: at rest the state is held.state.
    leaving : float
        Speed at which mass 1 leaves the stop; 0 at rest.
    cell, offset, half, time
        Where the walk stands: the cell of the forcing period, the time since its start, the half period and the time
        since its start.

    Returns
    -------
    rests : bool
    delay : float
        By how much later it is at rest.
    """
    angle_real, angle_imag = turned(held.turn, cell, problem.omega * offset)
    hold(held, u, stop * clearance, problem.omega, angle_real, angle_imag, held.physical, held.state)
    error = expand_pressing(problem, held, clearance, stop, cell, offset, problem.step, work)
    contact_acceleration = work.distance[0]
    delay = 0.0
    if leaving > 0.0:
        if not contact_acceleration > error:
            return False, 0.0
        q = leaving / (1.0 - problem.restitution)
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
    work.cursor[ANCHOR] = stop
    work.cursor[HELD] = stop
    held.since[0] = half
    held.since[1] = time + delay
    work.tally[HELD_RIGHT if stop > 0 else HELD_LEFT] = 1.0
    return True, delay


@kernel
def rest_behind_impact(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    cell: int,
    offset: float,
    half: int,
    work: Workspace,
) -> int:
    """Behind an impact, go over to rest if the bounces still to come may be summed up. Returns OK or NO_HELD_FLOW."""
    stop, leaving = work.cursor[ANCHOR], work.near[1]
    if not held.exists:
        _, gain_imag = turned_gain(problem, cell, offset)
        return NO_HELD_FLOW if stop * first_acceleration(problem, u, gain_imag) > 0.0 else OK
    time = problem.step * (cell % (problem.cells // 2)) + offset
    rests, delay = begin_rest(problem, held, u, clearance, stop, leaving, cell, offset, half, time, work)
    if not rests:
        return OK
    if leaving > 0.0:
        work.tally[RIGHT if stop > 0 else LEFT] = np.inf
        work.tally[LEAST_SPEED] = 0.0
    row = work.cursor[ROWS] - 1  # of this impact
    if 0 <= row < work.events.shape[0]:
        work.events[row, KIND] = CHATTER if leaving > 0.0 else IMPACT_AND_REST
        work.events[row, DELAY] = delay
        for j in range(held.state.shape[0]):
            work.events[row, EVENT_COLUMNS + 2 * j] = held.state[j, 0]
            work.events[row, EVENT_COLUMNS + 2 * j + 1] = held.state[j, 1]
    return OK


@kernel
def rest_on(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    cell: int,
    offset: float,
    half: int,
    work: Workspace,
) -> float:
    """Carry a resting mass 1 to the end of the cell, or to its release; u is the free state then only.

    Returns the time since the start of the cell. After a release work.cursor[HELD] is 0.
    """
    stop = work.cursor[HELD]
    length = problem.step - offset
    error = expand_pressing(problem, held, clearance, stop, cell, offset, length, work)
    work.tally[HELD_RIGHT if stop > 0 else HELD_LEFT] = 1.0
    # at rest the pressing may begin at zero to within round-off; it is released only where it turns negative
    degree = plain(TAYLOR_DEGREE)
    status, t = first_negative(work.distance, degree, degree, error, work.stack, work.start, work.width)
    if status != CONTACT:
        if status == GRAZE_UNDECIDED:
            work.tally[UNDECIDED] += 1.0
        flow_held(held, held.state, length)
        return problem.step
    passed = t * length
    flow_held(held, held.state, passed)
    offset += passed
    free_of_rest(problem, held, u, clearance, cell, offset, work)
    work.cursor[HELD] = 0
    work.cursor[ROOTS] = 3
    before = problem.step * (cell % (problem.cells // 2))
    enter_event(work, half, before + offset, stop, 0.0, RELEASE, u)
    return offset


@kernel
def free_of_rest(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    cell: int,
    offset: float,
    work: Workspace,
) -> None:
    """Write the free state of a resting mass 1 into u (N, 2)."""
    angle_real, angle_imag = turned(held.turn, cell, problem.omega * offset)
    place = work.cursor[HELD] * clearance
    let_go(held, held.state, place, problem.omega, angle_real, angle_imag, held.physical, u)


@kernel
def start_on_stop(
    problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, stop: int, work: Workspace
) -> int:
    """Enter a start at rest on a stop: pressed it stays, else it leaves. Returns OK or NO_HELD_FLOW."""
    work.cursor[ANCHOR] = stop
    work.cursor[ROOTS] = 2
    work.near[0] = 0.0
    work.near[1] = 0.0
    if not held.exists:
        return NO_HELD_FLOW if stop * first_acceleration(problem, u, problem.steady_table[0, 1]) > 0.0 else OK
    begin_rest(problem, held, u, clearance, stop, 0.0, plain(0), 0.0, plain(0), 0.0, work)
    return OK


@kernel
def rest_in_cell(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    cell: int,
    half: int,
    work: Workspace,
) -> int:
    """Go on where `walk_cell` returned AT_STOP, to the end of the cell. Statuses as `walk_cell`, or NO_HELD_FLOW.

    u (N, 2) is the free state there and, unless mass 1 rests, at the end.
    """
    status = AT_STOP
    while status == AT_STOP:
        offset = work.near[2]
        if work.cursor[HELD] == 0:
            status = rest_behind_impact(problem, held, u, clearance, cell, offset, half, work)
            if status != OK:
                return status
        if work.cursor[HELD] != 0:
            offset = rest_on(problem, held, u, clearance, cell, offset, half, work)
            if work.cursor[HELD] != 0:
                return OK
        status = walk_cell(problem, u, clearance, cell, offset, half, work)
    return status
