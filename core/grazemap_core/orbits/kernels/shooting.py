"""The equations of a periodic motion with impacts, by shooting: the cost is linear in the number of impacts.

The equations, their unknowns and units are those of `equations`. There, the responses to all impacts are summed at
every impact; this is regular for impacts of velocity 0, but costs the square of the number of impacts, and solving for
the step costs its cube. Here, the state is carried from impact to impact, and the Jacobian is reduced to a matrix of
the size of the structure. The reduction divides by the impact velocities, so none may be 0; this holds for motions to
which trajectories settle.

A perturbation d of the state just before impact i becomes, just after it,

    d - (1 + R) w (s' k - s p' T k/w),     p' = (r - c d)/v,    s' = c' d/w + a p' - q

with p', s' the changes of phase and speed that leave residuals r and q, R the restitution of the stop, k the unit
impulse, T the blocks' generator, c d and c' d the displacement and velocity of the contact in d, v and a the velocity
and acceleration of the contact, and w the frequency.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import gap_of
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.jit.compiled import fused_kernel, kernel
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits.kernels.equations import (
    OrbitImpacts,
    OrbitProblem,
    highest_order,
    next_phase,
    rebound_of,
    steady_bound,
    steady_motion,
)
from grazemap_core.records import NamedTuple


class Shooting(NamedTuple):
    """Scratch for k impacts and N blocks."""

    closing: Floats
    """(N, 2) p and q with ``p + q T = sum_(j>=1) (sign E)^j``, E a block's flow over a span; an input."""
    flow: Floats
    """(k, N, 4) Each block's flow from an impact to the next one."""
    state: Floats
    """(k, N, 2) Each block's part in displacement and velocity of the contact just before every impact."""
    before: Floats
    """(k, 3) Displacement, velocity and acceleration of the contact just before every impact."""
    residual: Floats
    """(k, 2) Residuals of displacement and speed."""
    step: Floats
    """(k, 2) Steps of phase and speed."""
    turned: Floats
    """(2 N, 2 N + 1) Effect of perturbations before the first impact, and of the residuals, after one span."""
    system: Floats
    """(2 N, 4 N) For elimination."""
    change: Floats
    """(2 N, 1) The change of the state that belongs to the step."""
    across: Floats
    """(4, 2 N + 1) For each column of perturbations at an impact: displacement, velocity, and changes of phase and
    speed."""
    second_derivative: Floats
    """(N,) Response of each block's part in the acceleration of the contact to a unit impulse."""
    places: Floats
    """(k, 2 N) Effect of a unit residual of displacement at an impact on the state after the span."""
    speeds: Floats
    """(k, 2 N) Effect of a unit residual of speed, likewise."""
    basis: Floats
    """(2 N, 2 N) The identity, carried back from the end of the span."""
    rows: Floats
    """(2 N, 2 k) Rows of the inverse, carried back from their impacts."""
    closed: Floats
    """(2 N, 2 k) Effect of the closing of the orbit on these rows."""
    of_place: Floats
    """(k, 2 k) Entries of the inverse for residuals of displacement."""
    of_speed: Floats
    """(k, 2 k) Entries of the inverse for residuals of speed."""
    totals: Floats
    """(2 k,) Sums of the moduli of the rows of the inverse."""


class ShotOrbit(NamedTuple):
    """An orbit with what `shoot` and `solve_step` wrote for it."""

    problem: OrbitProblem
    """Its equations."""
    impacts: OrbitImpacts
    """Its impacts."""
    shooting: Shooting
    """What was written."""


def shooting(count: int, blocks: int) -> Shooting:
    """Return scratch for up to `count` impacts."""
    size = 2 * blocks
    return Shooting(
        closing=np.zeros((blocks, 2)),
        flow=np.zeros((count, blocks, 4)),
        state=np.zeros((count, blocks, 2)),
        before=np.zeros((count, 3)),
        residual=np.zeros((count, 2)),
        step=np.zeros((count, 2)),
        turned=np.zeros((size, size + 1)),
        system=np.zeros((size, 2 * size)),
        change=np.zeros((size, 1)),
        across=np.zeros((4, size + 1)),
        second_derivative=np.zeros(blocks),
        places=np.zeros((count, size)),
        speeds=np.zeros((count, size)),
        basis=np.zeros((size, size)),
        rows=np.zeros((size, 2 * count)),
        closed=np.zeros((size, 2 * count)),
        of_place=np.zeros((count, 2 * count)),
        of_speed=np.zeros((count, 2 * count)),
        totals=np.zeros(2 * count),
    )


