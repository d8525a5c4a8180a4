"""Whether a trajectory near a periodic orbit is captured by it: its impacts stay those of the orbit, and it converges.

A trajectory is compared with the orbit at their impacts. Between impacts both are free, so their difference is a
solution of the linear equations; it is continued to the time of the orbit's impact where the two impacts differ in
time. Over an impact the difference changes by the saltation matrix and by terms of second order, which are bounded.
Everything below holds for every difference in a ball of a norm in which the return map's derivative contracts:

- each impact stays an impact: the speed that is left of it suffices for the largest change of the contact's
  displacement, against the acceleration;
- the contact leaves each stop, and arrives at the next one, without another contact: its speed suffices for the reach,
  the largest change of its displacement in the flight;
- at every other extremum the distance from the stop exceeds the reach;
- one return shortens every difference.

Each of these four is a ratio that is proportional to the radius of the ball to leading order. The largest one is
returned: below 1 the trajectory is captured; otherwise it tells how much closer to the orbit the trajectory has to be.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.stops import restitution_of
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.jit.compiled import any_order_kernel, fused_kernel, kernel
from grazemap_core.numerics.kernels.dense import add_transposed_product, cholesky, multiply
from grazemap_core.orbits import tolerances
from grazemap_core.orbits.kernels.admissibility import third_derivative_bound
from grazemap_core.orbits.kernels.equations import (
    OrbitProblem,
    highest_order,
    rebound_of,
    steady_bound,
    steady_motion,
)
from grazemap_core.orbits.kernels.multipliers import block_scale
from grazemap_core.orbits.kernels.shooting import ShotOrbit
from grazemap_core.records import NamedTuple

IMPACT_COLUMNS = 3
"""Columns that every impact adds: the directions of its terms of second order."""


class CaptureScratch(NamedTuple):
    """Scratch for up to k impacts and N blocks."""

    arrival: Floats
    """(N, 2) An input: the state of the trajectory at phase 0 of the orbit, in the coordinates of `CellProblem`."""
    matrix: Floats
    """(2 N, 2 N) An input: the Floquet matrix before the first impact, in balanced block coordinates."""
    scales: Floats
    """(2 N,) Units of the rows of a difference, in which the norm is expressed."""
    form: Floats
    """(2 N, 2 N) A form over returns, whose inverse is where the norm begins."""
    norm: Floats
    """(2 N, 2 N) The norm's Cholesky factor."""
    power: Floats
    """(2 N, 2 N) Power of the return map's derivative."""
    product: Floats
    """(2 N, 2 N) Product of such powers."""
    sums: Floats
    """(2 N,) Of a row of a product."""
    after: Floats
    """(N, 2) The orbit just after an impact."""
    columns: Floats
    """(2 N (2 N + 3 k),) Differences from the orbit: the axes of the ball, and the terms of second order of every
    impact."""
    displacement: Floats
    """(2 N + 3 k,) Displacement of the contact, for every column."""
    velocity: Floats
    """(2 N + 3 k,) Velocity of the contact, for every column."""
    acceleration: Floats
    """(2 N + 3 k,) Acceleration of the contact, for every column."""
    size: Floats
    """(2 N + 3 k,) Amplitude of a block, for every column."""


def capture_scratch(count: int, blocks: int) -> CaptureScratch:
    """Return scratch for up to `count` impacts."""
    size = 2 * blocks
    columns = size + IMPACT_COLUMNS * count
    return CaptureScratch(
        arrival=np.zeros((blocks, 2)),
        matrix=np.zeros((size, size)),
        scales=np.zeros(size),
        form=np.zeros((size, size)),
        norm=np.zeros((size, size)),
        power=np.zeros((size, size)),
        product=np.zeros((size, size)),
        sums=np.zeros(size),
        after=np.zeros((blocks, 2)),
        columns=np.zeros(size * columns),
        displacement=np.zeros(columns),
        velocity=np.zeros(columns),
        acceleration=np.zeros(columns),
        size=np.zeros(columns),
    )


