"""Contacts of a periodic motion with a stop between its impacts, found without sampling.

The distance of the contact from a stop can be negative between two impacts only where it has a minimum, that is, where
the displacement toward the stop has a maximum. All maxima that matter are found by bisection. In each cell the
displacement and its first two derivatives in the middle, with a bound on the third derivative from the blocks'
energies, decide for each stop whether the displacement stays below the largest maximum so far, is monotonic, is convex,
or is concave; then Newton's method finds its maximum. A cell in which none of these is certain is halved.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import gap_of
from grazemap_core.grazing.tolerances import CONTACT_ROUNDOFF, MAX_CELLS
from grazemap_core.model.kernels.block_flow import advance_block, block_flow
from grazemap_core.model.tolerances import BOUND_SAFETY
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel, plain
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.equations import (
    OrbitImpacts,
    OrbitProblem,
    highest_order,
    next_phase,
    rebound_of,
    steady_bound,
    steady_motion,
)
from grazemap_core.orbits.tolerances import (
    CELL_STACK,
    CONTACT_CELLS,
    MAXIMUM_ACCURACY,
    MAXIMUM_AT_IMPACT,
    MIN_CONTACT_CELL,
    STEPS_TO_MAXIMUM,
)
from grazemap_core.records import NamedTuple

NO_FURTHER_CONTACT = 0
"""The orbit has no contact with a stop other than its impacts."""
MEETS = 1
"""The orbit has another contact, or one of the impacts is virtual: the contact moves away from the stop before it."""
TOUCHES = 2
"""Round-off hides whether there is another contact."""
GIVEN_UP = 3
"""MAX_CELLS were not enough to decide."""

_TOO_MANY: Final = -1


class ContactScratch(NamedTuple):
    """Scratch of the search for contacts, for k impacts and N blocks."""

    flow_between: Floats
    """(k, N, 4) Each block's flow from every impact to the next one."""
    states: Floats
    """(4, N, 2) Each block's part in displacement and velocity of q after an impact, at the beginning of a cell, in its
    middle, and at an arbitrary time."""
    cell_flow: Floats
    """(N, 4) Each block's flow over half a cell."""
    stack: Floats
    """(CELL_STACK, 2) Beginnings and ends of the cells that are still to be searched."""


def contact_scratch(impacts: int, blocks: int) -> ContactScratch:
    """Return scratch for orbits of `impacts` impacts, of a structure with `blocks` blocks."""
    return ContactScratch(
        flow_between=np.zeros((impacts, blocks, 4)),
        states=np.zeros((4, blocks, 2)),
        cell_flow=np.zeros((blocks, 4)),
        stack=np.zeros((CELL_STACK, 2)),
    )


@kernel
def _write_flow(problem: OrbitProblem, time: float, flow: Floats) -> None:
    """Write the flow of each block over a time into flow (N, 4)."""
    for j in range(flow.shape[0]):
        flow[j, 0], flow[j, 1], flow[j, 2], flow[j, 3] = block_flow(
            problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
        )


@kernel
def apply_flow(flow: Floats, start: Floats, end: Floats) -> None:
    """Write the state of the blocks (N, 2) after a flow (N, 4) from start into end, which may be the same array."""
    for j in range(start.shape[0]):
        y, rate = start[j, 0], start[j, 1]
        end[j, 0] = flow[j, 0] * y + flow[j, 1] * rate
        end[j, 1] = flow[j, 2] * y + flow[j, 3] * rate


@kernel
def _advance(problem: OrbitProblem, start: Floats, angle: float, end: Floats) -> None:
    """Write into end (N, 2) the state of the blocks an angle later than start (N, 2)."""
    for j in range(start.shape[0]):
        end[j, 0], end[j, 1] = advance_block(problem, j, start[j, 0], start[j, 1], angle / problem.omega)


@kernel
def add_impulse(problem: OrbitProblem, impacts: OrbitImpacts, i: int, sign: float, state: Floats) -> None:
    """Change the state of the blocks (N, 2) by the impulse of impact i; `sign` is -1 for its mirror image."""
    impulse = -rebound_of(impacts.stops, impacts.sides[i]) * problem.omega * (sign * impacts.speeds[i])
    for j in range(state.shape[0]):
        state[j, 0] += impulse * problem.unit_impulse[j, 0]
        state[j, 1] += impulse * problem.unit_impulse[j, 1]


@kernel
def _state_after_first_impact(problem: OrbitProblem, impacts: OrbitImpacts, state: Floats) -> None:
    """Write each block's part in displacement and velocity of q just after the first impact into state (N, 2)."""
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    for j in range(state.shape[0]):
        state[j, 0], state[j, 1] = 0.0, 0.0
        for m in range(phases.shape[0]):
            time = (phases[0] - phases[m] + problem.turn) / problem.omega
            y, rate = advance_block(problem, j, problem.periodic_impulse[j, 0], problem.periodic_impulse[j, 1], time)
            strength = -problem.sign * rebound_of(stops, sides[m]) * problem.omega * speeds[m]
            state[j, 0] += strength * y
            state[j, 1] += strength * rate
    add_impulse(problem, impacts, 0, 1.0, state)


