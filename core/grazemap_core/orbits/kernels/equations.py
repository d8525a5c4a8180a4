"""The equations of a periodic motion with impacts, analytic through grazing, and their derivatives.

Between impacts the motion is linear, so it is the sum of the steady motion and the responses to all impacts, each an
impulse on the contact. The unknowns are the phases of the impacts and the velocities before them. An impact of velocity
0 is a regular point of the equations (theory, "Any impacting orbit").

Everything is in units in which a forcing period takes 2 pi and a length given with the problem is 1: the unknowns are
the phases omega t_i and the speeds v_i/(omega length). Displacements are those of the contact coordinate from the
static equilibrium.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import Stops, gap_of, restitution_of
from grazemap_core.model.kernels.block_flow import advance_block, block_flow
from grazemap_core.numerics.jit.compiled import inlined, inlined_formula, kernel
from grazemap_core.records import NamedTuple


class OrbitProblem(NamedTuple):
    """A structure at one forcing frequency, and the time after which its motion repeats, or is mirrored."""

    decay: Floats
    """(N,) Of the blocks that contact sees."""
    discriminant: Floats
    """(N,) Of these blocks."""
    frequency_squared: Floats
    """(N,) Of these blocks."""
    frequency: Floats
    """(N,) Of these blocks."""
    unit_impulse: Floats
    """(N, 2) Change of each block's part in displacement and velocity of the contact by a unit impulse, which changes
    the velocity by 1."""
    periodic_impulse: Floats
    """(N, 2) Each block's part just after the last of infinitely many impulses, one per span, which are multiplied by
    `sign` from span to span."""
    doubled_impulse: Floats
    """(N, 2) The same of impulses that are multiplied by ``-sign``."""
    periodic_impulse_by_span: Floats
    """(N, 2) ``span sum_k k sign^k exp(T k span) unit_impulse``: the derivative of `periodic_impulse` with respect to
    the span, without the factor of the blocks' generator."""
    orders: Floats
    """(H,) Orders of the harmonics of the forces, increasing."""
    steady: Floats
    """(H, 2) Real and imaginary part of the steady amplitudes: the steady motion of the contact is the sum of
    Im(amplitude exp(i order omega t))."""
    steady_by_omega: Floats
    """(H, 2) Derivatives of the steady amplitudes with respect to omega."""
    steady_unit: float
    """The steady amplitudes over this are in units of `length`."""
    omega: float
    """Forcing frequency."""
    length: float
    """Unit of length."""
    turn: float
    """Change of the phase over one span, the time after which the impacts repeat."""
    sign: float
    """1 if the impacts repeat on the same stop, -1 if on the other one: for symmetric stops only."""


class OrbitImpacts(NamedTuple):
    """The impacts of an orbit."""

    stops: Stops
    """The stops, and their distances from the equilibrium."""
    sides: Floats
    """(k,) Stop of each impact, +1 or -1."""
    phases: Floats
    """(k,) Phase of each impact."""
    speeds: Floats
    """(k,) Signed speed of each impact."""


@inlined
def sum_of_harmonics(
    problem: OrbitProblem, amplitudes: Floats, sine: float, cosine: float
) -> tuple[float, float, float, float]:
    """Return the sum of harmonics with these amplitudes (H, 2), and its first three derivatives by the phase.

    Sine and cosine are those of the phase; the result is in units of length.
    """
    value, slope, second, third = 0.0, 0.0, 0.0, 0.0
    order, turned_sine, turned_cosine = 0.0, 0.0, 1.0
    for h in range(problem.orders.shape[0]):
        while order < problem.orders[h]:
            order += 1.0
            turned_sine, turned_cosine = (
                turned_sine * cosine + turned_cosine * sine,
                turned_cosine * cosine - turned_sine * sine,
            )
        real, imag = amplitudes[h, 0] / problem.steady_unit, amplitudes[h, 1] / problem.steady_unit
        place = real * turned_sine + imag * turned_cosine
        rate = order * (real * turned_cosine - imag * turned_sine)
        value += place
        slope += rate
        second -= order * order * place
        third -= order * order * rate
    return value, slope, second, third


