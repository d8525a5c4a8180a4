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
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.tolerances import BOUND_SAFETY
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.equations import (
    OrbitImpacts,
    OrbitProblem,
    highest_order,
    rebound_of,
    steady_bound,
    steady_motion,
)
from grazemap_core.orbits.tolerances import (
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

STACK: Final = 256
"""Cells that may wait to be searched. A cell that is halved adds one, and none is halved below MIN_CONTACT_CELL."""
_TOO_MANY: Final = -1


@kernel
def _state_after_first_impact(problem: OrbitProblem, impacts: OrbitImpacts, state: Floats) -> None:
    """Write each block's part in displacement and velocity of q just after the first impact into state (N, 2)."""
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    for j in range(state.shape[0]):
        state[j, 0], state[j, 1] = 0.0, 0.0
        for m in range(phases.shape[0]):
            time = (phases[0] - phases[m] + problem.turn) / problem.omega
            e11, e12, e21, e22 = block_flow(
                problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
            )
            strength = -problem.sign * rebound_of(stops, sides[m]) * problem.omega * speeds[m]
            state[j, 0] += strength * (e11 * problem.periodic_impulse[j, 0] + e12 * problem.periodic_impulse[j, 1])
            state[j, 1] += strength * (e21 * problem.periodic_impulse[j, 0] + e22 * problem.periodic_impulse[j, 1])
        strength = -rebound_of(stops, sides[0]) * problem.omega * speeds[0]
        state[j, 0] += strength * problem.unit_impulse[j, 0]
        state[j, 1] += strength * problem.unit_impulse[j, 1]


@kernel
def _flows_between_impacts(problem: OrbitProblem, phases: Floats, flow_between: Floats) -> None:
    """Write each block's flow from every impact to the next one into flow_between (k, N, 4)."""
    count = phases.shape[0]
    for i in range(count):
        end = phases[i + 1] if i + 1 < count else phases[0] + problem.turn
        for j in range(flow_between.shape[1]):
            flow_between[i, j, 0], flow_between[i, j, 1], flow_between[i, j, 2], flow_between[i, j, 3] = block_flow(
                problem.decay[j],
                problem.discriminant[j],
                problem.frequency_squared[j],
                (end - phases[i]) / problem.omega,
            )


@kernel
def _advance(problem: OrbitProblem, start: Floats, angle: float, end: Floats) -> None:
    """Write into end (N, 2) the state of the blocks an angle later than start (N, 2)."""
    for j in range(start.shape[0]):
        e11, e12, e21, e22 = block_flow(
            problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], angle / problem.omega
        )
        y, rate = start[j, 0], start[j, 1]
        end[j, 0], end[j, 1] = e11 * y + e12 * rate, e21 * y + e22 * rate


@kernel
def _evaluate(
    problem: OrbitProblem,
    size: float,
    state: Floats,
    start: float,
    angle: float,
    sine: float,
    cosine: float,
    values: Floats,
) -> None:
    """Write into values (4,) the displacement q, its first two derivatives, and the sum of its terms' moduli.

    `state` (N, 2) is that of the blocks, `angle` after an impact at the phase `start`; sine and cosine are those of
    the phase there, `size` is a bound of the steady motion.
    """
    omega = problem.omega
    time = angle / omega
    value, slope, second_derivative, _ = steady_motion(problem, sine, cosine)
    terms = size * (1.0 + highest_order(problem) * (abs(start) + angle))
    for j in range(state.shape[0]):
        square, twice, frequency = problem.frequency_squared[j], 2.0 * problem.decay[j], problem.frequency[j]
        y, rate = state[j, 0], state[j, 1]
        second = -square * y - twice * rate
        value += y
        slope += rate / omega
        second_derivative += second / (omega * omega)
        terms += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
    values[0], values[1], values[2], values[3] = value, slope, second_derivative, terms


@kernel
def _evaluate_at(problem: OrbitProblem, size: float, state: Floats, start: float, angle: float, values: Floats) -> None:
    """Write the same as `_evaluate` at any angle."""
    _evaluate(problem, size, state, start, angle, math.sin(start + angle), math.cos(start + angle), values)


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


