"""A trajectory over half a forcing period: cell by cell, and impact by impact in the cells that may have a contact.

The run receives the regime at the end of a cell (`cursor`) and the impacts (`tally` and `events`).
`maps.kernels.lockstep` does the same for many trajectories at once.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.codes import NO_STICKING_FLOW, OVERFLOW, TOO_MANY_IMPACTS
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    Forced,
    add_reference_series,
    advance_cell,
    begin_half_period,
    bounds,
    carry,
    contact_acceleration_of,
    contact_motion,
    expand,
    free_reach,
    reference_at,
    reference_at_half,
)
from grazemap_core.contact.kernels.first_contact import enter_passage, first_contact, gap_and_rate, is_clear
from grazemap_core.contact.kernels.runs import Moment, Run, clear_tally, put_on_stop, record_event
from grazemap_core.contact.kernels.sticking import carry_rest, rest_after_impact, write_free_state
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.contact.tolerances import (
    ANCHORED_GAP,
    CHATTER_ACCURACY,
    CONTACT_ROUNDING,
    HALF_PERIOD_IMPACTS,
)
from grazemap_core.model.kernels.block_flow import advance_state
from grazemap_core.numerics.jit.compiled import copy_matrix, inlined, kernel
from grazemap_core.numerics.kernels.double_double import two_sum
from grazemap_core.records import NamedTuple


@kernel
def may_rest(restitution: float, step: float, contact_acceleration: float, leaving: float) -> bool:
    """Return whether the contact may come to rest after an impact: a necessary condition that is cheap to compute.

    `contact_acceleration` is the acceleration toward the stop after the impact, `leaving` the speed.
    """
    if leaving == 0.0:
        return True
    share = 2.0 * leaving / ((1.0 - restitution) * contact_acceleration * step)
    slow: bool = share > 0.0 and share * share * share <= CHATTER_ACCURACY
    return restitution < 1.0 and slow


class Contact(NamedTuple):
    """A contact with a stop."""

    stop: int
    """+1 right, -1 left."""
    velocity: float
    """Velocity before the contact."""
    acceleration: float
    """Acceleration of the reference motion."""
    half: int
    """The half period of the contact."""
    time: float
    """Time of the contact since the start of the half period."""


@inlined
def impact_at_stop(problem: CellProblem, stops: Stops, run: Run, contact: Contact) -> bool:
    """Apply the impact law on a stop to a run, and return whether the contact may come to rest there.

    The impact is recorded in tally and events.
    """
    stop, velocity, acceleration, half, time = contact
    u = run.u
    restitution = restitution_of(stops, stop)
    jump = -(1.0 + restitution) * velocity
    for j in range(u.shape[0]):
        for k in range(2):
            total, lost = two_sum(u[j, k], problem.unit_impulse[j, k] * jump)
            u[j, k] = total + (lost + problem.unit_impulse_low[j, k] * jump)
    run.tally[runs.RIGHT_IMPACTS if stop > 0 else runs.LEFT_IMPACTS] += 1.0
    run.tally[runs.FOLLOWED] += 1.0
    run.tally[runs.MIN_SPEED] = min(run.tally[runs.MIN_SPEED], abs(velocity))
    record_event(run, half, time, stop, velocity, runs.IMPACT if velocity != 0.0 else runs.GRAZE)
    put_on_stop(run.cursor, run.near, stop, restitution * abs(velocity))
    contact_acceleration = stop * contact_acceleration_of(problem, u, acceleration)
    if contact_acceleration <= 0.0:
        run.tally[runs.MIN_UNPRESSED_SPEED] = min(run.tally[runs.MIN_UNPRESSED_SPEED], abs(velocity))
    return may_rest(restitution, problem.step, contact_acceleration, run.near[runs.ANCHOR_RATE])


@kernel
def run_cell(problem: CellProblem, stops: Stops, run: Run, moment: Moment) -> int:
    """Advance a run to the end of a cell through all impacts in it, unless the contact comes to rest.

    Its free state is that of the moment.

    Returns
    -------
    status : OK at the end of the cell, IMPACT_BUDGET_SPENT, NOT_FINITE, or AT_STOP with the offset in run.near.
    """
    cell, offset, half = moment
    u = run.u
    if run.cursor[runs.HELD] != 0:
        run.near[runs.CELL_OFFSET] = offset
        return runs.AT_STOP
    before = problem.step * (cell % (problem.cells // 2))
    resonant = problem.reference_series.shape[0] > 0
    real, imag = problem.steady_table[cell, 0], problem.steady_table[cell, 1]
    if resonant:
        real, imag = 0.0, 0.0  # `add_reference_series` has them
    elif offset > 0.0:
        real, imag, _ = reference_at(problem, cell, offset)
    while True:
        length = problem.step - offset
        if length <= 0.0:
            return runs.OK
        size, tail, rest = expand(problem, u, problem.omega, (real, imag), length, run.taylor, run.terms)
        if resonant:
            more, more_tail = add_reference_series(problem, cell, offset, length, run.taylor, run.distance)
            size, tail, rest = size + more, tail + more_tail, rest + problem.reference_rest
        if not np.isfinite(size):
            return runs.NOT_FINITE
        if run.tally[runs.FOLLOWED] > HALF_PERIOD_IMPACTS + stops.chatter_impacts:
            return runs.IMPACT_BUDGET_SPENT
        anchor = run.cursor[runs.ANCHOR]
        stop, t = first_contact(run, stops, length, size, tail, rest)
        enter_passage(run, stops, t)
        if stop == 0:
            if offset == 0.0:
                advance_cell(problem, u, cell + 1)
            else:
                advance_state(problem, u, length)
            if anchor != 0:
                gap, rate = gap_and_rate(run.taylor, run.near, run.cursor[runs.ZERO_ORDER], anchor, length, 1.0)
                # whether the parabola through both rates returns to the stop within the next cell
                second_derivative = 0.5 * (rate - run.near[runs.ANCHOR_RATE]) / length
                ahead = gap + problem.step * (rate + problem.step * second_derivative)
                near = gap < ANCHORED_GAP * stops.unit or ahead < 0.0
                run.cursor[runs.ANCHOR] = anchor if near else 0
                run.cursor[runs.ZERO_ORDER] = 0
                run.near[runs.ANCHOR_GAP] = gap
                run.near[runs.ANCHOR_RATE] = rate
            return runs.OK
        passed = t * length
        advance_state(problem, u, passed)
        offset += passed
        real, imag, acceleration = reference_at(problem, cell, offset)
        if stop == anchor:
            _, rate = gap_and_rate(run.taylor, run.near, run.cursor[runs.ZERO_ORDER], stop, length, t)
            velocity = -stop * rate
        else:
            _, velocity = contact_motion(problem, u, real, imag)
        if velocity * stop < 0.0:
            velocity = 0.0  # a graze to within round-off
        if impact_at_stop(problem, stops, run, Contact(stop, velocity, acceleration, half, before + offset)):
            run.near[runs.CELL_OFFSET] = offset
            return runs.AT_STOP
        if resonant:
            real, imag = 0.0, 0.0


@kernel
def rest_in_cell(forced: Forced, stops: Stops, run: Run, cell: int, half: int) -> int:
    """Advance a run to the end of the cell after AT_STOP. Returns a status of `run_cell`, or NO_HELD_FLOW."""
    status = runs.AT_STOP
    while status == runs.AT_STOP:
        offset = run.near[runs.CELL_OFFSET]
        if run.cursor[runs.HELD] == 0:
            status = rest_after_impact(forced, stops, run, Moment(cell, offset, half))
            if status != runs.OK:
                return status
        if run.cursor[runs.HELD] != 0:
            offset = carry_rest(forced, stops, run, Moment(cell, offset, half))
            if run.cursor[runs.HELD] != 0:
                return runs.OK
        status = run_cell(forced.free, stops, run, Moment(cell, offset, half))
    return status


@kernel
def record_graze(problem: CellProblem, run: Run, end: float, half: int) -> None:
    """Record the graze of run.near as an event, unless it continues the last event.

    The state is that at the end of the cell, which is `end` after the start of the half period.
    """
    u = run.u
    stop, back = run.near[runs.GRAZE_STOP], run.near[runs.GRAZE_BACK]
    run.near[runs.GRAZE_STOP] = 0.0
    time = end - back
    row = run.cursor[runs.EVENT_COUNT]
    if 0 < row <= run.events.shape[0]:
        last = run.events[row - 1]
        since = (half - last[runs.HALF]) * (0.5 * problem.cells * problem.step) + (time - last[runs.TIME])
        if last[runs.KIND] == runs.GRAZE and last[runs.STOP] == stop and since < problem.step:
            run.tally[runs.UNDECIDED] -= 1.0
            return
    record_event(run, half, time, stop, 0.0, runs.GRAZE)
    if row < run.events.shape[0]:
        advance_state(problem, run.events[row, runs.EVENT_COLUMNS :].reshape(u.shape), -back)


@kernel
def run_half(forced: Forced, stops: Stops, run: Run, half: int) -> int:
    """Advance a run over half a forcing period, and return a status as `run_cell` does.

    If the contact rests on a stop at the end of the half period, run.u is the free state at that moment; the next half
    period continues from run.held.state instead.
    """
    problem, u = forced.free, run.u
    cells = problem.cells // 2
    first = (half % 2) * cells
    longest = problem.flow_table.shape[0] - 1
    since = first  # at the start of this cell the state was run.saved
    copy_matrix(run.saved, u)
    x, v = contact_motion(problem, u, *reference_at_half(problem, half))
    reach, fourth = bounds(problem, u)
    rounding = CONTACT_ROUNDING * (reach + stops.unit)
    clear_tally(run.tally)
    for cell in range(first, first + cells):
        clear = False
        if run.cursor[runs.ANCHOR] == 0:
            x_end, v_end = advance_cell(problem, u, cell + 1)
            clear = is_clear(x, v, x_end, v_end, problem.step, fourth, rounding, stops)
        if not clear:
            carry(problem, run.saved, cell - since, u)
            rows = run.cursor[runs.EVENT_COUNT]
            run.near[runs.GRAZE_STOP] = 0.0
            status = run_cell(problem, stops, run, Moment(cell, 0.0, half))
            if status == runs.AT_STOP:
                status = rest_in_cell(forced, stops, run, cell, half)
            if status != runs.OK:
                return status
            x_end, v_end = contact_motion(
                problem, u, problem.steady_table[cell + 1, 0], problem.steady_table[cell + 1, 1]
            )
            reach, fourth = bounds(problem, u)
            rounding = CONTACT_ROUNDING * (reach + stops.unit)
            if run.near[runs.GRAZE_STOP] != 0.0:
                record_graze(problem, run, problem.step * (cell + 1 - first), half)
            if run.cursor[runs.EVENT_COUNT] != rows:
                since = cell + 1
                copy_matrix(run.saved, u)
        x, v = x_end, v_end
        if cell + 1 - since == longest:
            carry(problem, run.saved, longest, run.saved)
            since = cell + 1
    carry(problem, run.saved, first + cells - since, u)
    begin_half_period(problem, u, half + 1)
    if run.cursor[runs.HELD] != 0:
        write_free_state(forced, stops, run, first + cells, 0.0)
    return runs.OK


@kernel
def reason_of_end(status: int) -> int:
    """Return the reason code of a trajectory that ended early with this status."""
    if status == runs.NO_HELD_FLOW:
        return NO_STICKING_FLOW
    if status == runs.IMPACT_BUDGET_SPENT:
        return TOO_MANY_IMPACTS
    return OVERFLOW


@kernel
def counted(stops: Stops, impacts: float) -> float:
    """Return how many impacts of half a period count toward SETTLING_IMPACTS: all but those of complete chatter."""
    return max(0.0, impacts - stops.settling_chatter)


@kernel
def is_free_for_ever(problem: CellProblem, stops: Stops, reach: float, anchor: int) -> bool:
    """Return whether the envelope of the motion excludes all later contacts, so that it decays to the steady motion."""
    return problem.damped and anchor == 0 and reach < free_reach(problem, stops)