@fused_kernel
def _sum_over_returns(matrix: Floats, rate: float, shortest: float, norm: Floats, scratch: CaptureScratch) -> bool:
    """Replace a form q by ``sum_(k<n) q(matrix^k x) / rate^(2 k)``, in which the matrix contracts by `rate`.

    It does as soon as ``q(matrix^n x) / rate^(2 n) <= q(x)``; n is doubled until the squared entries of that power sum
    to less than `shortest`, the least ratio of two values of q at vectors of length 1. Returns whether there is such an
    n.
    """
    power, product = scratch.power, scratch.product
    size = matrix.shape[0]
    for row in range(size):
        for column in range(size):
            power[row, column] = matrix[row, column] / rate
    for _ in range(tolerances.NORM_DOUBLINGS):
        multiply(norm, power, product)
        add_transposed_product(power, product, norm, scratch.sums)
        multiply(power, power, product)
        power, product = product, power
        squares = 0.0
        for row in range(size):
            for column in range(size):
                squares += power[row, column] * power[row, column]
        if squares < shortest:
            return True
    return False


@fused_kernel
def contracting_norm(matrix: Floats, rate: float, scratch: CaptureScratch) -> bool:
    """Write the Cholesky factor of a norm in which a matrix contracts by `rate`; return whether there is one.

    The spectral radius of matrix (2 N, 2 N), which is not changed, is below `rate`. The squared norm is the sum of a
    form over returns. The sum over the squared length weighs slow directions most, so its ball is long in the fast
    ones. Its inverse as the form makes all directions of a normal matrix equal.
    """
    norm, form = scratch.norm, scratch.form
    size = matrix.shape[0]
    for row in range(size):
        for column in range(size):
            form[row, column] = 1.0 if row == column else 0.0
    if not _sum_over_returns(matrix, rate, 1.0, form, scratch):
        return False
    trace = 0.0
    for row in range(size):
        trace += form[row, row]
    if not cholesky(form):
        return False
    for c in range(size):  # the inverse, column by column
        for row in range(size):
            value = 1.0 if row == c else 0.0
            for m in range(row):
                value -= form[row, m] * norm[m, c]
            norm[row, c] = value / form[row, row]
        for row in range(size - 1, -1, -1):
            value = norm[row, c]
            for lower in range(row + 1, size):
                value -= form[lower, row] * norm[lower, c]
            norm[row, c] = value / form[row, row]
    return _sum_over_returns(matrix, rate, 1.0 / trace, norm, scratch) and cholesky(norm)


@fused_kernel
def _length(columns: Floats, c: int, scratch: CaptureScratch) -> float:
    """Return the norm of column c."""
    norm, scales = scratch.norm, scratch.scales
    total = 0.0
    for row in range(norm.shape[0]):
        value = 0.0
        for m in range(row, norm.shape[0]):
            value += norm[m, row] * scales[m] * columns[m, c]
        total += value * value
    return math.sqrt(total)


@fused_kernel
def _place_ball(radius: float, scratch: CaptureScratch, columns: Floats) -> None:
    """Write the axes of the ball into the first 2 N columns, and zeros into the others."""
    norm, scales = scratch.norm, scratch.scales
    size = norm.shape[0]
    for row in range(size):
        for c in range(columns.shape[1]):
            columns[row, c] = 0.0
    for c in range(size):
        for row in range(c, -1, -1):  # back substitution with the transposed factor
            value = 1.0 if row == c else 0.0
            for m in range(row + 1, c + 1):
                value -= norm[m, row] * columns[m, c]
            columns[row, c] = value / norm[row, row]
    for row in range(size):
        for c in range(size):
            columns[row, c] *= radius / scales[row]


@any_order_kernel
def _largest_sum(values: Floats, axes: int, used: int) -> float:
    """Return the maximum, over the ball, of a linear form with a value for every column; the first `axes` are axes."""
    squares, others = 0.0, 0.0
    for c in range(axes):
        squares += values[c] * values[c]
    for c in range(axes, used):
        others += abs(values[c])
    return math.sqrt(squares) + others


