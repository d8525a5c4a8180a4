"""Periodic motions with any impacts, from M, C, K, h, the forces and R alone, in 50 digits.

Nothing of the equations tested is used. Given the times and sizes of the impulses, the periodic motion is one linear
system: the state just before the first impulse comes back to itself (to its mirror image) over flows, which are matrix
exponentials, and impulses. Newton's method on the times and velocities has a Jacobian by differences of 1e-25. The
linearised motion is a product of flows and saltation matrices S = G + (F+ - G F-) h^T/(h^T F-).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import acb, acb_mat, arb, arb_mat

from tests.oracles.fifty_digits import Chain, digits, first_order_of, secant, tridiagonal

DIFFERENCE = arb("1e-25")


def chain_of(oscillator: Any) -> Chain:
    """Take over the numbers, and nothing else, of the core's oscillator."""
    if oscillator.gamma is not None:
        return Chain.proportional(oscillator.masses, oscillator.stiffnesses, oscillator.gamma, oscillator.forcing)
    return Chain(oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing)


def identity(size: int) -> arb_mat:
    return arb_mat([[arb(int(i == j)) for j in range(size)] for i in range(size)])


def column(values: Any) -> arb_mat:
    return arb_mat([[arb(value)] for value in values])


def stacked(above: arb_mat, below: arb_mat) -> arb_mat:
    return arb_mat([[x] for x in [*above.entries(), *below.entries()]])


class Linear:
    """M, C, K, h, the forces and the bias of an oscillator of the core: exact doubles, of chains exact products."""

    def __init__(self, oscillator: Any) -> None:
        self.size = oscillator.size
        if hasattr(oscillator.structure, "link_damping"):
            chain = chain_of(oscillator)
            self.stiffness, self.damping = (
                arb_mat(tridiagonal(chain.stiffnesses)),
                arb_mat(tridiagonal(chain.link_damping)),
            )
            self.mass = arb_mat(
                [[arb(m) if i == j else arb(0) for j in range(self.size)] for i, m in enumerate(chain.masses)]
            )
        else:
            both = (oscillator.mass_matrix, oscillator.damping_matrix, oscillator.stiffness_matrix)
            self.mass, self.damping, self.stiffness = (
                arb_mat([[arb(float(x)) for x in row] for row in m]) for m in both
            )
        self.row = [arb(float(x)) for x in oscillator.contact]
        self.forces = [(harmonic.order, harmonic) for harmonic in oscillator.drive]
        self.bias = column([float(x) for x in oscillator.bias])
        response = self.mass.solve(column([float(x) for x in oscillator.contact]))
        self.jump = response * (1 / self.along(response))

    def along(self, vector: arb_mat, offset: int = 0) -> arb:
        """The contact coordinate of displacements; of velocities with the offset N."""
        return sum((h * vector[offset + i, 0] for i, h in enumerate(self.row)), arb(0))

    @cached_property
    def generator(self) -> arb_mat:
        return first_order_of(self.mass.solve(self.stiffness), self.mass.solve(self.damping))

    def amplitudes(self, omega: arb) -> list[tuple[arb, list[acb], list[acb]]]:
        """For each harmonic its frequency, the forces, and the steady motion."""
        responses, count = [], self.size
        for order, harmonic in self.forces:
            s = order * omega
            forces = [
                acb(float(c.real), float(c.imag))
                + acb(0, 1) * s * acb(float(r.real), float(r.imag))
                + s * s * acb(float(q.real), float(q.imag))
                for c, r, q in zip(harmonic.constant, harmonic.rate, harmonic.quadratic, strict=True)
            ]
            rows = [
                [acb(self.stiffness[i, j] - s * s * self.mass[i, j], s * self.damping[i, j]) for j in range(count)]
                for i in range(count)
            ]
            solved = acb_mat(rows).solve(acb_mat([[f] for f in forces]))
            responses.append((s, forces, [solved[i, 0] for i in range(count)]))
        return responses

    def steady(self, omega: arb, time: arb) -> arb_mat:
        """State of the motion without impacts, about which the free motion is."""
        place, rate = self.stiffness.solve(self.bias), arb_mat(self.size, 1)
        for s, _, amplitudes in self.amplitudes(omega):
            turned = [x * (acb(0, 1) * s * time).exp() for x in amplitudes]
            place, rate = place + column([x.imag for x in turned]), rate + column([s * x.real for x in turned])
        return stacked(place, rate)

    def push(self, omega: arb, time: arb) -> arb_mat:
        """``(0, M^-1 (F + s))``."""
        total = self.bias
        for s, forces, _ in self.amplitudes(omega):
            total = total + column([(f * (acb(0, 1) * s * time).exp()).imag for f in forces])
        return stacked(arb_mat(self.size, 1), self.mass.solve(total))

    def impulse(self, size: arb) -> arb_mat:
        """The change of the state by an impulse that changes the velocity of the contact by `size`."""
        return stacked(arb_mat(self.size, 1), self.jump * size)

    def bounce(self, rebound: arb) -> arb_mat:
        """The matrix of an impact."""
        count, matrix = self.size, identity(2 * self.size)
        for i in range(count):
            for j in range(count):
                matrix[count + i, count + j] = matrix[count + i, count + j] - rebound * self.jump[i, 0] * self.row[j]
        return matrix

    def saltation(self, rebound: arb, omega: arb, time: arb, state: arb_mat) -> arb_mat:
        """The linearised impact; `state` is that just before it."""
        bounce, push = self.bounce(rebound), self.push(omega, time)
        before, after = self.generator * state + push, self.generator * (bounce * state) + push
        jump, velocity, matrix = after - bounce * before, self.along(state, self.size), arb_mat(bounce)
        for i in range(2 * self.size):
            for j, h in enumerate(self.row):
                matrix[i, j] = matrix[i, j] + jump[i, 0] * h / velocity
        return matrix


