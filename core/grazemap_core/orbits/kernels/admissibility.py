"""Whether a periodic motion meets a stop between its impacts, with a guarantee, and how near it comes.

Between two impacts the distance of mass 1 from a stop can only be negative where it has a maximum. All maxima that
matter are found by halving: value, slope and curvature at the middle of a cell, and a bound on the third derivative
from the blocks' energies, tell for each stop that mass 1 stays further away than the nearest so far, that it passes the
cell in one direction, that its distance is concave, or that it is convex, when Newton's method finds the nearest place.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.grazing.tolerances import CONTACT_CELLS, CONTACT_ROUNDOFF, MAX_CELLS, MIN_CONTACT_CELL
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.tolerances import BOUND_SAFETY
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.tolerances import EPSILON

CLEAR = 0
"""Mass 1 meets no stop but at its impacts."""
MEETS = 1
"""It does, or one of the impacts is from outside (a virtual one)."""
TOUCHES = 2
"""Round-off hides whether it does."""
GIVEN_UP = 3
"""MAX_CELLS were not enough."""

STACK = 256
_NEWTON_STEPS = 60


@kernel
def _state_behind(problem: OrbitProblem, phases: Floats, speeds: Floats, state: Floats) -> None:
    """Write each block's part in displacement and velocity of mass 1 just behind the first impact into state (N, 2)."""
    for j in range(state.shape[0]):
        state[j, 0], state[j, 1] = 0.0, 0.0
        for m in range(phases.shape[0]):
            time = (phases[0] - phases[m] + problem.turn) / problem.omega
            e11, e12, e21, e22 = block_flow(
                problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
            )
            strength = -problem.sign * problem.rebound * problem.omega * speeds[m]
            state[j, 0] += strength * (e11 * problem.behind[j, 0] + e12 * problem.behind[j, 1])
            state[j, 1] += strength * (e21 * problem.behind[j, 0] + e22 * problem.behind[j, 1])
        strength = -problem.rebound * problem.omega * speeds[0]
        state[j, 0] += strength * problem.unit_impulse[j, 0]
        state[j, 1] += strength * problem.unit_impulse[j, 1]


@kernel
def _flows_between(problem: OrbitProblem, phases: Floats, across: Floats) -> None:
    """Write each block's flow from every impact to the next one into across (k, N, 4)."""
    count = phases.shape[0]
    for i in range(count):
        end = phases[i + 1] if i + 1 < count else phases[0] + problem.turn
        for j in range(across.shape[1]):
            across[i, j, 0], across[i, j, 1], across[i, j, 2], across[i, j, 3] = block_flow(
                problem.decay[j],
                problem.discriminant[j],
                problem.frequency_squared[j],
                (end - phases[i]) / problem.omega,
            )


@kernel
def _carry(problem: OrbitProblem, start: Floats, angle: float, end: Floats) -> None:
    """Write into end (N, 2) where the blocks are an angle later than start (N, 2)."""
    for j in range(start.shape[0]):
        e11, e12, e21, e22 = block_flow(
            problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], angle / problem.omega
        )
        y, rate = start[j, 0], start[j, 1]
        end[j, 0], end[j, 1] = e11 * y + e12 * rate, e21 * y + e22 * rate


@kernel
def _look(
    problem: OrbitProblem,
    size: float,
    state: Floats,
    start: float,
    angle: float,
    sine: float,
    cosine: float,
    here: Floats,
) -> None:
    """Write into here (4,): mass 1, its first two derivatives, and its terms.

    `state` (N, 2) is where the blocks are, `angle` behind an impact at the phase `start`; sine and cosine are those of
    the phase there, `size` is the amplitude of the steady motion.
    """
    omega = problem.omega
    time = angle / omega
    value = problem.gain_real * sine + problem.gain_imag * cosine
    slope = problem.gain_real * cosine - problem.gain_imag * sine
    second_derivative, terms = -value, size * (1.0 + abs(start) + angle)
    for j in range(state.shape[0]):
        square, twice, frequency = problem.frequency_squared[j], 2.0 * problem.decay[j], problem.frequency[j]
        y, rate = state[j, 0], state[j, 1]
        second = -square * y - twice * rate
        value += y
        slope += rate / omega
        second_derivative += second / (omega * omega)
        terms += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
    here[0], here[1], here[2], here[3] = value, slope, second_derivative, terms


