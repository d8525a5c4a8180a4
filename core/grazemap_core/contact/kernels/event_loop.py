"""The motion through one cell, impact by impact, while the contact does not rest on a stop.

Only cells that may have a contact are computed here. The run receives the regime at the end of the cell
(`cursor`) and the impacts (`tally` and `events`).
"""

from __future__ import annotations

import numpy as np

from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    add_reference_series,
    advance_cell,
    contact_acceleration_of,
    contact_motion,
    expand,
    reference_at,
)
from grazemap_core.contact.kernels.first_contact import enter_passage, first_contact, gap_and_rate
from grazemap_core.contact.kernels.runs import Moment, Run, record_event
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.contact.tolerances import ANCHORED_GAP, CHATTER_ACCURACY, HALF_PERIOD_IMPACTS
from grazemap_core.model.kernels.block_flow import flow_state
from grazemap_core.numerics.jit.compiled import inlined, kernel
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
    record_event(run, half, time, stop, velocity, runs.IMPACT if velocity != 0.0 else runs.GRAZE, u)
    run.cursor[runs.ANCHOR] = stop
    run.near[runs.ANCHOR_GAP] = 0.0
    run.near[runs.ANCHOR_RATE] = restitution * abs(velocity)
    run.cursor[runs.ZERO_ORDER] = 1 if run.near[runs.ANCHOR_RATE] > 0.0 else 2
    contact_acceleration = stop * contact_acceleration_of(problem, u, acceleration)
    if contact_acceleration <= 0.0:
        run.tally[runs.MIN_UNPRESSED_SPEED] = min(run.tally[runs.MIN_UNPRESSED_SPEED], abs(velocity))
    return may_rest(restitution, problem.step, contact_acceleration, run.near[runs.ANCHOR_RATE])


@kernel
def run_cell(problem: CellProblem, stops: Stops, run: Run, moment: Moment) -> int:
    """Advance a run to the end of a cell through all impacts in it; its free state is that of the moment.

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
                flow_state(problem, u, length)
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
        flow_state(problem, u, passed)
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
