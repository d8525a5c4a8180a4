"""A trajectory over half a forcing period, cell by cell.

`maps.kernels.lockstep` does the same for many trajectories at once.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.codes import NO_STICKING_FLOW, OVERFLOW, TOO_MANY_IMPACTS
from grazemap_core.contact.kernels import workspace
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    advance_cell,
    begin_half_period,
    bounds,
    carry,
    contact_motion,
    flow_state,
    free_reach,
    reference_at_half,
)
from grazemap_core.contact.kernels.event_loop import run_cell
from grazemap_core.contact.kernels.first_contact import is_clear
from grazemap_core.contact.kernels.sticking import rest_in_cell, write_free_state
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.kernels.workspace import Workspace, clear_tally, record_event
from grazemap_core.contact.tolerances import CONTACT_ROUNDING
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel


@kernel
def record_graze(problem: CellProblem, u: Floats, end: float, half: int, work: Workspace) -> None:
    """Record the graze of work.near as an event, unless it continues the last event.

    Parameters
    ----------
    u : (N, 2)
        State at the end of the cell; not changed.
    end : float
        Time in the half period at which the cell ends.
    """
    stop, back = work.near[workspace.GRAZE_STOP], work.near[workspace.GRAZE_BACK]
    work.near[workspace.GRAZE_STOP] = 0.0
    time = end - back
    row = work.cursor[workspace.EVENT_COUNT]
    if 0 < row <= work.events.shape[0]:
        last = work.events[row - 1]
        since = (half - last[workspace.HALF]) * (0.5 * problem.cells * problem.step) + (time - last[workspace.TIME])
        if last[workspace.KIND] == workspace.GRAZE and last[workspace.STOP] == stop and since < problem.step:
            work.tally[workspace.UNDECIDED] -= 1.0
            return
    record_event(work, half, time, stop, 0.0, workspace.GRAZE, u)
    if row < work.events.shape[0]:
        flow_state(problem, work.events[row, workspace.EVENT_COLUMNS :].reshape(u.shape), -back)


@kernel
def run_half(problem: CellProblem, held: HeldProblem, stops: Stops, u: Floats, half: int, work: Workspace) -> int:
    """Advance a state over half a forcing period, in place, and return a status as `run_cell` does.

    If the contact rests on a stop at the end of the half period, u is the free state at that moment; the next half
    period continues from held.state instead.
    """
    cells = problem.cells // 2
    first = (half % 2) * cells
    longest = problem.flow_table.shape[0] - 1
    since = first  # at the start of this cell the state was work.saved
    copy_matrix(work.saved, u)
    x, v = contact_motion(problem, u, *reference_at_half(problem, half))
    reach, fourth = bounds(problem, u)
    rounding = CONTACT_ROUNDING * (reach + stops.unit)
    clear_tally(work.tally)
    for cell in range(first, first + cells):
        clear = False
        if work.cursor[workspace.ANCHOR] == 0:
            x_end, v_end = advance_cell(problem, u, cell + 1)
            clear = is_clear(x, v, x_end, v_end, problem.step, fourth, rounding, stops)
        if not clear:
            carry(problem, work.saved, cell - since, u)
            rows = work.cursor[workspace.EVENT_COUNT]
            work.near[workspace.GRAZE_STOP] = 0.0
            status = run_cell(problem, stops, u, cell, 0.0, half, work)
            if status == workspace.AT_STOP:
                status = rest_in_cell(problem, held, stops, u, cell, half, work)
            if status != workspace.OK:
                return status
            x_end, v_end = contact_motion(
                problem, u, problem.steady_table[cell + 1, 0], problem.steady_table[cell + 1, 1]
            )
            reach, fourth = bounds(problem, u)
            rounding = CONTACT_ROUNDING * (reach + stops.unit)
            if work.near[workspace.GRAZE_STOP] != 0.0:
                record_graze(problem, u, problem.step * (cell + 1 - first), half, work)
            if work.cursor[workspace.EVENT_COUNT] != rows:
                since = cell + 1
                copy_matrix(work.saved, u)
        x, v = x_end, v_end
        if cell + 1 - since == longest:
            carry(problem, work.saved, longest, work.saved)
            since = cell + 1
    carry(problem, work.saved, first + cells - since, u)
    begin_half_period(problem, u, half + 1)
    if work.cursor[workspace.HELD] != 0:
        write_free_state(problem, held, stops, u, first + cells, 0.0, work)
    return workspace.OK


@kernel
def reason_of_end(status: int) -> int:
    """Return the reason code of a trajectory that ended early with this status."""
    if status == workspace.NO_HELD_FLOW:
        return NO_STICKING_FLOW
    if status == workspace.IMPACT_BUDGET_SPENT:
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