class ContactScratch(NamedTuple):
    """Scratch of the search for contacts, for N blocks."""

    states: Floats
    """(4, N, 2) Each block's part in displacement and velocity of q after an impact, at the beginning of a cell, in its
    middle, and at an arbitrary time."""
    cell_flow: Floats
    """(N, 4) Each block's flow over half a cell."""
    stack: Floats
    """(STACK, 2) Beginnings and ends of the cells that are still to be searched."""
    values: Floats
    """(3, 4) Results of `_evaluate` at the beginning of a cell, in its middle, and at an arbitrary time."""


def contact_scratch(blocks: int) -> ContactScratch:
    """Return scratch for an oscillator of `blocks` masses."""
    return ContactScratch(
        states=np.zeros((4, blocks, 2)),
        cell_flow=np.zeros((blocks, 4)),
        stack=np.zeros((STACK, 2)),
        values=np.zeros((3, 4)),
    )


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


class IntervalPart(NamedTuple):
    """A part of an interval, and the motion toward one stop in its middle."""

    left: float
    """Start of the part, an angle after the impact."""
    right: float
    """End of the part, an angle after the impact."""
    slope: float
    """First derivative of the displacement toward the stop, in the middle."""
    second_derivative: float
    """Second derivative there."""
    noise: float
    """Round-off in the middle."""


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
def apply_flow(flow: Floats, start: Floats, end: Floats) -> None:
    """Write the state of the blocks (N, 2) after a flow (N, 4) from start into end, which may be the same array."""
    for j in range(start.shape[0]):
        y, rate = start[j, 0], start[j, 1]
        end[j, 0] = flow[j, 0] * y + flow[j, 1] * rate
        end[j, 1] = flow[j, 2] * y + flow[j, 3] * rate


@kernel
def _locate_maximum(
    problem: OrbitProblem,
    interval: Interval,
    size: float,
    stop: float,
    cell: IntervalPart,
    concave: bool,
    scratch: ContactScratch,
) -> float:
    """Return the angle of the maximum in a cell, or NaN if there is none except at an impact.

    Parameters
    ----------
    concave : bool
        The displacement toward the stop is concave in the cell. Otherwise the cell is too short to be halved, and the
        maximum is taken to be in its middle.
    """
    state, left_state, point_state = scratch.states[0], scratch.states[1], scratch.states[3]
    at_left, at_point = scratch.values[0], scratch.values[2]
    left, right, end = cell.left, cell.right, interval.length
    # the contact leaves the stop of this impact, and returns to that of the next one
    at_start = left == 0.0 and stop == interval.stop
    at_end = right == end and stop == interval.next_stop
    point = 0.5 * (left + right)
    if concave:
        _evaluate_at(problem, size, left_state, interval.phase, left, at_left)
        first = stop * at_left[1]
        if first < 0.0 or (at_start and first <= cell.noise):
            return math.nan
        _advance(problem, state, right, point_state)
        _evaluate_at(problem, size, point_state, interval.phase, right, at_point)
        if stop * at_point[1] > (-cell.noise if at_end else 0.0):
            return math.nan
        slope, second_derivative = cell.slope, cell.second_derivative
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
            _evaluate_at(problem, size, point_state, interval.phase, point, at_point)
            slope, second_derivative = stop * at_point[1], stop * at_point[2]
    if (at_start or at_end) and min(point, end - point) <= MAXIMUM_AT_IMPACT * end:
        return math.nan
    return point


@kernel
def _search_cell(
    problem: OrbitProblem,
    interval: Interval,
    size: Sizes,
    left: float,
    right: float,
    best: Maximum,
    scratch: ContactScratch,
) -> tuple[bool, Maximum]:
    """Return whether a cell has to be halved, and the largest excess so far.

    `states[1]` and `values[1]` of the scratch hold the state at the beginning of the cell and the values in its middle.
    """
    at_middle, point_state, at_point = scratch.values[1], scratch.states[3], scratch.values[2]
    radius = 0.5 * (right - left)
    third = third_derivative_bound(problem, size.third_derivative, scratch.states[1])
    halve = False
    for side in range(2):
        stop = 1.0 - 2.0 * side
        limit = size.left if side == 1 else size.right
        if limit == math.inf:
            continue  # there is no such stop
        noise = CONTACT_ROUNDOFF * (at_middle[3] + abs(limit))
        value = stop * at_middle[0] - limit
        slope, second_derivative = stop * at_middle[1], stop * at_middle[2]
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
        cell = IntervalPart(left, right, slope, second_derivative, noise)
        point = _locate_maximum(problem, interval, size.steady, stop, cell, concave, scratch)
        if math.isnan(point):
            continue
        _advance(problem, scratch.states[0], point, point_state)
        _evaluate_at(problem, size.steady, point_state, interval.phase, point, at_point)
        value = stop * at_point[0] - limit
        if value > best.excess:
            best = Maximum(value, interval.phase + point, int(stop), CONTACT_ROUNDOFF * (at_point[3] + abs(limit)))
    return halve, best


