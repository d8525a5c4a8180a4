"""Quantities of a motion that are read off its events and the states after them: impacts, impulses, losses, outputs.

The contact force while the contact rests is m_c times the contact acceleration, the output 0 at rest. A complete
chatter is summed: as `sticking` has it, the structure moves from the first of the summed impacts on as if the contact
rested, which takes the momentum m_c v and the energy m_c v^2/2 from the contact. By the balance of momentum all
impulses of the chatter, with the force of the rest after it, are m_c v and the integral of the contact force from that
impact on. The error is of third order in v, as that of the time at which the contact comes to rest.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem, Forced
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.runs import Run, rests, write_start
from grazemap_core.contact.kernels.stops import Stops, gap_of, restitution_of
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import SAME_SIGN, block_sum
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.output_rows import (
    HIGHEST,
    INTEGRAL,
    LOWEST,
    OutputRows,
    OutputScratch,
    observe_segment,
)
from grazemap_core.simulation.tolerances import CLOSED, CLOSING_FLOOR

IMPACT_COUNT, SPEEDS, TOP_SPEED, TOTAL_IMPULSE, LOSS = 0, 1, 2, 3, 4
"""Rows of `Totals.contacts`: number of impacts, infinite in complete chatter; sum of the speeds of those that are not
summed; largest speed; impulse; energy lost."""


class ObservedOutputs(NamedTuple):
    """R outputs of a motion."""

    free: OutputRows
    """With the contact free; output 0 is then 0."""
    held: OutputRows
    """With the contact at rest; output 0 is the acceleration that q would have if it were not held."""
    jumps: Floats
    """(R,) Change of each output by an impulse that changes q' by 1."""
    effective_mass: float
    """Impulse over the change of q' that it makes."""


class Totals(NamedTuple):
    """Sums over a part of a motion."""

    contacts: Floats
    """(5, 2) Sums for the right and for the left stop."""
    outputs: Floats
    """(R, 4) Columns as in `output_rows`."""


@kernel
def clear_totals(totals: Totals) -> None:
    """Begin new totals."""
    totals.contacts[:] = 0.0
    totals.outputs[:] = 0.0
    totals.outputs[:, HIGHEST] = -np.inf
    totals.outputs[:, LOWEST] = -np.inf


@kernel
def _add_contact(observed: ObservedOutputs, stops: Stops, row: Floats, totals: Totals, scratch: OutputScratch) -> None:
    """Add an event, at whose time `scratch.last` has the outputs before it."""
    kind, stop, velocity = row[runs.KIND], row[runs.STOP], row[runs.VELOCITY]
    if velocity == 0.0:  # a release, a graze, or the beginning of a record
        return
    side, speed = 0 if stop > 0 else 1, abs(velocity)
    mass, restitution = observed.effective_mass, restitution_of(stops, stop)
    contacts = totals.contacts
    contacts[IMPACT_COUNT, side] += np.inf if kind == runs.CHATTER else 1.0
    contacts[SPEEDS, side] += speed
    contacts[TOP_SPEED, side] = max(contacts[TOP_SPEED, side], speed)
    kept = 0.0 if rests(kind) else restitution
    contacts[TOTAL_IMPULSE, side] += (1.0 + kept) * mass * speed
    contacts[LOSS, side] += 0.5 * (1.0 - kept) * (1.0 + kept) * mass * speed * speed
    if kind == runs.CHATTER:
        for r in range(1, observed.jumps.shape[0]):  # the first bounce is not in the motion at rest
            y = scratch.last[r] - (1.0 + restitution) * velocity * observed.jumps[r]
            totals.outputs[r, HIGHEST] = max(totals.outputs[r, HIGHEST], y)
            totals.outputs[r, LOWEST] = max(totals.outputs[r, LOWEST], -y)


@kernel
def observe_rows(
    problem: CellProblem,
    observed: ObservedOutputs,
    stops: Stops,
    rows: Floats,
    end: tuple[float, float],
    totals: Totals,
    scratch: OutputScratch,
) -> None:
    """Add a part of a motion to the totals.

    Parameters
    ----------
    rows : (events, EVENT_COLUMNS + 2 N)
        Its beginning, then every event, with the states after them, as `recorded_run.sample_motion` takes them.
    end : (half, time)
        Half period of its end, and time since the start of this half period.
    """
    half_time = math.pi / problem.omega
    count = rows.shape[0]
    for k in range(count):
        row = rows[k]
        _add_contact(observed, stops, row, totals, scratch)
        half, time = end
        if k + 1 < count:
            half, time = rows[k + 1, runs.HALF], rows[k + 1, runs.TIME]
        length = (half - row[runs.HALF]) * half_time + (time - row[runs.TIME])
        if not length > 0.0:
            continue
        if rests(row[runs.KIND]):
            stop = row[runs.STOP]
            before = totals.outputs[0, INTEGRAL]
            place = stop * gap_of(stops, stop)
            observe_segment(problem, observed.held, row, place, length, 0, totals.outputs, scratch)
            force = stop * observed.effective_mass * (totals.outputs[0, INTEGRAL] - before)
            totals.contacts[TOTAL_IMPULSE, 0 if stop > 0 else 1] += force
        elif totals.outputs.shape[0] > 1:
            observe_segment(problem, observed.free, row, 0.0, length, 1, totals.outputs, scratch)