class _Reach(NamedTuple):
    """Bounds of the changes of the contact's motion, over the ball."""

    displacement: float
    """Bound of the change of the displacement."""
    velocity: float
    """Bound of the change of the first derivative."""
    acceleration: float
    """Bound of the change of the second derivative."""
    jerk: float
    """Bound of the change of the third derivative."""


@fused_kernel
def _sizes_of_block(frequency: float, above: Floats, below: Floats, used: int, size: Floats) -> None:
    """Write the amplitude of a block for every column, whose displacements and velocities are above and below."""
    slower = 1.0 / frequency
    for c in range(used):
        y, rate = above[c], slower * below[c]
        size[c] = math.sqrt(y * y + rate * rate)


@fused_kernel
def _reach_of(problem: OrbitProblem, columns: Floats, used: int, size: Floats) -> _Reach:
    """Return bounds for all times until the next impact, from the energies of the blocks, which do not increase."""
    displacement, velocity, acceleration, jerk, omega = 0.0, 0.0, 0.0, 0.0, problem.omega
    axes = 2 * problem.decay.shape[0]
    for j in range(problem.decay.shape[0]):
        frequency = problem.frequency[j]
        _sizes_of_block(frequency, columns[2 * j], columns[2 * j + 1], used, size)
        energy = _largest_sum(size, axes, used)
        displacement += energy
        velocity += frequency * energy
        stiffness = frequency + 2.0 * problem.decay[j]
        acceleration += frequency * stiffness * energy
        jerk += frequency * stiffness * stiffness * energy
    return _Reach(displacement, velocity / omega, acceleration / (omega * omega), jerk / (omega * omega * omega))


@kernel
def _impact_ratio(speed: float, bent: float, change: float, slower: float) -> float:
    """Return the ratio up to which an impact stays an impact; below 1 it does.

    Where the contact is short of the stop by `change`, or beyond it, and its speed is lower by `slower`, a change of
    the speed at the rate `bent` lets it reach the stop if ``(speed - slower)^2 > 2 bent change``. This holds if ``speed
    (speed - 2 slower)`` exceeds the right side, whose ratio is proportional to the changes. The impact is then earlier
    or later by less than ``2 change/speed``.
    """
    return 2.0 * (bent * change + speed * slower) / (speed * speed)


@kernel
def _time_moved(speed: float, bent: float, change: float, slower: float) -> float:
    """Return a bound on the change of an impact's time if `_impact_ratio` is below 1; see there for the arguments."""
    left = max(speed - slower, 0.5 * speed)
    return 2.0 * change / (left + math.sqrt(max(left * left - 2.0 * bent * change, 0.0)))


@kernel
def _flight_ratio(speed: float, acceleration: float, jerk: float, reach: float, slower: float) -> float:
    """Return the ratio up to which the contact moves to or from a stop as on the orbit; below 1 it does.

    On the orbit it is farther from the stop than `reach` from the time ``2 reach/speed`` after the impact on, or up to
    as long before it; until then it moves away, as the acceleration takes less than ``speed - slower`` of its speed.

    Parameters
    ----------
    speed, acceleration : float
        At the impact; the acceleration is that which lowers the speed, 0 if it raises it.
    jerk : float
        Bound on the derivative of the acceleration.
    reach, slower : float
        Changes of displacement and velocity in the flight.
    """
    return (2.0 * (acceleration + 2.0 * jerk * reach / speed) * reach + speed * slower) / (speed * speed)