@kernel
def _look_at(problem: OrbitProblem, size: float, state: Floats, start: float, angle: float, here: Floats) -> None:
    """Write the same as `_look` at any angle."""
    _look(problem, size, state, start, angle, math.sin(start + angle), math.cos(start + angle), here)


@kernel
def _third_derivative(problem: OrbitProblem, size: float, state: Floats) -> float:
    """Bound the third derivative of mass 1's place from where the blocks are at `state` (N, 2) to the next impact."""
    bound = 0.0
    for j in range(state.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        second = -square * state[j, 0] - twice * state[j, 1]
        third = -square * state[j, 1] - twice * second
        bound += math.sqrt(square * second * second + third * third)
    total: float = (size + bound / (problem.omega * problem.omega * problem.omega)) * BOUND_SAFETY
    return total


@kernel
def nearest_on_way(
    problem: OrbitProblem,
    stops: Floats,
    clearance: float,
    phases: Floats,
    speeds: Floats,
    floor: float,
    across: Floats,
    states: Floats,
    flow: Floats,
    stack: Floats,
    here: Floats,
) -> tuple[int, float, float, int]:
    """Return whether there is a further contact, and the largest excess over a stop at a maximum between the impacts.

    Parameters
    ----------
    floor : float
        Maxima that stay below a stop by more than this are not looked for; minus infinity for all.
    across : (k, N, 4)
        Each block's flow from every impact to the next one.
    states : (4, N, 2)
        The first is each block's part just behind the first impact; all are overwritten.
    flow : (N, 4)
    stack : (STACK, 2)
    here : (3, 4)
        Scratch.

    Returns
    -------
    status : int
        CLEAR, MEETS, TOUCHES or GIVEN_UP.
    excess : float
        In lengths, negative where mass 1 stays inside; minus infinity when there is no maximum above `floor`.
    phase : float
        Where.
    stop : int
        Which one; 0 when there is none.
    """
    count = stops.shape[0]
    place = clearance / problem.length
    best, phase, which, noise_there = floor, math.nan, 0, 0.0
    cells = 0
    at_left, at_middle, at_point = here[0], here[1], here[2]
    # behind the impact; where a cell that is not halved begins, and its middle; anywhere
    state, left_state, middle_state, point_state = states[0], states[1], states[2], states[3]
    blocks = state.shape[0]
    size = math.hypot(problem.gain_real, problem.gain_imag)
    for i in range(count):
        last = i == count - 1
        end = phases[0] + problem.turn - phases[i] if last else phases[i + 1] - phases[i]
        meets = problem.sign * stops[0] if last else stops[i + 1]
        parts = math.ceil(end * CONTACT_CELLS / math.pi)
        for j in range(blocks):
            left_state[j, 0], left_state[j, 1] = state[j, 0], state[j, 1]
            flow[j, 0], flow[j, 1], flow[j, 2], flow[j, 3] = block_flow(
                problem.decay[j],
                problem.discriminant[j],
                problem.frequency_squared[j],
                0.5 * end / (parts * problem.omega),
            )
        # of the phase at the middle of every cell, turned on from one to the next; those of cells that are halved anew
        across_cell = end / parts
        sine, cosine = math.sin(phases[i] + 0.5 * across_cell), math.cos(phases[i] + 0.5 * across_cell)
        turn_sine, turn_cosine = math.sin(across_cell), math.cos(across_cell)
        for part in range(parts):
            for j in range(blocks):
                y, rate = left_state[j, 0], left_state[j, 1]
                middle_state[j, 0] = flow[j, 0] * y + flow[j, 1] * rate
                middle_state[j, 1] = flow[j, 2] * y + flow[j, 3] * rate
            stack[0, 0] = part * end / parts
            stack[0, 1] = (part + 1) * end / parts if part + 1 < parts else end
            top = 1
            whole = True
            while top > 0:
                cells += 1
                if cells > MAX_CELLS:
                    return GIVEN_UP, math.inf, math.nan, 0
                top -= 1
                left, right = stack[top, 0], stack[top, 1]
                middle, radius = 0.5 * (left + right), 0.5 * (right - left)
                here_sine, here_cosine = sine, cosine
                if not whole:
                    _carry(problem, state, left, left_state)
                    _carry(problem, state, middle, middle_state)
                    here_sine, here_cosine = math.sin(phases[i] + middle), math.cos(phases[i] + middle)
                _look(problem, size, middle_state, phases[i], middle, here_sine, here_cosine, at_middle)
                third = _third_derivative(problem, size, left_state)
                noise = CONTACT_ROUNDOFF * (at_middle[3] + place)
                halve = False
                for side in range(2):
                    stop = 1.0 - 2.0 * side
                    value = stop * at_middle[0] - place
                    slope, second_derivative = stop * at_middle[1], stop * at_middle[2]
                    steepest = second_derivative + radius * third
                    if value + radius * (abs(slope) + 0.5 * radius * max(steepest, 0.0)) < best - noise:
                        continue
                    if abs(slope) > radius * (abs(second_derivative) + radius * third) + noise:
                        continue
                    if second_derivative > radius * third:
                        continue  # no maximum but at its ends, which are other cells' too
                    tiny = right - left <= MIN_CONTACT_CELL * end
                    if not (steepest < 0.0 or tiny):
                        halve = True
                        continue
                    # mass 1 leaves the stop that it has struck, and comes back to the one that it strikes next
                    at_start = left == 0.0 and stop == stops[i]
                    at_end = right == end and stop == meets
                    point = middle
                    if steepest < 0.0:
                        _look_at(problem, size, left_state, phases[i], left, at_left)
                        first = stop * at_left[1]
                        if first < 0.0 or (at_start and first <= noise):
                            continue
                        _carry(problem, state, right, point_state)
                        _look_at(problem, size, point_state, phases[i], right, at_point)
                        if stop * at_point[1] > (-noise if at_end else 0.0):
                            continue
                        low, high = left, right
                        for _ in range(_NEWTON_STEPS):
                            if slope > 0.0:
                                low = point
                            else:
                                high = point
                            following = point - slope / second_derivative
                            if not low <= following <= high:
                                following = 0.5 * (low + high)
                            if abs(following - point) <= 4.0 * EPSILON * end:
                                break
                            point = following
                            _carry(problem, state, point, point_state)
                            _look_at(problem, size, point_state, phases[i], point, at_point)
                            slope, second_derivative = stop * at_point[1], stop * at_point[2]
                    if (at_start or at_end) and min(point, end - point) <= 64.0 * EPSILON * end:
                        continue
                    _carry(problem, state, point, point_state)
                    _look_at(problem, size, point_state, phases[i], point, at_point)
                    value = stop * at_point[0] - place
                    if value > best:
                        best, phase, which = value, phases[i] + point, int(stop)
                        noise_there = CONTACT_ROUNDOFF * (at_point[3] + place)
                if halve:
                    if top + 2 > STACK:
                        return GIVEN_UP, math.inf, math.nan, 0
                    stack[top, 0], stack[top, 1] = middle, right
                    stack[top + 1, 0], stack[top + 1, 1] = left, middle
                    top += 2
                    whole = False
            sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
            if whole:
                for j in range(blocks):
                    y, rate = middle_state[j, 0], middle_state[j, 1]
                    left_state[j, 0] = flow[j, 0] * y + flow[j, 1] * rate
                    left_state[j, 1] = flow[j, 2] * y + flow[j, 3] * rate
            else:
                _carry(problem, state, (part + 1) * end / parts, left_state)
        if not last:
            for j in range(state.shape[0]):
                y, rate = state[j, 0], state[j, 1]
                strength = -problem.rebound * problem.omega * speeds[i + 1]
                state[j, 0] = across[i, j, 0] * y + across[i, j, 1] * rate + strength * problem.unit_impulse[j, 0]
                state[j, 1] = across[i, j, 2] * y + across[i, j, 3] * rate + strength * problem.unit_impulse[j, 1]
    excess = best if which != 0 else -math.inf
    verdict = CLEAR
    for i in range(count):
        if not stops[i] * speeds[i] > 0.0:
            verdict = MEETS
    if verdict == CLEAR and which != 0 and excess > -noise_there:
        verdict = MEETS if excess > noise_there else TOUCHES
    return verdict, excess, phase, which


@kernel
def nearest_contact(
    problem: OrbitProblem,
    stops: Floats,
    clearance: float,
    phases: Floats,
    speeds: Floats,
    floor: float,
    across: Floats,
    states: Floats,
    flow: Floats,
    stack: Floats,
    here: Floats,
) -> tuple[int, float, float, int]:
    """Return the same as `nearest_on_way` from phases and speeds alone; across and states are scratch."""
    _flows_between(problem, phases, across)
    _state_behind(problem, phases, speeds, states[0])
    return nearest_on_way(problem, stops, clearance, phases, speeds, floor, across, states, flow, stack, here)