@kernel
def shoot(problem: OrbitProblem, impacts: OrbitImpacts, scratch: Shooting) -> tuple[float, float]:
    """Carry the state from impact to impact over a span; write flow, state, before and residual.

    Returns
    -------
    residual : float
        Largest residual.
    terms : float
        As `equations.assemble`, summed over all impacts and all earlier spans.
    """
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    count, blocks = sides.shape[0], problem.decay.shape[0]
    omega, highest = problem.omega, highest_order(problem)
    flow, state = scratch.flow, scratch.state
    terms_sum = 0.0
    for j in range(blocks):
        decay, square, frequency = problem.decay[j], problem.frequency_squared[j], problem.frequency[j]
        unit_impulse, drift = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        y, rate, summed = 0.0, 0.0, 0.0
        for i in range(count):
            time = (next_phase(problem, phases, i) - phases[i]) / omega
            e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, time)
            flow[i, j, 0], flow[i, j, 1], flow[i, j, 2], flow[i, j, 3] = e11, e12, e21, e22
            strength = -rebound_of(stops, sides[i]) * omega * speeds[i]
            y, rate = y + strength * unit_impulse, rate + strength * drift
            summed += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
            y, rate = e11 * y + e12 * rate, e21 * y + e22 * rate
        # the periodic state: the response to one span, summed over all earlier spans
        p, q = 1.0 + scratch.closing[j, 0], scratch.closing[j, 1]
        terms_sum += summed * (abs(p) + abs(q) * (frequency + 2.0 * decay))
        state[0, j, 0] = problem.sign * (p * y + q * rate)
        state[0, j, 1] = problem.sign * (p * rate - q * (square * y + 2.0 * decay * rate))
    size = steady_bound(problem, 0)
    largest, terms = 0.0, 0.0
    for i in range(count):
        sine, cosine = math.sin(phases[i]), math.cos(phases[i])
        x, v, a, _ = steady_motion(problem, sine, cosine)
        place = gap_of(stops, sides[i]) / problem.length
        strength = -rebound_of(stops, sides[i]) * omega * speeds[i]
        for j in range(blocks):
            y, rate = state[i, j, 0], state[i, j, 1]
            frequency = problem.frequency[j]
            x += y
            v += rate / omega
            a -= (problem.frequency_squared[j] * y + 2.0 * problem.decay[j] * rate) / (omega * omega)
            terms_sum += abs(y) + abs(rate) / frequency
            if i + 1 < count:
                y, rate = y + strength * problem.unit_impulse[j, 0], rate + strength * problem.unit_impulse[j, 1]
                state[i + 1, j, 0] = flow[i, j, 0] * y + flow[i, j, 1] * rate
                state[i + 1, j, 1] = flow[i, j, 2] * y + flow[i, j, 3] * rate
                time = (phases[i + 1] - phases[i]) / omega
                terms_sum += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
        scratch.before[i, 0], scratch.before[i, 1], scratch.before[i, 2] = x, v, a
        scratch.residual[i, 0], scratch.residual[i, 1] = x - sides[i] * place, v - speeds[i]
        largest = max(largest, max(abs(scratch.residual[i, 0]), abs(scratch.residual[i, 1])))
        terms = max(terms, size * (1.0 + highest * abs(phases[i])) + abs(place))
    return largest, terms + terms_sum