@inlined
def steady_motion(problem: OrbitProblem, sine: float, cosine: float) -> tuple[float, float, float, float]:
    """Return the steady motion of the contact, and its first three derivatives by the phase."""
    return sum_of_harmonics(problem, problem.steady, sine, cosine)


@kernel
def steady_bound(problem: OrbitProblem, derivative: int) -> float:
    """Return a bound of the steady motion of the contact, or of one of its derivatives by the phase."""
    total = 0.0
    for h in range(problem.orders.shape[0]):
        size = math.hypot(problem.steady[h, 0] / problem.steady_unit, problem.steady[h, 1] / problem.steady_unit)
        for _ in range(derivative):
            size *= problem.orders[h]
        total += size
    return total


@inlined
def highest_order(problem: OrbitProblem) -> float:
    """Return the largest order of the harmonics."""
    highest: float = problem.orders[problem.orders.shape[0] - 1]
    return highest


@inlined_formula
def rebound_of(stops: Stops, stop: float) -> float:
    """Return 1 + R of a stop: the change of the velocity by an impact, in units of the velocity before it."""
    return 1.0 + restitution_of(stops, stop)


@inlined_formula
def next_phase(problem: OrbitProblem, phases: Floats, i: int) -> float:
    """Return the phase of the impact after impact i; after the last one, that of the first impact of the next span."""
    following: float = phases[i + 1] if i + 1 < phases.shape[0] else phases[0] + problem.turn
    return following


@kernel
def largest_rebound(impacts: OrbitImpacts) -> float:
    """Return the largest 1 + R of the stops of an orbit's impacts."""
    largest = 0.0
    for i in range(impacts.sides.shape[0]):
        largest = max(largest, rebound_of(impacts.stops, impacts.sides[i]))
    return largest


@kernel
def _impulse_response(problem: OrbitProblem, time: float) -> tuple[float, float, float, float, float, float]:
    """Return the response of the contact a time after an impulse that is repeated every span.

    The results are displacement, velocity and acceleration; the derivatives of the first two with respect to the
    frequency at fixed phases, up to factors; and the sum of the terms' moduli, each times the angle in its sines.
    """
    value, slope, second_derivative, by_time, slope_by_time, part = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        e11, e12, e21, e22 = block_flow(problem.decay[j], problem.discriminant[j], square, time)
        first, second = problem.periodic_impulse[j, 0], problem.periodic_impulse[j, 1]
        y, rate = e11 * first + e12 * second, e21 * first + e22 * second
        value += y
        slope += rate
        second_derivative -= square * y + twice * rate
        part += (abs(y) + abs(rate) / problem.frequency[j]) * (1.0 + problem.frequency[j] * time)
        first = time * first + problem.periodic_impulse_by_span[j, 0]
        second = time * second + problem.periodic_impulse_by_span[j, 1]
        y, rate = e11 * first + e12 * second, e21 * first + e22 * second
        by_time += rate
        slope_by_time -= square * y + twice * rate
    return value, slope, second_derivative, by_time, slope_by_time, part


