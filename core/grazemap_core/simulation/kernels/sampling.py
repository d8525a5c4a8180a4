"""Samples of a trajectory in closed form, each from the last event before it: no sample inherits another's error."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem, flow_state
from grazemap_core.contact.kernels.sticking_flow import HeldProblem, flow_held, held_motion, turned
from grazemap_core.contact.kernels.workspace import EVENT_COLUMNS, GRAZE, HALF, IMPACT, KIND, RELEASE, STOP, TIME
from grazemap_core.numerics.kernels.double_double import two_prod

TURN_LOW = 2.4492935982947064e-16
"""2 pi less its rounding to a double."""


@njit(cache=True, nogil=True, error_model="numpy")
def split_times(times: Floats, omega: float) -> tuple[Integers, Floats]:
    """Return how many forcing periods fit into each time (n,), and what is left of it, to a few of its own roundings.

    A time that is long against the period leaves a remainder with the digits that the time itself has: the period is
    taken with more digits than a double.
    """
    turn = 2.0 * math.pi
    period = turn / omega
    product, error = two_prod(period, omega)
    period_low = ((turn - product) - error + TURN_LOW) / omega
    whole = np.empty(times.shape[0], dtype=np.int64)
    within = np.empty(times.shape[0])
    for n in range(times.shape[0]):
        whole[n] = int(times[n] / period)
        product, error = two_prod(float(whole[n]), period)
        within[n] = (times[n] - product) - error - whole[n] * period_low
    return whole, within


@njit(cache=True, nogil=True, error_model="numpy")
def events_before(rows: Floats, half: Integers, within: Floats, half_time: float) -> Integers:
    """Return which event is the last at or before each of some increasing moments (n,).

    Parameters
    ----------
    rows : (events, EVENT_COLUMNS + 2 N)
        As `sample_motion` takes them.
    half, within : (n,)
        The moments: half periods, and times since their starts.
    half_time : float
    """
    found = np.empty(half.shape[0], dtype=np.int64)
    row = 0
    for n in range(half.shape[0]):
        while (
            row + 1 < rows.shape[0] and (rows[row + 1, HALF] - half[n]) * half_time + rows[row + 1, TIME] <= within[n]
        ):
            row += 1
        found[n] = row
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def sample_motion(
    problem: CellProblem,
    held_problem: HeldProblem,
    shape: Floats,
    steady: Complexes,
    rows: Floats,
    clearance: float,
    row: Integers,
    half: Integers,
    within: Floats,
    angle: Floats,
) -> tuple[Floats, Floats]:
    """Return displacement and velocity of all masses, each (N, n), at given moments.

    Parameters
    ----------
    shape : (N, N, 2)
        Of the modal model.
    steady : complex (N,)
        Steady response of every mass, the initial phase included.
    rows : (events, EVENT_COLUMNS + 2 N)
        Where the record begins, then every event, with the states behind them; increasing in time. Behind an event of
        a kind other than IMPACT, GRAZE and RELEASE mass 1 is at rest, or on its last bounces, which count as rest.
    clearance : float
    row : (n,)
        The event before each moment.
    half, within, angle : (n,)
        The moments: even half periods, times since their starts, and these as angles of the forcing.
    """
    count = shape.shape[0]
    half_time = math.pi / problem.omega
    x = np.empty((count, row.shape[0]))
    v = np.empty((count, row.shape[0]))
    u = np.empty((count, 2))
    held = np.empty((count - 1, 2))
    physical = np.empty(2 * count)
    for n in range(row.shape[0]):
        event = rows[row[n]]
        passed = (half[n] - event[HALF]) * half_time + (within[n] - event[TIME])
        c, s = math.cos(angle[n]), math.sin(angle[n])
        if event[KIND] != IMPACT and event[KIND] != RELEASE and event[KIND] != GRAZE:
            for j in range(count - 1):
                held[j, 0] = event[EVENT_COLUMNS + 2 * j]
                held[j, 1] = event[EVENT_COLUMNS + 2 * j + 1]
            flow_held(held_problem, held, passed)
            cosine, sine = turned(held_problem.turn, 0, angle[n])
            held_motion(held_problem, held, event[STOP] * clearance, problem.omega, cosine, sine, physical)
            for i in range(count):
                x[i, n] = physical[i]
                v[i, n] = physical[count + i]
            continue
        for j in range(count):
            u[j, 0] = event[EVENT_COLUMNS + 2 * j]
            u[j, 1] = event[EVENT_COLUMNS + 2 * j + 1]
        flow_state(problem, u, passed)
        for i in range(count):
            x[i, n] = steady[i].imag * c + steady[i].real * s
            v[i, n] = problem.omega * (steady[i].real * c - steady[i].imag * s)
            for j in range(count):
                a, b = shape[i, j, 0], shape[i, j, 1]
                second = -problem.frequency_squared[j] * u[j, 0] - 2.0 * problem.decay[j] * u[j, 1]
                x[i, n] += a * u[j, 0] + b * u[j, 1]
                v[i, n] += a * u[j, 1] + b * second
    return x, v