@fused_kernel
def _distance_from_orbit(problem: CellProblem, shot: ShotOrbit, uncertainty: float, scratch: CaptureScratch) -> float:
    """Return a bound on the distance of the trajectory from the orbit before the orbit's first impact."""
    norm, scales, difference = scratch.norm, scratch.scales, scratch.displacement
    orbit, phase, state = shot.problem, shot.impacts.phases[0], shot.shooting.state
    row = problem.output_row
    for j in range(row.shape[0]):
        e11, e12, e21, e22 = block_flow(
            problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], phase / orbit.omega
        )
        first = e11 * scratch.arrival[j, 0] + e12 * scratch.arrival[j, 1]
        second = e21 * scratch.arrival[j, 0] + e22 * scratch.arrival[j, 1]
        y = (row[j, 0] * first + row[j, 1] * second) / orbit.length
        velocity = (row[j, 2] * first + row[j, 3] * second) / orbit.length
        difference[2 * j] = scales[2 * j] * (y - state[0, j, 0])
        difference[2 * j + 1] = scales[2 * j + 1] * (velocity - state[0, j, 1])
    total = 0.0
    for m in range(norm.shape[0]):
        value, error = 0.0, 0.0
        for other in range(m, norm.shape[0]):
            frequency = orbit.frequency[other // 2] if other % 2 == 1 else 1.0
            value += norm[other, m] * difference[other]
            error += abs(norm[other, m]) * scales[other] * frequency * uncertainty
        total += (abs(value) + error) ** 2
    return math.sqrt(total)


@fused_kernel
def _jerk_at(problem: OrbitProblem, phase: float, state: Floats) -> float:
    """Return the modulus of the third derivative of q at a phase, where the blocks have `state`."""
    _, _, _, total = steady_motion(problem, math.sin(phase), math.cos(phase))
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        second = -square * state[j, 0] - twice * state[j, 1]
        total -= (square * state[j, 1] + twice * second) / (problem.omega * problem.omega * problem.omega)
    return abs(total)


class _PassedImpact(NamedTuple):
    """An impact of the orbit, and how the trajectory may differ there."""

    rebound: float
    """1 + R of its stop."""
    speed: float
    """Speed toward the stop, > 0."""
    acceleration: float
    """Acceleration toward the stop, just before the impact."""
    jerk: float
    """Modulus of the derivative of the acceleration."""
    snap: float
    """Bound on the derivative of the jerk."""
    moved: float
    """Bound on the change of the time of the impact."""
    changes: _Reach
    """Changes over the ball at that time; the jerk holds for all times."""


@fused_kernel
def _add_second_order(problem: OrbitProblem, impact: _PassedImpact, columns: Floats, used: int) -> float:
    """Write the terms of second order of an impact into three columns; return the ratio up to which they are known.

    The impact is later by ``t``, and its speed is ``w`` instead of ``v``. The terms are those of
    ``w exp(-T t) k - v k`` that the saltation matrix does not have, with k the unit impulse and T the blocks'
    generator: ``(w - w_1) k``, ``(a + da) t^2/2 T k`` and ``w t^2/2 T^2 k``. In the second one the changes of the
    velocity cancel. Each is bounded, with what follows it in the Taylor series. The columns are the next ones after the
    first `used`.
    """
    omega, at = problem.omega, impact.changes
    rebound, speed, jerk, moved = impact.rebound, impact.speed, impact.jerk, impact.moved
    bent = abs(impact.acceleration)
    sharper, changed = jerk + impact.snap * moved, at.acceleration + at.jerk * moved
    half_square = 0.5 * moved * moved
    late = ((bent + changed) * half_square + at.velocity * moved + sharper * half_square * moved / 3.0) / speed
    of_impulse = rebound * omega * (bent * late + (sharper + at.jerk) * half_square + at.acceleration * moved)
    of_first = rebound * (bent + changed + sharper * moved) * half_square
    stiffest = 0.0
    for j in range(problem.decay.shape[0]):
        stiffest = max(stiffest, (problem.frequency[j] + 2.0 * problem.decay[j]) / omega)
    strongest = speed + at.velocity + (bent + changed) * moved
    of_second = rebound / omega * strongest * half_square * (1.0 + stiffest * moved)
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        impulse, first = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        second = -square * impulse - twice * first
        columns[2 * j, used], columns[2 * j + 1, used] = of_impulse * impulse, of_impulse * first
        columns[2 * j, used + 1], columns[2 * j + 1, used + 1] = of_first * first, of_first * second
        third = -square * first - twice * second
        columns[2 * j, used + 2], columns[2 * j + 1, used + 2] = of_second * second, of_second * third
    return tolerances.SECOND_ORDER * stiffest * moved


@fused_kernel
def _pass_impact(
    problem: OrbitProblem, impact: _PassedImpact, columns: Floats, used: int, scratch: CaptureScratch
) -> None:
    """Change the columns by the saltation matrix of an impact; `displacement` and `velocity` hold those of q.

    Speed and acceleration are those toward the stop: with those of q, on the left stop, the two signs would cancel.
    """
    omega, rebound, speed, acceleration = problem.omega, impact.rebound, impact.speed, impact.acceleration
    displacement, velocity = scratch.displacement, scratch.velocity
    sooner = -1.0 / speed
    for c in range(used):
        later = sooner * displacement[c]
        displacement[c] = rebound * speed * later
        velocity[c] = -rebound * omega * (velocity[c] + acceleration * later)
    for j in range(problem.decay.shape[0]):
        impulse, first = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        second = -problem.frequency_squared[j] * impulse - 2.0 * problem.decay[j] * first
        above, below = columns[2 * j], columns[2 * j + 1]
        for c in range(used):
            above[c] += velocity[c] * impulse + displacement[c] * first
            below[c] += velocity[c] * first + displacement[c] * second


@fused_kernel
def _pass_flight(flow: Floats, columns: Floats, used: int) -> None:
    """Carry the columns over a flight, whose flow (N, 4) is given."""
    for j in range(flow.shape[0]):
        e11, e12, e21, e22 = flow[j, 0], flow[j, 1], flow[j, 2], flow[j, 3]
        above, below = columns[2 * j], columns[2 * j + 1]
        for c in range(used):
            y, rate = above[c], below[c]
            above[c] = e11 * y + e12 * rate
            below[c] = e21 * y + e22 * rate


@fused_kernel
def _write_outputs(problem: OrbitProblem, columns: Floats, used: int, scratch: CaptureScratch) -> None:
    """Write the displacement, velocity and acceleration of the contact that every column stands for."""
    omega, slower = problem.omega, 1.0 / problem.omega
    displacement, velocity, acceleration = scratch.displacement, scratch.velocity, scratch.acceleration
    for c in range(used):
        displacement[c], velocity[c], acceleration[c] = 0.0, 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j] / (omega * omega), 2.0 * problem.decay[j] / omega
        above, below = columns[2 * j], columns[2 * j + 1]
        for c in range(used):
            y, rate = above[c], slower * below[c]
            displacement[c] += y
            velocity[c] += rate
            acceleration[c] -= square * y + twice * rate