@kernel
def assemble(problem: OrbitProblem, impacts: OrbitImpacts, residual: Floats, jacobian: Floats, before: Floats) -> float:
    """Write the residual and its derivatives; return the size of the terms of which the residual is the sum.

    Parameters
    ----------
    impacts : OrbitImpacts
        Phases increase and span less than `turn`; this is not checked, as the equations continue analytically.
    residual : (2 k,)
        Receives, at every impact, the displacement of the contact minus the stop's, and its velocity minus the
        unknown.
    jacobian : (2 k, 2 k + 1)
        Receives the derivatives with respect to phases, speeds, and omega at fixed phases and speeds.
    before : (k, 3)
        Receives displacement, velocity and acceleration of the contact just before every impact.

    Returns
    -------
    terms : float
        The largest sum of the terms' moduli, each times the angle in whose sine its round-off originates.
    """
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count = sides.shape[0]
    omega, highest = problem.omega, highest_order(problem)
    size = steady_bound(problem, 0)
    largest = 0.0
    for i in range(count):
        sine, cosine = math.sin(phases[i]), math.cos(phases[i])
        x, v, a, _ = steady_motion(problem, sine, cosine)
        x_by_omega, v_by_omega, _, _ = sum_of_harmonics(problem, problem.steady_by_omega, sine, cosine)
        gap = gap_of(stops, sides[i])
        terms = size * (1.0 + highest * abs(phases[i])) + abs(gap) / problem.length
        for m in range(count):
            sign, time = 1.0, (phases[i] - phases[m]) / omega
            if m >= i:
                sign, time = problem.sign, (phases[i] - phases[m] + problem.turn) / omega
            value, slope, second_derivative, by_time, slope_by_time, part = _impulse_response(problem, time)
            rebound = rebound_of(stops, sides[m])
            factor = sign * rebound
            speed = speeds[m]
            value *= factor * omega
            slope *= factor
            second_derivative *= factor / omega
            x -= speed * value
            v -= speed * slope
            a -= speed * second_derivative
            terms += abs(speed * rebound) * omega * part
            x_by_omega -= speed * (value / omega - factor * by_time)
            v_by_omega += speed * factor * slope_by_time / omega
            jacobian[i, m] = speed * slope
            jacobian[i, count + m] = -value
            jacobian[count + i, m] = speed * second_derivative
            jacobian[count + i, count + m] = -slope
        jacobian[i, i] += v
        jacobian[count + i, i] += a
        jacobian[count + i, count + i] -= 1.0
        jacobian[i, 2 * count] = x_by_omega
        jacobian[count + i, 2 * count] = v_by_omega
        residual[i] = x - sides[i] * gap / problem.length
        residual[count + i] = v - speeds[i]
        before[i, 0], before[i, 1], before[i, 2] = x, v, a
        largest = max(largest, terms)
    return largest


@kernel
def assemble_doubled(problem: OrbitProblem, impacts: OrbitImpacts, before: Floats, matrix: Floats) -> None:
    """Write the Jacobian for perturbations that return with the opposite sign after a span.

    Up to sign its determinant is ``prod v_i det(I + M)/det(I + exp(A span))``, which is smooth where v_i vanishes.

    Parameters
    ----------
    before : (k, 3)
        As `assemble` writes it.
    matrix : (2 k, at least 2 k)
    """
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count = phases.shape[0]
    omega = problem.omega
    for i in range(count):
        for m in range(count):
            rebound = rebound_of(stops, sides[m])
            factor, time = rebound, (phases[i] - phases[m]) / omega
            if m >= i:
                factor, time = -problem.sign * rebound, (phases[i] - phases[m] + problem.turn) / omega
            value, slope, second_derivative = 0.0, 0.0, 0.0
            for j in range(problem.decay.shape[0]):
                square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
                y, rate = advance_block(problem, j, problem.doubled_impulse[j, 0], problem.doubled_impulse[j, 1], time)
                value += y
                slope += rate
                second_derivative -= square * y + twice * rate
            matrix[i, m] = factor * slope * speeds[m]
            matrix[i, count + m] = -factor * omega * value
            matrix[count + i, m] = factor * second_derivative / omega * speeds[m]
            matrix[count + i, count + m] = -factor * slope
        matrix[i, i] += before[i, 1]
        matrix[count + i, i] += before[i, 2]
        matrix[count + i, count + i] -= 1.0


@kernel
def second_derivative_bound(problem: OrbitProblem, impacts: OrbitImpacts, reach: float) -> float:
    """Return a bound on the sum of one equation's second derivatives, for speeds changed by at most `reach` each.

    The energy of a block never increases, so it bounds the block's response to an impulse at all later times.
    """
    omega, speeds = problem.omega, impacts.speeds
    first, second, third = 0.0, 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        y, rate = problem.periodic_impulse[j, 0], problem.periodic_impulse[j, 1]
        second_derivative = -square * y - twice * rate
        jerk = -square * rate - twice * second_derivative
        first += math.hypot(problem.frequency[j] * y, rate)
        second += math.hypot(problem.frequency[j] * rate, second_derivative)
        third += math.hypot(problem.frequency[j] * second_derivative, jerk)
    total = 0.0
    for i in range(speeds.shape[0]):
        total += abs(speeds[i]) + reach
    others = speeds.shape[0] - 1.0
    place = total * second / omega + others * first
    rate = total * third / (omega * omega) + others * second / omega
    steady = steady_bound(problem, 3)  # orders are at least 1, so it bounds the second derivative too
    bound: float = steady + 4.0 * largest_rebound(impacts) * max(place, rate)
    return bound
