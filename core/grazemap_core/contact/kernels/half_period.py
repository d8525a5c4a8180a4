"""A trajectory over half a forcing period, cell by cell.

`maps.kernels.lockstep` does the same for many trajectories at once.
"""

from __future__ import annotations

from grazemap_core.codes import NO_STICKING_FLOW, OVERFLOW, TOO_MANY_IMPACTS
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    Forced,
    advance_cell,
    begin_half_period,
    bounds,
    carry,
    contact_motion,
    free_reach,
    reference_at_half,
)
from grazemap_core.contact.kernels.event_loop import run_cell
from grazemap_core.contact.kernels.first_contact import is_clear
from grazemap_core.contact.kernels.runs import Moment, Run, clear_tally, record_event
from grazemap_core.contact.kernels.sticking import rest_in_cell, write_free_state
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.tolerances import CONTACT_ROUNDING
from grazemap_core.model.kernels.block_flow import flow_state
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel


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
    record_event(run, half, time, stop, 0.0, runs.GRAZE, u)
    if row < run.events.shape[0]:
        flow_state(problem, run.events[row, runs.EVENT_COLUMNS :].reshape(u.shape), -back)


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