@fused_kernel
def _pass_impact(problem: OrbitProblem, impacts: OrbitImpacts, i: int, change: Floats, scratch: Shooting) -> None:
    """Carry columns of perturbations (2 N, n) from just before impact i to just before the next one.

    Changes of phase and speed compensate for the residuals in the last column, and for none in the others.
    """
    flow, across, second_derivative = scratch.flow, scratch.across, scratch.second_derivative
    omega, rebound, speed = problem.omega, rebound_of(impacts.stops, impacts.sides[i]), impacts.speeds[i]
    blocks, columns = second_derivative.shape[0], change.shape[1]
    per_velocity, per_omega, acceleration = 1.0 / scratch.before[i, 1], 1.0 / omega, scratch.before[i, 2]
    x, v, turned, faster = across[0], across[1], across[2], across[3]
    for c in range(columns):
        x[c], v[c] = 0.0, 0.0
    x[columns - 1], v[columns - 1] = scratch.residual[i, 0], omega * scratch.residual[i, 1]
    for j in range(blocks):
        above, below = change[2 * j], change[2 * j + 1]
        for c in range(columns):
            x[c] += above[c]
            v[c] += below[c]
    for c in range(columns):
        turned[c] = -x[c] * per_velocity
        faster[c] = v[c] * per_omega + acceleration * turned[c]
    for j in range(blocks):
        unit_impulse, drift, viscous_term = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1], second_derivative[j]
        e11, e12, e21, e22 = flow[i, j, 0], flow[i, j, 1], flow[i, j, 2], flow[i, j, 3]
        above, below = change[2 * j], change[2 * j + 1]
        for c in range(columns):
            strength, shift = -rebound * omega * faster[c], rebound * speed * turned[c]
            y = above[c] + strength * unit_impulse + shift * drift
            rate = below[c] + strength * drift + shift * viscous_term
            above[c] = e11 * y + e12 * rate
            below[c] = e21 * y + e22 * rate


@kernel
def solve_step(problem: OrbitProblem, impacts: OrbitImpacts, scratch: Shooting) -> float:
    """Write the Newton step and the effect of perturbations after one span; return the norm of the step.

    `shoot` is called before. The norm is infinity where the matrix is singular.
    """
    count, size = impacts.speeds.shape[0], 2 * problem.decay.shape[0]
    turned, system, second_derivative = scratch.turned, scratch.system, scratch.second_derivative
    for j in range(second_derivative.shape[0]):
        second_derivative[j] = -(
            problem.frequency_squared[j] * problem.unit_impulse[j, 0]
            + 2.0 * problem.decay[j] * problem.unit_impulse[j, 1]
        )
    for row in range(size):
        for column in range(size + 1):
            turned[row, column] = 1.0 if row == column else 0.0
    for i in range(count):
        _pass_impact(problem, impacts, i, turned, scratch)
    for row in range(size):
        for column in range(size):
            system[row, column] = (problem.sign if row == column else 0.0) - turned[row, column]
        system[row, size] = turned[row, size]
    if eliminate(system[:, : size + 1], size) == 0.0:
        return math.inf
    for row in range(size):
        scratch.change[row, 0] = system[row, size]
    largest = 0.0
    for i in range(count):
        _pass_impact(problem, impacts, i, scratch.change, scratch)
        p, s = scratch.across[2, 0], scratch.across[3, 0]
        scratch.step[i, 0], scratch.step[i, 1] = p, s
        # NaN counts as infinite
        largest = max(largest, max(abs(p), abs(s))) if abs(p) + abs(s) < math.inf else math.inf
    return largest


class _Functionals(NamedTuple):
    """Linear functionals of the state."""

    rows: Floats
    """(2 N, n) A functional in each column."""
    columns: int
    """Number of columns that are functionals, the first ones."""
    of_place: Floats
    """(n,) Receives their values for a unit residual of displacement at an impact."""
    of_speed: Floats
    """(n,) Receives their values for a unit residual of speed."""


@fused_kernel
def _back_over(
    problem: OrbitProblem, impacts: OrbitImpacts, i: int, functionals: _Functionals, scratch: Shooting
) -> None:
    """Carry functionals back from just before impact i + 1 to just before impact i, with their values for residuals."""
    flow, second_derivative = scratch.flow, scratch.second_derivative
    rows, columns, place, faster = functionals
    omega, rebound, speed = problem.omega, rebound_of(impacts.stops, impacts.sides[i]), impacts.speeds[i]
    blocks = second_derivative.shape[0]
    per_velocity, per_omega, acceleration = 1.0 / scratch.before[i, 1], 1.0 / omega, scratch.before[i, 2]
    for c in range(columns):
        place[c], faster[c] = 0.0, 0.0
    for j in range(blocks):
        unit_impulse, drift, viscous_term = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1], second_derivative[j]
        e11, e12, e21, e22 = flow[i, j, 0], flow[i, j, 1], flow[i, j, 2], flow[i, j, 3]
        above, below = rows[2 * j], rows[2 * j + 1]
        for c in range(columns):
            a, b = above[c], below[c]
            y, rate = a * e11 + b * e21, a * e12 + b * e22
            above[c], below[c] = y, rate
            faster[c] -= rebound * omega * (y * unit_impulse + rate * drift)
            place[c] += rebound * speed * (y * drift + rate * viscous_term)
    for c in range(columns):
        place[c] = -(place[c] + acceleration * faster[c]) * per_velocity
    for j in range(blocks):
        above, below = rows[2 * j], rows[2 * j + 1]
        for c in range(columns):
            above[c] += place[c]
            below[c] += faster[c] * per_omega


