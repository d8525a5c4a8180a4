"""Observables of all trajectories of a column, after the motions are known.

A verified orbit is computed from its impacts. Other periodic motions are followed from the final state of the
trajectory until they close; others are averaged from there.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem, Forced, contact_motion, reference_at_half
from grazemap_core.contact.kernels.runs import Run, put_on_stop
from grazemap_core.contact.kernels.sticking import put_between_stops, start_on_stop
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels.lane_state import FinalStates, stops_in_row
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel, plain
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.observed_motion import (
    ObservedOutputs,
    Totals,
    clear_totals,
    close_motion,
    observe_periods,
    observe_rows,
    write_orbit,
)
from grazemap_core.simulation.kernels.output_rows import OutputScratch
from grazemap_core.simulation.tolerances import CLOSING_RETURNS

NOT_OBSERVED, OF_ORBIT, STEADY_MOTION, CLOSING, AVERAGED = 0, 1, 2, 3, 4
"""What is read off: nothing; a verified orbit; the steady motion; a motion that closes; a mean over many periods."""


class ObservedColumn(NamedTuple):
    """Trajectories of a column whose motions are known."""

    kinds: Integers
    """(n,) What is read off."""
    periods: Integers
    """(n,) Over how many forcing periods."""
    stops: Floats
    """(m, fields of Stops) Trajectory i has the row ``i m // n``."""
    final: FinalStates
    """The states from which they go on."""
    contacts: Floats
    """(n, 5, 2) Receives the totals of the contacts."""
    outputs: Floats
    """(n, R, 4) Receives the totals of the outputs."""
    totals: Totals
    """Scratch for the totals of a trajectory."""
    scratch: OutputScratch
    """Scratch for its outputs."""
    rows: Floats
    """(MAX_ORBIT_IMPACTS, EVENT_COLUMNS + 2 N) Scratch for its events."""
    before: Floats
    """(N, 2) Scratch."""


@kernel
def observe_column(
    forced: Forced,
    whole: ObservedOutputs,
    partial: ObservedOutputs,
    column: ObservedColumn,
    run: Run,
    first: int,
) -> int:
    """Write the totals of the trajectories from `first` on.

    Parameters
    ----------
    whole, partial : ObservedOutputs
        Of states less the steady motion, and less the reference motion.

    Returns
    -------
    next : int
        The number of trajectories; or the one whose half periods have more events than `run`, from which to go on.
    """
    forced, column, run = reference(forced), reference(column), reference(run)
    problem = forced.free
    count = int(column.kinds.shape[0])
    each = count // column.stops.shape[0]
    for i in range(first, count):
        kind = column.kinds[i]
        stops = stops_in_row(column.stops, i // each)
        clear_totals(column.totals)
        status = runs.OK
        if kind in (OF_ORBIT, STEADY_MOTION):
            rows = _write_orbit(problem, stops, column, i, kind)
            end = (column.rows[0, runs.HALF] + 2.0 * column.periods[i], column.rows[0, runs.TIME])
            observe_rows(problem, whole, stops, column.rows[:rows], end, column.totals, column.scratch)
        elif kind != NOT_OBSERVED:
            status = _simulate(forced, partial, stops, column, i, run)
        if status == runs.RECORD_FULL:
            return i
        if status != runs.OK:
            column.periods[i] = 0
        copy_matrix(column.contacts[i], column.totals.contacts)
        copy_matrix(column.outputs[i], column.totals.outputs)
    return count


@kernel
def _write_orbit(problem: CellProblem, stops: Stops, column: ObservedColumn, i: int, kind: int) -> int:
    """Write the rows of one period of an orbit, or of the steady motion, and return their number."""
    if kind == STEADY_MOTION:
        column.rows[0, :] = 0.0
        return 1
    count, duration = int(column.final.counts[i]), column.periods[i] * problem.cells * problem.step
    write_orbit(problem, stops, column.final.impacts[i][:, :count], duration, column.rows)
    return count


@kernel
def _simulate(forced: Forced, observed: ObservedOutputs, stops: Stops, column: ObservedColumn, i: int, run: Run) -> int:
    """Add a motion that is simulated from the final state of a trajectory to the totals; return a status."""
    u, final = run.u, column.final
    for j in range(u.shape[0]):
        u[j, 0], u[j, 1] = final.states[i, 2 * j], final.states[i, 2 * j + 1]
    status = _begin(forced, stops, run, int(final.resting_stop[i]))
    if status == runs.OK and column.kinds[i] == CLOSING:
        status = close_motion(forced, stops, run, column.periods[i], CLOSING_RETURNS, column.before)
    if status != runs.OK:
        return status
    return observe_periods(forced, stops, run, column.periods[i], observed, column.totals, column.scratch)


@kernel
def _begin(forced: Forced, stops: Stops, run: Run, rests: int) -> int:
    """Begin a trajectory at the state of a run, at phase 0; a contact that is beyond a stop is put on it."""
    problem, u = forced.free, run.u
    run.cursor[:] = 0
    run.near[:] = 0.0
    if rests != 0:
        return start_on_stop(forced, stops, run, rests)
    stop = put_between_stops(problem, stops, u, False)
    if stop == 0:
        return runs.OK
    _, v = contact_motion(problem, u, *reference_at_half(problem, plain(0)))
    if v == 0.0:
        return start_on_stop(forced, stops, run, stop)
    put_on_stop(run.cursor, run.near, stop, abs(v))
    return runs.OK
