"""The motion through one cell, impact by impact, while the contact does not rest on a stop.

Only cells that may have a contact are computed here. The workspace receives the regime at the end of the cell
(`cursor`) and the impacts (`tally` and `events`).
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import workspace
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    add_reference_series,
    advance_cell,
    contact_acceleration_of,
    contact_motion,
    expand,
    flow_state,
    reference_at,
)
from grazemap_core.contact.kernels.first_contact import enter_passage, first_contact, gap_and_rate
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.contact.kernels.workspace import Workspace, record_event
from grazemap_core.contact.tolerances import ANCHORED_GAP, CHATTER_ACCURACY, HALF_PERIOD_IMPACTS
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
def impact_at_stop(problem: CellProblem, stops: Stops, u: Floats, contact: Contact, work: Workspace) -> bool:
    """Apply the impact law on a stop, and return whether the contact may come to rest there.

    The state is changed in place, the impact recorded in tally and events.
    """
    stop, velocity, acceleration, half, time = contact
    restitution = restitution_of(stops, stop)
    jump = -(1.0 + restitution) * velocity
    for j in range(u.shape[0]):
        for k in range(2):
            total, lost = two_sum(u[j, k], problem.unit_impulse[j, k] * jump)
            u[j, k] = total + (lost + problem.unit_impulse_low[j, k] * jump)
    work.tally[workspace.RIGHT_IMPACTS if stop > 0 else workspace.LEFT_IMPACTS] += 1.0
    work.tally[workspace.FOLLOWED] += 1.0
    work.tally[workspace.MIN_SPEED] = min(work.tally[workspace.MIN_SPEED], abs(velocity))
    record_event(work, half, time, stop, velocity, workspace.IMPACT if velocity != 0.0 else workspace.GRAZE, u)
    work.cursor[workspace.ANCHOR] = stop
    work.near[workspace.ANCHOR_GAP] = 0.0
    work.near[workspace.ANCHOR_RATE] = restitution * abs(velocity)
    work.cursor[workspace.ZERO_ORDER] = 1 if work.near[workspace.ANCHOR_RATE] > 0.0 else 2
    contact_acceleration = stop * contact_acceleration_of(problem, u, acceleration)
    if contact_acceleration <= 0.0:
        work.tally[workspace.MIN_UNPRESSED_SPEED] = min(work.tally[workspace.MIN_UNPRESSED_SPEED], abs(velocity))
    return may_rest(restitution, problem.step, contact_acceleration, work.near[workspace.ANCHOR_RATE])


@kernel
def run_cell(
    problem: CellProblem, stops: Stops, u: Floats, cell: int, offset: float, half: int, work: Workspace
) -> int:
    """Advance a state to the end of a cell through all impacts in it.

    Parameters
    ----------
    u : (N, 2)
        Free state at the given offset; changed in place.
    cell : int
        Index of the cell in the forcing period.
    offset : float
        Time of the state since the start of the cell.
    half : int
        Index of the half period, for the record.
    work : Workspace
        Changed in place.

    Returns
    -------
    status : OK at the end of the cell, IMPACT_BUDGET_SPENT, NOT_FINITE, or AT_STOP with the offset in work.near.
    """
    if work.cursor[workspace.HELD] != 0:
        work.near[workspace.CELL_OFFSET] = offset
        return workspace.AT_STOP
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
            return workspace.OK
        size, tail, rest = expand(problem, u, problem.omega, (real, imag), length, work.taylor, work.terms)
        if resonant:
            more, more_tail = add_reference_series(problem, cell, offset, length, work.taylor, work.distance)
            size, tail, rest = size + more, tail + more_tail, rest + problem.reference_rest
        if not np.isfinite(size):
            return workspace.NOT_FINITE
        if work.tally[workspace.FOLLOWED] > HALF_PERIOD_IMPACTS + stops.chatter_impacts:
            return workspace.IMPACT_BUDGET_SPENT
        anchor = work.cursor[workspace.ANCHOR]
        stop, t = first_contact(work, stops, length, size, tail, rest)
        enter_passage(work, stops, t)
        if stop == 0:
            if offset == 0.0:
                advance_cell(problem, u, cell + 1)
            else:
                flow_state(problem, u, length)
            if anchor != 0:
                gap, rate = gap_and_rate(work.taylor, work.near, work.cursor[workspace.ZERO_ORDER], anchor, length, 1.0)
                # whether the parabola through both rates returns to the stop within the next cell
                second_derivative = 0.5 * (rate - work.near[workspace.ANCHOR_RATE]) / length
                ahead = gap + problem.step * (rate + problem.step * second_derivative)
                near = gap < ANCHORED_GAP * stops.unit or ahead < 0.0
                work.cursor[workspace.ANCHOR] = anchor if near else 0
                work.cursor[workspace.ZERO_ORDER] = 0
                work.near[workspace.ANCHOR_GAP] = gap
                work.near[workspace.ANCHOR_RATE] = rate
            return workspace.OK
        passed = t * length
        flow_state(problem, u, passed)
        offset += passed
        real, imag, acceleration = reference_at(problem, cell, offset)
        if stop == anchor:
            _, rate = gap_and_rate(work.taylor, work.near, work.cursor[workspace.ZERO_ORDER], stop, length, t)
            velocity = -stop * rate
        else:
            _, velocity = contact_motion(problem, u, real, imag)
        if velocity * stop < 0.0:
            velocity = 0.0  # a graze to within round-off
        if impact_at_stop(problem, stops, u, Contact(stop, velocity, acceleration, half, before + offset), work):
            work.near[workspace.CELL_OFFSET] = offset
            return workspace.AT_STOP
        if resonant:
            real, imag = 0.0, 0.0
