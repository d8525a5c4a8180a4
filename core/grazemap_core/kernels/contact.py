"""Contacts within one cell: the cheap certificate, and the careful walk where it does not hold.

The certificate: on a cell of length h the cubic Hermite interpolant of x1 errs by at most h^4/384 max|x1''''| and lies
in the convex hull of its Bernstein coefficients, so a cell whose four coefficients stay inside the stops by that much
has no contact. Otherwise x1 is expanded in a Taylor series and the first contact with either stop is found by
certified root isolation (`bernstein`). Behind an impact the series starts on the stop: the root there is divided out,
so a bounce of any smallness is resolved to full relative precision.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels.bernstein import CONTACT, GRAZE_UNDECIDED, MAX_DEPTH, first_negative
from grazemap_core.kernels.cells import CellProblem, expand, first_mass, flow_state, turned_gain
from grazemap_core.tolerances import (
    CHATTER_VELOCITY,
    CONTACT_ROUNDING,
    IMPACT_BUDGET,
    SHORT_DEGREE,
    TAYLOR_DEGREE,
)

FloatArray = NDArray[np.float64]

OK = 0
"""The trajectory goes on."""
COMPLETE_CHATTER = 1
"""Infinitely many impacts accumulate: mass 1 comes to rest on a stop that it is pressed against."""
IMPACT_BUDGET_SPENT = 2
"""More than IMPACT_BUDGET impacts in half a forcing period."""
NOT_FINITE = 3
"""A number overflowed."""

EVENT_COLUMNS = 4
"""Columns of an event before its state: index of the half period, time within it, stop, pre-impact velocity."""


class Workspace(NamedTuple):
    """Scratch of the contact search, and what a walk reports besides its state.

    `tally` holds, for the half period in progress: impacts on stop A, on stop C, least impact speed, contacts that
    round-off left undecided (taken as none). `cursor` holds the stop that mass 1 has just left (+1, -1, or 0) and the
    number of events seen. `events` has one row per impact, EVENT_COLUMNS + 2 N wide; rows beyond its end are counted
    in the cursor but not written.
    """

    taylor: FloatArray
    terms: FloatArray
    distance: FloatArray
    stack: FloatArray
    start: FloatArray
    width: FloatArray
    tally: FloatArray
    cursor: NDArray[np.int64]
    saved: FloatArray
    events: FloatArray


def workspace(blocks: int, events: int = 0) -> Workspace:
    """Return fresh scratch for an oscillator of `blocks` masses, with room for some events."""
    return Workspace(
        taylor=np.zeros(TAYLOR_DEGREE + 1),
        terms=np.zeros((blocks + 1, 4)),
        distance=np.zeros(TAYLOR_DEGREE + 1),
        stack=np.zeros((MAX_DEPTH + 2, TAYLOR_DEGREE + 1)),
        start=np.zeros(MAX_DEPTH + 2),
        width=np.zeros(MAX_DEPTH + 2),
        tally=np.zeros(4),
        cursor=np.zeros(2, dtype=np.int64),
        saved=np.zeros((blocks, 2)),
        events=np.zeros((events, EVENT_COLUMNS + 2 * blocks)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def is_clear(x0: float, v0: float, x1: float, v1: float, step: float, fourth: float, limit: float) -> bool:
    """Certify that a cell has no contact, from position and velocity at its ends and a bound of |x1''''|.

    `limit` is the clearance less the round-off of the positions.
    """
    third = step / 3.0
    square = step * step
    highest = max(max(abs(x0), abs(x0 + third * v0)), max(abs(x1 - third * v1), abs(x1)))
    return highest + square * square / 384.0 * fourth < limit  # a NaN is never clear


@njit(cache=True, nogil=True, error_model="numpy")
def first_contact(work: Workspace, clearance: float, stop_left: int, size: float, rest: float) -> tuple[int, float]:
    """Return (stop, t) of the first contact of the series work.taylor on [0, 1], or (0, 1.0).

    `stop_left` is the stop on which the series starts (+1, -1), or 0 when it starts between them.
    """
    stop_found = 0
    t_found = 1.0
    travel = 0.0
    for k in range(1, TAYLOR_DEGREE + 1):
        travel += abs(work.taylor[k])
    for stop in (1, -1):
        if stop == stop_left:
            # the distance is zero at t = 0 by definition: divide that root out
            degree = TAYLOR_DEGREE - 1
            for k in range(TAYLOR_DEGREE):
                work.distance[k] = -stop * work.taylor[k + 1]
            scale = size
        else:
            scale = size + clearance
            if stop * work.taylor[0] + travel + CONTACT_ROUNDING * scale + rest < clearance:
                continue  # out of reach
            degree = TAYLOR_DEGREE
            for k in range(TAYLOR_DEGREE + 1):
                work.distance[k] = -stop * work.taylor[k]
            work.distance[0] += clearance
        error = CONTACT_ROUNDING * scale + rest
        # a short series with what it leaves out added to the error decides nearly always, at a third of the cost
        left_out = error
        for k in range(SHORT_DEGREE + 1, degree + 1):
            left_out += abs(work.distance[k])
        status, t = first_negative(work.distance, degree, SHORT_DEGREE, left_out, work.stack, work.start, work.width)
        if status == GRAZE_UNDECIDED:
            status, t = first_negative(work.distance, degree, degree, error, work.stack, work.start, work.width)
            if status == GRAZE_UNDECIDED:
                work.tally[3] += 1.0
        if status == CONTACT and (stop_found == 0 or t < t_found):
            stop_found = stop
            t_found = t
    return stop_found, t_found


@njit(cache=True, nogil=True, error_model="numpy")
def strike(
    problem: CellProblem,
    u: FloatArray,
    clearance: float,
    stop: int,
    velocity: float,
    half: int,
    time: float,
    work: Workspace,
) -> None:
    """Apply the impact law to a state at a stop, in place, and enter the impact into tally and events."""
    jump = -(1.0 + problem.restitution) * velocity
    for j in range(u.shape[0]):
        u[j, 0] += problem.kick[j, 0] * jump
        u[j, 1] += problem.kick[j, 1] * jump
    work.tally[0 if stop > 0 else 1] += 1.0
    work.tally[2] = min(work.tally[2], abs(velocity))
    row = work.cursor[1]
    if row < work.events.shape[0]:
        work.events[row, 0] = half
        work.events[row, 1] = time
        work.events[row, 2] = stop
        work.events[row, 3] = velocity
        for j in range(u.shape[0]):
            work.events[row, EVENT_COLUMNS + 2 * j] = u[j, 0]
            work.events[row, EVENT_COLUMNS + 2 * j + 1] = u[j, 1]
    work.cursor[0] = stop
    work.cursor[1] = row + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _comes_to_rest(
    problem: CellProblem, work: Workspace, clearance: float, stop: int, length: float, size: float
) -> bool:
    """Say whether the motion that leaves a stop, expanded in work.taylor, ends in an infinite number of impacts there.

    The condition is sufficient: it leaves slowly, is pressed against the stop, and stays pressed throughout the time
    2 v / ((1 - R) a) that the remaining impacts take.
    """
    leaving = abs(work.taylor[1]) / length
    if problem.restitution >= 1.0 or leaving > CHATTER_VELOCITY * problem.omega * clearance:
        return False
    pressing = 2.0 * stop * work.taylor[2] / (length * length)
    if pressing * length * length <= CONTACT_ROUNDING * size:
        return False
    remaining = 2.0 * leaving / ((1.0 - problem.restitution) * pressing)
    slackening = 0.0
    power = remaining / length
    for k in range(3, TAYLOR_DEGREE + 1):
        slackening += k * (k - 1) * abs(work.taylor[k]) * power
        power *= remaining / length
    stays_pressed: bool = slackening < 0.5 * pressing * length * length
    return remaining < length and stays_pressed


@njit(cache=True, nogil=True, error_model="numpy")
def walk_cell(problem: CellProblem, u: FloatArray, clearance: float, cell: int, half: int, work: Workspace) -> int:
    """Carry a state over one cell through all its impacts.

    Parameters
    ----------
    u : (N, 2)
        State at the start of the cell; on return at its end, or where the trajectory ended. Changed in place.
    cell : int
        Index of the cell in the forcing period.
    half : int
        Index of the half period, for the record.
    work : Workspace
        Changed in place.

    Returns
    -------
    status : OK, COMPLETE_CHATTER, IMPACT_BUDGET_SPENT or NOT_FINITE.
    """
    offset = 0.0
    cells_of_half = problem.cells // 2
    before = problem.step * (cell % cells_of_half)
    gain_real, gain_imag = problem.gain[cell, 0], problem.gain[cell, 1]
    while True:
        length = problem.step - offset
        if length <= 0.0:
            return OK
        size, rest = expand(problem, u, gain_real, gain_imag, length, work.taylor, work.terms)
        if not np.isfinite(size):
            return NOT_FINITE
        stop_left = work.cursor[0]
        if stop_left != 0 and _comes_to_rest(problem, work, clearance, stop_left, length, size):
            return COMPLETE_CHATTER
        if work.tally[0] + work.tally[1] > IMPACT_BUDGET:
            return IMPACT_BUDGET_SPENT
        stop, t = first_contact(work, clearance, stop_left, size, rest)
        if stop == 0:
            flow_state(problem, u, length)
            work.cursor[0] = 0
            return OK
        passed = t * length
        flow_state(problem, u, passed)
        offset += passed
        gain_real, gain_imag = turned_gain(problem, cell, offset)
        _, velocity = first_mass(problem, u, gain_real, gain_imag)
        if velocity * stop < 0.0:
            velocity = 0.0  # a graze to within round-off
        strike(problem, u, clearance, stop, velocity, half, before + offset, work)