class Instant(NamedTuple):
    """A moment between two impacts."""

    start: float
    """Phase of the impact before it."""
    angle: float
    """Angle after that impact."""
    sine: float
    """Sine of the phase of the moment."""
    cosine: float
    """Cosine of this phase."""


class Displacement(NamedTuple):
    """The motion of the contact at a moment, with derivatives by the phase, in units of length."""

    value: float
    """The displacement q."""
    slope: float
    """Its first derivative."""
    second_derivative: float
    """Its second derivative."""
    terms: float
    """Sum of the moduli of the terms of q, each times the angle in whose sine its round-off originates."""


@kernel
def _evaluate(problem: OrbitProblem, steady: float, state: Floats, at: Instant) -> Displacement:
    """Return the motion of the contact at a moment at which the blocks have `state` (N, 2).

    `steady` is a bound of the steady motion.
    """
    omega = problem.omega
    time = at.angle / omega
    value, slope, second_derivative, _ = steady_motion(problem, at.sine, at.cosine)
    terms = steady * (1.0 + highest_order(problem) * (abs(at.start) + at.angle))
    for j in range(state.shape[0]):
        square, twice, frequency = problem.frequency_squared[j], 2.0 * problem.decay[j], problem.frequency[j]
        y, rate = state[j, 0], state[j, 1]
        second = -square * y - twice * rate
        value += y
        slope += rate / omega
        second_derivative += second / (omega * omega)
        terms += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
    return Displacement(value, slope, second_derivative, terms)


@kernel
def _evaluate_at(problem: OrbitProblem, steady: float, state: Floats, start: float, angle: float) -> Displacement:
    """Return the same as `_evaluate` at an angle after an impact at the phase `start`."""
    instant = Instant(start, angle, math.sin(start + angle), math.cos(start + angle))
    return _evaluate(problem, steady, state, instant)