@dataclass(frozen=True)
class ImpactOrbit:
    """Times and velocities of the impacts of a span; after it they repeat, with the sign -1 on the other stop."""

    oscillator: Any
    omega: arb
    clearance: tuple[arb, arb]
    stops: list[int]
    half_periods: int
    sign: int
    times: list[arb]
    velocities: list[arb]

    @classmethod
    def near(cls, oscillator: Any, omega: float, clearance: Any, impacts: Any) -> ImpactOrbit:
        """The orbit that an impact sequence of the core is near to; times are exact quotients of its phases."""
        both = clearance if isinstance(clearance, tuple) else (clearance, clearance)
        return cls(
            oscillator,
            arb(omega),
            tuple(arb("inf") if gap is None else arb(float(gap)) for gap in both),
            [int(s) for s in impacts.stops],
            impacts.period * (1 if impacts.symmetric else 2),
            -1 if impacts.symmetric else 1,
            [arb(float(p)) / arb(omega) for p in impacts.phases],
            [arb(float(v)) for v in impacts.velocities],
        )

    def with_unknowns(self, unknowns: list[arb]) -> ImpactOrbit:
        count = len(self.stops)
        values = [value.mid() for value in unknowns]
        return ImpactOrbit(
            self.oscillator,
            self.omega,
            self.clearance,
            self.stops,
            self.half_periods,
            self.sign,
            values[:count],
            values[count:],
        )

    @cached_property
    def linear(self) -> Linear:
        return Linear(self.oscillator)

    def rebound(self, stop: int) -> arb:
        return 1 + arb(self.oscillator.restitution_of(stop))

    def flows(self) -> list[arb_mat]:
        """Over the times between one impact and the next."""
        generator = self.linear.generator
        span = arb.pi() * self.half_periods / self.omega
        ends = [*self.times[1:], self.times[0] + span]
        return [(generator * (end - time)).exp() for end, time in zip(ends, self.times, strict=True)]

    def states(self) -> list[arb_mat]:
        """States just before every impact."""
        count = self.oscillator.size
        linear, hits = self.linear, list(zip(self.stops, self.velocities, strict=True))
        impulses = [linear.impulse(-self.rebound(stop) * velocity) for stop, velocity in hits]
        flows = self.flows()
        whole, added = identity(2 * count), arb_mat(2 * count, 1)
        for flow, impulse in zip(flows, impulses, strict=True):
            whole, added = flow * whole, flow * (added + impulse)
        free = (identity(2 * count) - whole * self.sign).solve(added * self.sign)
        states = []
        for time, flow, impulse in zip(self.times, flows, impulses, strict=True):
            states.append(free + linear.steady(self.omega, time))
            free = flow * (free + impulse)
        return states

    def residual(self) -> list[arb]:
        linear, states = self.linear, self.states()
        places = [s * self.clearance[0 if s > 0 else 1] for s in self.stops]
        return [linear.along(x) - place for x, place in zip(states, places, strict=True)] + [
            linear.along(x, linear.size) - v for x, v in zip(states, self.velocities, strict=True)
        ]

    def solved(self) -> ImpactOrbit:
        """The orbit, by Newton's method to 40 digits."""
        orbit = self
        for _ in range(8):
            unknowns = [*orbit.times, *orbit.velocities]
            residual = orbit.residual()
            columns = []
            for i in range(len(unknowns)):
                moved = [u + DIFFERENCE if j == i else u for j, u in enumerate(unknowns)]
                change = zip(orbit.with_unknowns(moved).residual(), residual, strict=True)
                columns.append([(after - before) / DIFFERENCE for after, before in change])
            size = len(unknowns)
            matrix = arb_mat([[columns[j][i].mid() for j in range(size)] for i in range(size)])
            step = matrix.solve(arb_mat([[r.mid()] for r in residual]))
            orbit = orbit.with_unknowns([unknowns[i] - step[i, 0] for i in range(size)])
            if all(abs(step[i, 0]) < 1e-22 for i in range(size)):
                # convergence is quadratic as far as the differences go: 1e-22 leaves 1e-44
                return orbit
        raise ArithmeticError("Newton's method does not converge")

    def monodromy(self) -> arb_mat:
        """Flows times saltation matrices, from just before the first impact to just before its repetition."""
        matrix = identity(2 * self.oscillator.size) * self.sign
        for stop, time, state, flow in zip(self.stops, self.times, self.states(), self.flows(), strict=True):
            matrix = flow * self.linear.saltation(self.rebound(stop), self.omega, time, state) * matrix
        return matrix

    def multipliers(self) -> list[complex]:
        """Eigenvalues of the monodromy matrix, of the signed half period for symmetric motions."""
        return eigenvalues(self.monodromy())

    def test_function(self, multiplier: int) -> arb:
        """``prod v_i det(mu I - M)``, smooth where a velocity vanishes."""
        size = 2 * self.oscillator.size
        product = arb(1)
        for velocity in self.velocities:
            product *= velocity
        return (identity(size) * multiplier - self.monodromy()).det() * product