@kernel
def observe_periods(
    forced: Forced,
    stops: Stops,
    run: Run,
    periods: int,
    observed: ObservedOutputs,
    totals: Totals,
    scratch: OutputScratch,
) -> int:
    """Carry a run, at phase 0, over forcing periods, and add them to the totals.

    Returns
    -------
    status : OK, RECORD_FULL when half a period has more events than the record, or why the trajectory ended.
    """
    half_time = 0.5 * forced.free.cells * forced.free.step
    for half in range(2 * periods):
        run.cursor[runs.EVENT_COUNT] = 0
        write_start(run.events[0], run, half, half_time)
        run.cursor[runs.EVENT_COUNT] = 1
        status = run_half(forced, stops, run, half)
        rows = run.cursor[runs.EVENT_COUNT]
        if rows > run.events.shape[0]:
            return runs.RECORD_FULL
        if status != runs.OK:
            return status
        observe_rows(forced.free, observed, stops, run.events[:rows], (half + 1.0, 0.0), totals, scratch)
    return runs.OK


@kernel
def close_motion(forced: Forced, stops: Stops, run: Run, period: int, most: int, before: Floats) -> int:
    """Follow a periodic motion until it returns to within round-off, but at most for `most` of its periods.

    The run is at phase 0, `before` (N, 2) is scratch. Returns OK, or why the trajectory ended.
    """
    problem, u, last = forced.free, run.u, np.inf
    for _ in range(most):
        copy_matrix(before, u)
        for half in range(2 * period):
            run.cursor[runs.EVENT_COUNT] = 0
            status = run_half(forced, stops, run, half)
            if status != runs.OK:
                return status
        distance = 0.0
        for j in range(u.shape[0]):
            for c in range(2):
                distance += problem.displacement_scale[j, c] * abs(u[j, c] - before[j, c])
        if distance <= CLOSED * stops.unit or (distance >= last and distance <= CLOSING_FLOOR * stops.unit):
            break
        last = distance
    return runs.OK


@kernel
def write_orbit(problem: CellProblem, stops: Stops, impacts: Floats, duration: float, rows: Floats) -> None:
    """Write the rows of a periodic orbit from its first impact on, from the impacts of one period.

    The impacts are given, and what is between them decays, so errors do not grow from row to row, stable or not.

    Parameters
    ----------
    impacts : (3, k)
        Stops, phases in increasing order, and signed velocities before the impacts.
    duration : float
        The period.
    rows : (k, EVENT_COLUMNS + 2 N)
        As `observe_rows` takes them; states are less the steady motion.
    """
    count = impacts.shape[1]
    rows[:] = 0.0
    for i in range(count):
        half = math.floor(impacts[1, i] / math.pi)
        rows[i, runs.HALF] = half
        rows[i, runs.TIME] = (impacts[1, i] - half * math.pi) / problem.omega
        rows[i, runs.STOP], rows[i, runs.VELOCITY] = impacts[0, i], impacts[2, i]
        rows[i, runs.KIND] = runs.IMPACT
    for j in range(problem.decay.shape[0]):
        decay, discriminant, square = problem.decay[j], problem.discriminant[j], problem.frequency_squared[j]
        first, second = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        p, q, _ = block_sum(SAME_SIGN, decay, discriminant, square, 0.0, duration)
        repeated = first + p * first + q * second
        repeated_rate = second + p * second - q * (square * first + 2.0 * decay * second)
        place = runs.EVENT_COLUMNS + 2 * j
        for i in range(count):  # the state after the first impact, from all impacts up to it
            strength = -(1.0 + restitution_of(stops, impacts[0, i])) * impacts[2, i]
            since = 0.0 if i == 0 else duration - (impacts[1, i] - impacts[1, 0]) / problem.omega
            e11, e12, e21, e22 = block_flow(decay, discriminant, square, since)
            rows[0, place] += strength * (e11 * repeated + e12 * repeated_rate)
            rows[0, place + 1] += strength * (e21 * repeated + e22 * repeated_rate)
        for i in range(1, count):
            strength = -(1.0 + restitution_of(stops, impacts[0, i])) * impacts[2, i]
            since = (impacts[1, i] - impacts[1, i - 1]) / problem.omega
            e11, e12, e21, e22 = block_flow(decay, discriminant, square, since)
            before, rate = rows[i - 1, place], rows[i - 1, place + 1]
            rows[i, place] = e11 * before + e12 * rate + strength * first
            rows[i, place + 1] = e21 * before + e22 * rate + strength * second