@kernel
def _search_interval(
    problem: OrbitProblem,
    interval: Interval,
    size: Sizes,
    best: Maximum,
    cells: int,
    scratch: ContactScratch,
) -> tuple[int, Maximum]:
    """Search for maxima between two impacts; return the number of cells so far and the largest excess so far.

    `states[0]` of the scratch is the state after the first impact. The number is _TOO_MANY where the search is given
    up.
    """
    state, left_state, middle_state = scratch.states[0], scratch.states[1], scratch.states[2]
    flow, stack, at_middle = scratch.cell_flow, scratch.stack, scratch.values[1]
    end = interval.length
    parts = math.ceil(end * CONTACT_CELLS / math.pi)
    for j in range(state.shape[0]):
        left_state[j, 0], left_state[j, 1] = state[j, 0], state[j, 1]
        flow[j, 0], flow[j, 1], flow[j, 2], flow[j, 3] = block_flow(
            problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], 0.5 * end / (parts * problem.omega)
        )
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
            _evaluate(problem, size.steady, middle_state, interval.phase, middle, here_sine, here_cosine, at_middle)
            halve, best = _search_cell(problem, interval, size, left, right, best, scratch)
            if halve:
                if top + 2 > STACK:
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
        length = phases[0] + problem.turn - phases[i] if last else phases[i + 1] - phases[i]
        next_stop = problem.sign * sides[0] if last else sides[i + 1]
        interval = Interval(phases[i], length, sides[i], next_stop)
        cells, best = _search_interval(problem, interval, size, best, cells, scratch)
        if cells == _TOO_MANY:
            return GIVEN_UP, math.inf, math.nan, 0
        if not last:
            apply_flow(flow_between[i], state, state)
            impulse = -rebound_of(stops, sides[i + 1]) * problem.omega * speeds[i + 1]
            for j in range(state.shape[0]):
                state[j, 0] += impulse * problem.unit_impulse[j, 0]
                state[j, 1] += impulse * problem.unit_impulse[j, 1]
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
    problem: OrbitProblem, impacts: OrbitImpacts, floor: float, flow_between: Floats, scratch: ContactScratch
) -> tuple[int, float, float, int]:
    """Return the same as `further_contact_from`, from the impacts alone; flow_between is overwritten."""
    problem, impacts, scratch = reference(problem), reference(impacts), reference(scratch)
    _flows_between_impacts(problem, impacts.phases, flow_between)
    _state_after_first_impact(problem, impacts, scratch.states[0])
    return further_contact_from(problem, impacts, floor, flow_between, scratch)


@kernel
def excess_after_first_impact(
    problem: OrbitProblem, impacts: OrbitImpacts, angle: float, stop: float, scratch: ContactScratch
) -> tuple[float, float]:
    """Return the excess over a stop at an angle after the first impact, before the next one, and its round-off.

    Both are in units of length.
    """
    problem, impacts, scratch = reference(problem), reference(impacts), reference(scratch)
    state, values = scratch.states[3], scratch.values[2]
    _state_after_first_impact(problem, impacts, scratch.states[0])
    _advance(problem, scratch.states[0], angle, state)
    _evaluate_at(problem, steady_bound(problem, 0), state, impacts.phases[0], angle, values)
    limit = gap_of(impacts.stops, stop) / problem.length
    return stop * values[0] - limit, CONTACT_ROUNDOFF * (values[3] + abs(limit))