class OneImpact:
    """The motions with one impact in a span at one frequency, as functions of the phase omega t of the impact.

    With the phase given, the state just before the impact is one linear system; the sign is as of an `ImpactOrbit`.
    """

    def __init__(self, oscillator: Any, omega: arb, half_periods: int, sign: int = 1, stop: int = 1) -> None:
        self.linear, self.omega, self.stop = Linear(oscillator), omega, stop
        self.span = arb.pi() * half_periods / omega
        self.flow = (self.linear.generator * self.span).exp() * sign
        self.rebound = 1 + arb(oscillator.restitution_of(stop))
        self.bounce = self.linear.bounce(self.rebound)

    def state(self, phase: arb) -> arb_mat:
        """Displacements and velocities just before the impact."""
        unit = identity(2 * self.linear.size)
        steady = self.linear.steady(self.omega, phase / self.omega)
        return (unit - self.flow * self.bounce).solve((unit - self.flow) * steady)

    def gap(self, phase: arb) -> arb:
        """Distance of the stop from q = 0."""
        return self.linear.along(self.state(phase)) * self.stop

    def speed(self, phase: arb) -> arb:
        """Of the impact."""
        return self.linear.along(self.state(phase), self.linear.size) * self.stop

    def monodromy(self, phase: arb) -> arb_mat:
        """The saltation matrix, then the flow."""
        time = phase / self.omega
        return self.flow * self.linear.saltation(self.rebound, self.omega, time, self.state(phase))

    def multipliers(self, phase: arb) -> list[complex]:
        """Eigenvalues of the monodromy matrix."""
        return eigenvalues(self.monodromy(phase))

    def special(self, multiplier: int, start: float) -> arb:
        """The phase near `start` at which a multiplier is +1 or -1: a zero of ``v det(mu I - M)``."""
        unit = identity(2 * self.linear.size) * multiplier
        return secant(lambda phase: (unit - self.monodromy(phase)).det() * self.speed(phase), start)

    def reach(self, phase: arb, steps: int = 400) -> float:
        """The largest displacement toward the other stop between two impacts, to the square of a step of time."""
        each = (self.linear.generator * (self.span / steps)).exp()
        free = self.bounce * self.state(phase) - self.linear.steady(self.omega, phase / self.omega)
        displacements = []
        for step in range(1, steps):
            free = each * free
            moved = free + self.linear.steady(self.omega, phase / self.omega + self.span * step / steps)
            displacements.append(-self.stop * float(self.linear.along(moved)))
        return max(displacements)


def eigenvalues(matrix: arb_mat) -> list[complex]:
    """The eigenvalues of a matrix, of its entries' midpoints."""
    size = matrix.nrows()
    middle = arb_mat([[matrix[i, j].mid() for j in range(size)] for i in range(size)])
    return [complex(value.mid()) for value in acb_mat(middle).eig(algorithm="approx")]


def solved(oscillator: Any, omega: float, clearance: Any, impacts: Any) -> ImpactOrbit:
    with digits():
        return ImpactOrbit.near(oscillator, omega, clearance, impacts).solved()


def differences(exact: ImpactOrbit, impacts: Any) -> tuple[float, float]:
    """Return the largest differences of phases and of velocities from those of an impact sequence of the core."""
    with digits():
        phases = [float(t * exact.omega - float(p)) for t, p in zip(exact.times, impacts.phases, strict=True)]
        speeds = [float(v - float(w)) for v, w in zip(exact.velocities, impacts.velocities, strict=True)]
    return max(map(abs, phases)), max(map(abs, speeds))