@fused_kernel
def _pass_return(orbit: ShotOrbit, columns: Floats, scratch: CaptureScratch) -> tuple[float, float]:
    """Carry the ball over one return; return the largest ratio and the largest change of the contact's displacement."""
    problem, impacts, shooting = orbit.problem, orbit.impacts, orbit.shooting
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count, blocks = sides.shape[0], problem.decay.shape[0]
    omega, axes = problem.omega, 2 * blocks
    used = axes
    displacement, velocity, acceleration = scratch.displacement, scratch.velocity, scratch.acceleration
    steady = steady_bound(problem, 3)
    ratio, farthest, stiffest = 0.0, 0.0, highest_order(problem)
    for j in range(blocks):
        stiffest = max(stiffest, (problem.frequency[j] + 2.0 * problem.decay[j]) / omega)
    for i in range(count):
        _write_outputs(problem, columns, used, scratch)
        at = _Reach(
            _largest_sum(displacement, axes, used),
            _largest_sum(velocity, axes, used),
            _largest_sum(acceleration, axes, used),
            _reach_of(problem, columns, used, scratch.size).jerk,
        )
        speed, toward = sides[i] * speeds[i], sides[i] * shooting.before[i, 2]
        jerk = _jerk_at(problem, phases[i], shooting.state[i])
        snap = stiffest * third_derivative_bound(problem, steady, shooting.state[i])
        # with what the acceleration changes by until the trajectory's impact
        sharper = jerk + at.jerk + snap * at.displacement / speed
        bent = abs(toward) + at.acceleration + sharper * at.displacement / speed
        ratio = max(ratio, _impact_ratio(speed, bent, at.displacement, at.velocity))
        moved = _time_moved(speed, bent, at.displacement, at.velocity)
        rebound = rebound_of(stops, sides[i])
        impact = _PassedImpact(rebound, speed, toward, jerk, snap, moved, at)
        _pass_impact(problem, impact, columns, used, scratch)
        ratio = max(ratio, _add_second_order(problem, impact, columns, used))
        used += IMPACT_COLUMNS
        # the flight to the next impact
        flight = _reach_of(problem, columns, used, scratch.size)
        farthest = max(farthest, flight.displacement)
        impulse = -rebound * omega * speeds[i]
        after = toward
        for j in range(blocks):
            first, second = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
            scratch.after[j, 0] = shooting.state[i, j, 0] + impulse * first
            scratch.after[j, 1] = shooting.state[i, j, 1] + impulse * second
            third = -problem.frequency_squared[j] * first - 2.0 * problem.decay[j] * second
            after -= rebound * speed * third / omega
        if not ratio < 1.0:
            break
        jerk = third_derivative_bound(problem, steady, scratch.after)
        leaving = restitution_of(stops, sides[i]) * speed
        ratio = max(ratio, _flight_ratio(leaving, max(after, 0.0), jerk, flight.displacement, flight.velocity))
        following = i + 1 if i + 1 < count else 0
        arriving, toward = abs(speeds[following]), sides[following] * shooting.before[following, 2]
        ratio = max(ratio, _flight_ratio(arriving, max(toward, 0.0), jerk, flight.displacement, flight.velocity))
        _pass_flight(shooting.flow[i], columns, used)
    return ratio, farthest


