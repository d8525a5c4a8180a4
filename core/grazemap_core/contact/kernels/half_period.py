"""Whole trajectories: half period after half period, with or without a record of the impacts.

`run_half` is the one loop over cells; `settle` runs a trajectory until its motion can be named. One at a time;
`lockstep` and `column` run many.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.codes import BUDGET, NOT_HELD, OVERFLOWS
from grazemap_core.contact.kernels.cells import CellProblem, advance_cell, bounds, carry, first_mass, flow_state
from grazemap_core.contact.kernels.event_loop import walk_cell
from grazemap_core.contact.kernels.events import enter_event
from grazemap_core.contact.kernels.first_contact import is_clear
from grazemap_core.contact.kernels.sticking import free_of_rest, rest_in_cell
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import (
    ANCHOR,
    AT_STOP,
    EVENT_COLUMNS,
    GRAZE,
    GRAZE_BACK,
    GRAZE_STOP,
    HALF,
    HELD,
    IMPACT_BUDGET_SPENT,
    KIND,
    NO_HELD_FLOW,
    OK,
    ROWS,
    STOP,
    TIME,
    UNDECIDED,
    Workspace,
    clear_tally,
)
from grazemap_core.contact.tolerances import CLEARED, COMPLETE_CHATTERS, CONTACT_ROUNDING, LONGEST_CHATTER
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel


@kernel
def enter_graze(problem: CellProblem, u: Floats, end: float, half: int, work: Workspace) -> None:
    """Enter the graze of work.near into the events, unless it is the last event and goes on.

    Parameters
    ----------
    u : (N, 2)
        State at the end of the cell; left as it is.
    end : float
        Time in the half period at which the cell ends.
    """
    stop, back = work.near[GRAZE_STOP], work.near[GRAZE_BACK]
    work.near[GRAZE_STOP] = 0.0
    time = end - back
    row = work.cursor[ROWS]
    if 0 < row <= work.events.shape[0]:
        last = work.events[row - 1]
        since = (half - last[HALF]) * (0.5 * problem.cells * problem.step) + (time - last[TIME])
        if last[KIND] == GRAZE and last[STOP] == stop and since < problem.step:
            work.tally[UNDECIDED] -= 1.0
            return
    enter_event(work, half, time, stop, 0.0, GRAZE, u)
    if row < work.events.shape[0]:
        flow_state(problem, work.events[row, EVENT_COLUMNS:].reshape(u.shape), -back)


@kernel
def run_half(problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, half: int, work: Workspace) -> int:
    """Carry a state over half a forcing period, in place. Statuses as `walk_cell`.

    While mass 1 rests on a stop u is only where the half period ends: the free state at that moment, which the next
    half does not go on from.
    """
    cells = problem.cells // 2
    first = (half % 2) * cells
    longest = problem.flow_table.shape[0] - 1
    since = first  # the cell at whose start the state was work.saved
    copy_matrix(work.saved, u)
    x, v = first_mass(problem, u, problem.steady_table[first, 0], problem.steady_table[first, 1])
    reach, fourth = bounds(problem, u)
    limit = clearance - CONTACT_ROUNDING * (reach + clearance)
    clear_tally(work.tally)
    for cell in range(first, first + cells):
        clear = False
        if work.cursor[ANCHOR] == 0:
            x_end, v_end = advance_cell(problem, u, cell + 1)
            clear = is_clear(x, v, x_end, v_end, problem.step, fourth, limit)
        if not clear:
            carry(problem, work.saved, cell - since, u)
            rows = work.cursor[ROWS]
            work.near[GRAZE_STOP] = 0.0
            status = walk_cell(problem, u, clearance, cell, 0.0, half, work)
            if status == AT_STOP:
                status = rest_in_cell(problem, held, u, clearance, cell, half, work)
            if status != OK:
                return status
            x_end, v_end = first_mass(problem, u, problem.steady_table[cell + 1, 0], problem.steady_table[cell + 1, 1])
            reach, fourth = bounds(problem, u)
            limit = clearance - CONTACT_ROUNDING * (reach + clearance)
            if work.near[GRAZE_STOP] != 0.0:
                enter_graze(problem, u, problem.step * (cell + 1 - first), half, work)
            if work.cursor[ROWS] != rows:
                since = cell + 1
                copy_matrix(work.saved, u)
        x, v = x_end, v_end
        if cell + 1 - since == longest:
            carry(problem, work.saved, longest, work.saved)
            since = cell + 1
    carry(problem, work.saved, first + cells - since, u)
    if work.cursor[HELD] != 0:
        free_of_rest(problem, held, u, clearance, first + cells, 0.0, work)
    return OK


@kernel
def reason_of_end(status: int) -> int:
    """Return the reason code of a motion whose trajectory ended early with this status."""
    if status == NO_HELD_FLOW:
        return NOT_HELD
    if status == IMPACT_BUDGET_SPENT:
        return BUDGET
    return OVERFLOWS


@kernel
def counted(chatter_impacts: float, impacts: float) -> float:
    """Return how many of half a period's impacts count toward SETTLING_IMPACTS: not what complete chatter may take."""
    if chatter_impacts >= COMPLETE_CHATTERS * LONGEST_CHATTER:
        return impacts
    return max(0.0, impacts - chatter_impacts)


@kernel
def is_free_for_ever(problem: CellProblem, reach: float, anchor: int, clearance: float) -> bool:
    """Say whether the envelope of everything to come stays between the stops: no contact any more, and all decays."""
    return problem.damped and anchor == 0 and reach < CLEARED * clearance