@kernel
def third_derivative_bound(problem: OrbitProblem, steady: float, state: Floats) -> float:
    """Return a bound on the third derivative of the contact's displacement from `state` (N, 2) up to the next impact.

    `steady` is a bound of that of the steady motion.
    """
    bound = 0.0
    for j in range(state.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        second = -square * state[j, 0] - twice * state[j, 1]
        third = -square * state[j, 1] - twice * second
        bound += math.sqrt(square * second * second + third * third)
    total: float = (steady + bound / (problem.omega * problem.omega * problem.omega)) * BOUND_SAFETY
    return total


class Interval(NamedTuple):
    """The motion between two successive impacts."""

    phase: float
    """Phase of the first impact."""
    length: float
    """Angle to the next one."""
    stop: float
    """Stop of the first impact, +1 or -1."""
    next_stop: float
    """Stop of the next one."""


class Sizes(NamedTuple):
    """Numbers of an orbit that are the same in all intervals."""

    steady: float
    """Bound of the steady motion."""
    third_derivative: float
    """Bound of its third derivative."""
    right: float
    """Distance of the right stop from the equilibrium; infinite for an absent stop."""
    left: float
    """Distance of the left stop, likewise."""


class Cell(NamedTuple):
    """A part of an interval, and the motion in its middle."""

    left: float
    """Start of the part, an angle after the impact."""
    right: float
    """End of the part, an angle after the impact."""
    middle: Displacement
    """The motion in the middle."""


class Candidate(NamedTuple):
    """The motion toward one stop in the middle of a cell that may have a maximum."""

    stop: float
    """The stop, +1 or -1."""
    slope: float
    """First derivative of the displacement toward the stop."""
    second_derivative: float
    """Its second derivative."""
    noise: float
    """Round-off of the displacement."""
    concave: bool
    """The displacement toward the stop is concave in the cell. Otherwise the cell is too short to be halved, and the
    maximum is taken to be in its middle."""


class Maximum(NamedTuple):
    """The largest excess over a stop that was found."""

    excess: float
    """The excess."""
    phase: float
    """Phase of the maximum."""
    stop: int
    """0: none was found."""
    noise: float
    """Round-off of the excess."""


@kernel
def _locate_maximum(
    problem: OrbitProblem, interval: Interval, steady: float, cell: Cell, candidate: Candidate, scratch: ContactScratch
) -> float:
    """Return the angle of the maximum in a cell, or NaN if there is none except at an impact.

    `steady` is a bound of the steady motion. `states[0]` and `states[1]` of the scratch are the states after the impact
    and at the beginning of the cell.
    """
    state, left_state, point_state = scratch.states[0], scratch.states[1], scratch.states[3]
    left, right, end = cell.left, cell.right, interval.length
    stop, noise = candidate.stop, candidate.noise
    # the contact leaves the stop of this impact, and returns to that of the next one
    at_start = left == 0.0 and stop == interval.stop
    at_end = right == end and stop == interval.next_stop
    point = 0.5 * (left + right)
    if candidate.concave:
        first = stop * _evaluate_at(problem, steady, left_state, interval.phase, left).slope
        if first < 0.0 or (at_start and first <= noise):
            return math.nan
        _advance(problem, state, right, point_state)
        last = stop * _evaluate_at(problem, steady, point_state, interval.phase, right).slope
        if last > (-noise if at_end else 0.0):
            return math.nan
        slope, second_derivative = candidate.slope, candidate.second_derivative
        low, high = left, right
        for _ in range(STEPS_TO_MAXIMUM):
            if slope > 0.0:
                low = point
            else:
                high = point
            following = point - slope / second_derivative
            if not low <= following <= high:
                following = 0.5 * (low + high)
            if abs(following - point) <= MAXIMUM_ACCURACY * end:
                break
            point = following
            _advance(problem, state, point, point_state)
            at_point = _evaluate_at(problem, steady, point_state, interval.phase, point)
            slope, second_derivative = stop * at_point.slope, stop * at_point.second_derivative
    if (at_start or at_end) and min(point, end - point) <= MAXIMUM_AT_IMPACT * end:
        return math.nan
    return point


@kernel
def _search_cell(
    problem: OrbitProblem, interval: Interval, size: Sizes, cell: Cell, best: Maximum, scratch: ContactScratch
) -> tuple[bool, Maximum]:
    """Return whether a cell has to be halved, and the largest excess so far; the scratch is as in `_locate_maximum`."""
    left, right, middle, point_state = cell.left, cell.right, cell.middle, scratch.states[3]
    radius = 0.5 * (right - left)
    third = third_derivative_bound(problem, size.third_derivative, scratch.states[1])
    halve = False
    for side in range(2):
        stop = 1.0 - 2.0 * side
        limit = size.left if side == 1 else size.right
        if limit == math.inf:
            continue  # there is no such stop
        noise = CONTACT_ROUNDOFF * (middle.terms + abs(limit))
        value = stop * middle.value - limit
        slope, second_derivative = stop * middle.slope, stop * middle.second_derivative
        upper = second_derivative + radius * third
        if value + radius * (abs(slope) + 0.5 * radius * max(upper, 0.0)) < best.excess - noise:
            continue  # below the largest so far
        if abs(slope) > radius * (abs(second_derivative) + radius * third) + noise:
            continue  # monotonic
        if second_derivative > radius * third:
            continue  # convex: no maximum but at its ends, which belong to other cells too
        concave = upper < 0.0
        if not (concave or right - left <= MIN_CONTACT_CELL * interval.length):
            halve = True
            continue
        candidate = Candidate(stop, slope, second_derivative, noise, concave)
        point = _locate_maximum(problem, interval, size.steady, cell, candidate, scratch)
        if math.isnan(point):
            continue
        _advance(problem, scratch.states[0], point, point_state)
        at_point = _evaluate_at(problem, size.steady, point_state, interval.phase, point)
        value = stop * at_point.value - limit
        if value > best.excess:
            best = Maximum(value, interval.phase + point, int(stop), CONTACT_ROUNDOFF * (at_point.terms + abs(limit)))
    return halve, best


@kernel
def _search_interval(
    problem: OrbitProblem, interval: Interval, size: Sizes, best: Maximum, cells: int, scratch: ContactScratch
) -> tuple[int, Maximum]:
    """Search for maxima between two impacts; return the number of cells so far and the largest excess so far.

    `states[0]` of the scratch is the state after the first impact. The number is _TOO_MANY where the search is given
    up.
    """
    state, left_state, middle_state = scratch.states[0], scratch.states[1], scratch.states[2]
    flow, stack = scratch.cell_flow, scratch.stack
    end = interval.length
    parts = math.ceil(end * CONTACT_CELLS / math.pi)
    copy_matrix(left_state, state)
    _write_flow(problem, 0.5 * end / (parts * problem.omega), flow)
    # sine and cosine in the middle of each cell are rotated from one to the next; cells that are halved compute theirs
    angle = end / parts
    sine, cosine = math.sin(interval.phase + 0.5 * angle), math.cos(interval.phase + 0.5 * angle)
    turn_sine, turn_cosine = math.sin(angle), math.cos(angle)
    for part in range(parts):
        apply_flow(flow, left_state, middle_state)
        stack[0, 0] = part * end / parts
        stack[0, 1] = (part + 1) * end / parts if part + 1 < parts else end
        top = 1
        whole = True
        while top > 0:
            cells += 1
            if cells > MAX_CELLS:
                return plain(_TOO_MANY), best
            top -= 1
            left, right = stack[top, 0], stack[top, 1]
            middle = 0.5 * (left + right)
            here_sine, here_cosine = sine, cosine
            if not whole:
                _advance(problem, state, left, left_state)
                _advance(problem, state, middle, middle_state)
                here_sine, here_cosine = math.sin(interval.phase + middle), math.cos(interval.phase + middle)
            instant = Instant(interval.phase, middle, here_sine, here_cosine)
            cell = Cell(left, right, _evaluate(problem, size.steady, middle_state, instant))
            halve, best = _search_cell(problem, interval, size, cell, best, scratch)
            if halve:
                if top + 2 > CELL_STACK:
                    return plain(_TOO_MANY), best
                stack[top, 0], stack[top, 1] = middle, right
                stack[top + 1, 0], stack[top + 1, 1] = left, middle
                top += 2
                whole = False
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
        if whole:
            apply_flow(flow, middle_state, left_state)
        else:
            _advance(problem, state, (part + 1) * end / parts, left_state)
    return cells, best


@kernel
def further_contact_from(
    problem: OrbitProblem, impacts: OrbitImpacts, floor: float, flow_between: Floats, scratch: ContactScratch
) -> tuple[int, float, float, int]:
    """Return whether there is a further contact, and the largest excess over a stop at a maximum between the impacts.

    Parameters
    ----------
    floor : float
        Maxima with an excess below this are not searched for; minus infinity: all are.
    flow_between : (k, N, 4)
        Each block's flow from every impact to the next one.
    scratch : ContactScratch
        `states[0]` is each block's part just after the first impact; overwritten.

    Returns
    -------
    status : int
        NO_FURTHER_CONTACT, MEETS, TOUCHES or GIVEN_UP.
    excess : float
        In units of length, negative where the contact stays inside; minus infinity without a maximum above `floor`.
    phase : float
        Phase of that maximum.
    stop : int
        Stop of that maximum; 0 when there is none.
    """
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count = sides.shape[0]
    best = Maximum(floor, math.nan, plain(0), 0.0)
    cells = plain(0)
    state = scratch.states[0]
    size = Sizes(
        steady_bound(problem, 0),
        steady_bound(problem, 3),
        stops.right / problem.length,
        stops.left / problem.length,
    )
    for i in range(count):
        last = i == count - 1
        next_stop = problem.sign * sides[0] if last else sides[i + 1]
        interval = Interval(phases[i], next_phase(problem, phases, i) - phases[i], sides[i], next_stop)
        cells, best = _search_interval(problem, interval, size, best, cells, scratch)
        if cells == _TOO_MANY:
            return GIVEN_UP, math.inf, math.nan, 0
        if not last:
            apply_flow(flow_between[i], state, state)
            add_impulse(problem, impacts, i + 1, 1.0, state)
    excess = best.excess if best.stop != 0 else -math.inf
    status = NO_FURTHER_CONTACT
    for i in range(count):
        if not sides[i] * speeds[i] > 0.0:
            status = MEETS
    if status == NO_FURTHER_CONTACT and best.stop != 0 and excess > -best.noise:
        status = MEETS if excess > best.noise else TOUCHES
    return status, excess, best.phase, best.stop


@kernel
def further_contact(
    problem: OrbitProblem, impacts: OrbitImpacts, floor: float, scratch: ContactScratch
) -> tuple[int, float, float, int]:
    """Return the same as `further_contact_from`, from the impacts alone."""
    problem, impacts, scratch = reference(problem), reference(impacts), reference(scratch)
    phases = impacts.phases
    for i in range(phases.shape[0]):
        time = (next_phase(problem, phases, i) - phases[i]) / problem.omega
        _write_flow(problem, time, scratch.flow_between[i])
    _state_after_first_impact(problem, impacts, scratch.states[0])
    return further_contact_from(problem, impacts, floor, scratch.flow_between, scratch)


@kernel
def excess_after_first_impact(
    problem: OrbitProblem, impacts: OrbitImpacts, angle: float, stop: float, scratch: ContactScratch
) -> tuple[float, float]:
    """Return the excess over a stop at an angle after the first impact, before the next one, and its round-off.

    Both are in units of length.
    """
    problem, impacts, scratch = reference(problem), reference(impacts), reference(scratch)
    state = scratch.states[3]
    _state_after_first_impact(problem, impacts, scratch.states[0])
    _advance(problem, scratch.states[0], angle, state)
    at_angle = _evaluate_at(problem, steady_bound(problem, 0), state, impacts.phases[0], angle)
    limit = gap_of(impacts.stops, stop) / problem.length
    return stop * at_angle.value - limit, CONTACT_ROUNDOFF * (at_angle.terms + abs(limit))