@kernel
def capture_ratio(
    problem: CellProblem, shot: ShotOrbit, multiplier: float, uncertainty: float, scratch: CaptureScratch
) -> tuple[float, float, float]:
    """Return whether a trajectory is captured by a stable orbit, as far as impacts and convergence decide it.

    Parameters
    ----------
    shot : ShotOrbit
        The orbit.
    multiplier : float
        Spectral radius of `matrix`, < 1.
    uncertainty : float
        Bound on the distance of the numbers from the orbit, as a displacement of the contact.
    scratch : CaptureScratch
        With `arrival` and `matrix`.

    Returns
    -------
    ratio : float
        Below 1: captured. Otherwise the factor, to leading order, by which its distance from the orbit is too large.
    reach : float
        Largest change of q over the ball: the orbit's other extrema have to be farther from the stops.
    share : float
        Radius of that ball over the distance of the trajectory from the orbit: 1 where the trajectory is captured, less
        where only a smaller ball is.
    """
    orbit, impacts = shot.problem, shot.impacts
    size = 2 * orbit.decay.shape[0]
    rate = multiplier + tolerances.CAPTURE_MARGIN * (1.0 - multiplier)
    for i in range(impacts.sides.shape[0]):
        if not restitution_of(impacts.stops, impacts.sides[i]) > 0.0:
            return math.inf, 0.0, 1.0
    if not contracting_norm(scratch.matrix, rate, scratch):
        return math.inf, 0.0, 1.0
    for j in range(orbit.decay.shape[0]):
        scale = block_scale(orbit, j)
        scratch.scales[2 * j], scratch.scales[2 * j + 1] = orbit.frequency[j] / scale, 1.0 / scale
    radius = _distance_from_orbit(problem, shot, uncertainty, scratch)
    width = size + IMPACT_COLUMNS * impacts.sides.shape[0]
    columns = scratch.columns[: size * width].reshape((size, width))
    share = 1.0
    for _ in range(tolerances.CAPTURE_TRIALS):
        _place_ball(share * radius, scratch, columns)
        ratio, reach = _pass_return(shot, columns, scratch)
        if ratio < 1.0:
            longer = 0.0
            for c in range(size, width):
                longer += _length(columns, c, scratch)
            ratio = max(ratio, longer / ((1.0 - rate) * share * radius))
        if ratio < 1.0:
            return max(ratio, 1.0 if share < 1.0 else 0.0), reach, share
        share *= tolerances.CAPTURE_SHARE / ratio
    return math.inf, 0.0, 1.0
