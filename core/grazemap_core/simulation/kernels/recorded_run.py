"""A trajectory with a record of its events, and samples of it in closed form.

A sample is computed from the last event before it, so errors do not accumulate.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.kernels.cells import Forced, forced_part
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.runs import (
    EVENT_COUNT,
    HALF,
    KIND,
    OK,
    RECORD_FULL,
    STOP,
    TIME,
    HeldRun,
    Run,
    copy_state,
    read_state,
    rests,
)
from grazemap_core.contact.kernels.sticking import held_motion, turn_to
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.model.kernels.block_flow import advance_state
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.numerics.kernels.double_double import TWO_PI, Pair, divide, two_prod
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, record_half_period


@njit(cache=True, nogil=True, error_model="numpy")
def run_recorded(
    forced: Forced, stops: Stops, run: Run, began: Run, halves_done: int, halves: int, ring: StroboscopicHistory
) -> tuple[int, int]:
    """Advance a run to `halves` half periods, with events recorded in run.events and half periods in the ring.

    The caller sets run.cursor and records half period 0 before the first call. `began` is scratch.

    Returns
    -------
    status : OK, RECORD_FULL when the record must be enlarged, or the status with which the trajectory ended.
    done : int
        Half periods completed. With RECORD_FULL the state is that after these, otherwise that at the end.
    """
    forced, stops, run, began = reference(forced), reference(stops), reference(run), reference(began)
    for half in range(halves_done, halves):
        copy_state(began, run)
        status = run_half(forced, stops, run, half)
        if run.cursor[EVENT_COUNT] > run.events.shape[0]:
            copy_state(run, began)
            return RECORD_FULL, half
        if status != OK:
            return status, half
        record_half_period(ring, half + 1, run)
    return OK, halves


class Moments(NamedTuple):
    """Times at which a motion is sampled, each array of shape (n,)."""

    row: Integers
    """The last event at or before each time."""
    half: Integers
    """Half forcing periods that have passed, an even number."""
    within: Floats
    """Time since the end of these half periods."""
    angle: Floats
    """The corresponding angle of the forcing."""


@njit(cache=True, nogil=True, error_model="numpy")
def split_times(times: Floats, omega: float) -> tuple[Integers, Floats]:
    """Return the whole forcing periods in each time (n,), and the remainders, to a few roundings of the times.

    The period is used with more digits than a double has, so that long times do not lose accuracy.
    """
    period, period_low = divide(TWO_PI, Pair(omega, 0.0))
    whole = np.empty(times.shape[0], dtype=np.int64)
    within = np.empty(times.shape[0])
    for n in range(times.shape[0]):
        whole[n] = int(times[n] / period)
        product, error = two_prod(float(whole[n]), period)
        within[n] = (times[n] - product) - error - whole[n] * period_low
    return whole, within


@njit(cache=True, nogil=True, error_model="numpy")
def events_before(rows: Floats, half: Integers, within: Floats, half_time: float) -> Integers:
    """Return the index of the last event at or before each of a list of increasing times (n,).

    Parameters
    ----------
    rows : (events, EVENT_COLUMNS + 2 N)
        As `sample_motion` takes them.
    half, within : (n,)
        As in `Moments`.
    half_time : float
        Duration of a half period.
    """
    places = np.empty(half.shape[0], dtype=np.int64)
    row = 0
    for n in range(half.shape[0]):
        while (
            row + 1 < rows.shape[0] and (rows[row + 1, HALF] - half[n]) * half_time + rows[row + 1, TIME] <= within[n]
        ):
            row += 1
        places[n] = row
    return places


@njit(cache=True, nogil=True, error_model="numpy")
def sample_motion(
    forced: Forced, shape: Floats, steady: Complexes, rows: Floats, stops: Stops, moments: Moments
) -> tuple[Floats, Floats]:
    """Return displacements from the static equilibrium and velocities, each (N, n), at given times.

    Parameters
    ----------
    shape : (N, N, 2)
        As in `ModalModel`.
    steady : complex (H, 2, N + 1)
        From `reference_response`, the initial phase included.
    rows : (events, EVENT_COLUMNS + 2 N)
        The start of the record, then its events in order of time, each with the state after it. The contact is free
        after IMPACT, GRAZE and RELEASE, and at rest after any other kind; in the summed impacts of a chatter it rests.
    """
    problem, held_problem = forced.free, forced.held
    row, half, within, angle = moments
    count = shape.shape[0]
    half_time = math.pi / problem.omega
    x = np.empty((count, row.shape[0]))
    v = np.empty((count, row.shape[0]))
    u = np.empty((count, 2))
    harmonics = problem.orders.shape[0]
    held = HeldRun(np.empty((count - 1, 2)), np.empty(2), np.empty((harmonics, 2)), np.empty(2 * count))
    for n in range(row.shape[0]):
        event = rows[row[n]]
        passed = (half[n] - event[HALF]) * half_time + (within[n] - event[TIME])
        if rests(event[KIND]):
            read_state(event, held.state)
            advance_state(held_problem, held.state, passed)
            turn_to(held_problem, held, 0, angle[n])
            held_motion(held_problem, held, event[STOP] * gap_of(stops, event[STOP]))
            for i in range(count):
                x[i, n] = held.physical[i]
                v[i, n] = held.physical[count + i]
            continue
        read_state(event, u)
        advance_state(problem, u, passed)
        forced_part(problem, u, int(event[HALF]), passed + event[TIME], 1.0)
        x[:, n] = 0.0
        v[:, n] = 0.0
        for h in range(problem.orders.shape[0]):
            order = problem.orders[h]
            c, s = math.cos(order * angle[n]), math.sin(order * angle[n])
            for i in range(count):
                x[i, n] += steady[h, 0, i].imag * c + steady[h, 0, i].real * s
                v[i, n] += order * problem.omega * (steady[h, 1, i].real * c - steady[h, 1, i].imag * s)
        for i in range(count):
            for j in range(count):
                a, b = shape[i, j, 0], shape[i, j, 1]
                second = -problem.frequency_squared[j] * u[j, 0] - 2.0 * problem.decay[j] * u[j, 1]
                x[i, n] += a * u[j, 0] + b * u[j, 1]
                v[i, n] += a * u[j, 1] + b * second
    return x, v