@fused_kernel
def _add_combination(of_rows: Floats, rows: Floats, columns: int, total: Floats) -> None:
    """Add ``of_rows^T rows`` to total (n,), with of_rows (2 N,), in the first `columns` columns of rows (2 N, n)."""
    for j in range(of_rows.shape[0] // 2):
        first, second, above, below = of_rows[2 * j], of_rows[2 * j + 1], rows[2 * j], rows[2 * j + 1]
        for c in range(columns):
            total[c] += first * above[c] + second * below[c]


@fused_kernel
def _add_moduli(values: Floats, columns: int, total: Floats) -> None:
    """Add the moduli of the first `columns` values to total."""
    for c in range(columns):
        total[c] += abs(values[c])


@kernel
def _largest_sum_of_moduli(count: int, size: int, scratch: Shooting) -> float:
    """Return the maximum norm of the inverse, from its rows as `norm_of_inverse` leaves them; infinity for NaN."""
    rows, closed, totals = scratch.rows, scratch.closed, scratch.totals
    columns = 2 * count
    for d in range(size):
        for c in range(columns):
            closed[d, c] = 0.0
        _add_combination(scratch.system[:, size + d], rows, columns, closed[d])
    for c in range(columns):
        totals[c] = 0.0
    for i in range(count):
        for through, direct in ((scratch.places[i], scratch.of_place[i]), (scratch.speeds[i], scratch.of_speed[i])):
            _add_combination(through, closed, columns, direct)
            _add_moduli(direct, columns, totals)
    largest = 0.0
    for c in range(columns):
        if not totals[c] < math.inf:
            return math.inf
        largest = max(largest, totals[c])
    return largest


@kernel
def norm_of_inverse(problem: OrbitProblem, impacts: OrbitImpacts, scratch: Shooting) -> float:
    """Return the maximum norm of the inverse of the Jacobian; `solve_step` is called before.

    Each row of the inverse belongs to a phase or a speed; all rows are carried back to the residuals together, as
    columns, those of the last impact first.
    """
    count, blocks = impacts.speeds.shape[0], problem.decay.shape[0]
    size = 2 * blocks
    system, basis, rows = scratch.system, scratch.basis, scratch.rows
    for row in range(size):
        for column in range(size):
            system[row, column] = (problem.sign if row == column else 0.0) - scratch.turned[row, column]
            system[row, size + column] = 1.0 if row == column else 0.0
    if eliminate(system, size) == 0.0:
        return math.inf
    # the coordinates of the state after the span
    for row in range(size):
        for c in range(size):
            basis[row, c] = 1.0 if row == c else 0.0
    for i in range(count - 1, -1, -1):
        _back_over(problem, impacts, i, _Functionals(basis, size, scratch.places[i], scratch.speeds[i]), scratch)
    # each phase and speed, from its impact back to the first one
    for i in range(count - 1, -1, -1):
        of_place, of_speed = scratch.of_place[i], scratch.of_speed[i]
        phase = 2 * (count - 1 - i)
        _back_over(problem, impacts, i, _Functionals(rows, phase, of_place, of_speed), scratch)
        velocity, acceleration = scratch.before[i, 1], scratch.before[i, 2]
        for j in range(blocks):
            rows[2 * j, phase], rows[2 * j + 1, phase] = -1.0 / velocity, 0.0
            rows[2 * j, phase + 1], rows[2 * j + 1, phase + 1] = -acceleration / velocity, 1.0 / problem.omega
        # residuals at its own impact, besides those that act through the state
        of_place[phase], of_speed[phase] = rows[0, phase], 0.0
        of_place[phase + 1], of_speed[phase + 1] = rows[0, phase + 1], 1.0
        for c in range(phase + 2, 2 * count):
            of_place[c], of_speed[c] = 0.0, 0.0
    return _largest_sum_of_moduli(count, size, scratch)
