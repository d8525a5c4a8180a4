"""Periodic motions with any impacts, from M, C, K, f and R alone, in 50 digits: nothing of the equations tested.

Given when mass 1 is kicked and how much, the periodic motion is one linear system: the state just before the first kick
comes back to itself (to its mirror image) over flows, which are matrix exponentials, and kicks. Newton's method on the
times and velocities has a Jacobian by differences of 1e-25. The linearised motion is a product of flows and saltation
matrices S = G + (F+ - G F-) h^T/(h^T F-).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, arb_mat
from oracles import digits, first_order_matrix
from orbit_oracle import chain_of, steady

DIFFERENCE = arb("1e-25")


def identity(size: int) -> arb_mat:
    return arb_mat([[arb(int(i == j)) for j in range(size)] for i in range(size)])


@dataclass(frozen=True)
class ImpactOrbit:
    """Times and velocities of the impacts of a span; after it they repeat, with the sign -1 on the other stop."""

    oscillator: Any
    omega: arb
    clearance: arb
    stops: list[int]
    half_periods: int
    sign: int
    times: list[arb]
    velocities: list[arb]

    @classmethod
    def near(cls, oscillator: Any, omega: float, clearance: float, impacts: Any) -> ImpactOrbit:
        """The orbit that an impact sequence of the core is near to; times are exact quotients of its phases."""
        return cls(
            oscillator,
            arb(omega),
            arb(clearance),
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

    def flows(self) -> list[arb_mat]:
        """Over the times between one impact and the next."""
        generator = first_order_matrix(chain_of(self.oscillator))
        span = arb.pi() * self.half_periods / self.omega
        ends = [*self.times[1:], self.times[0] + span]
        return [(generator * (end - time)).exp() for end, time in zip(ends, self.times, strict=True)]

    def states(self) -> list[arb_mat]:
        """States just before every impact."""
        count = self.oscillator.size
        rebound = 1 + arb(self.oscillator.restitution)
        kicks = [arb_mat([[-rebound * v if i == count else arb(0)] for i in range(2 * count)]) for v in self.velocities]
        flows = self.flows()
        whole, added = identity(2 * count), arb_mat(2 * count, 1)
        for flow, kick in zip(flows, kicks, strict=True):
            whole, added = flow * whole, flow * (added + kick)
        free = (identity(2 * count) - whole * self.sign).solve(added * self.sign)
        amplitudes = steady(chain_of(self.oscillator), self.omega)
        found = []
        for time, flow, kick in zip(self.times, flows, kicks, strict=True):
            turn = acb(0, 1) * self.omega * time
            turned = [amplitude * turn.exp() for amplitude in amplitudes]
            drive = arb_mat([[x.imag] for x in turned] + [[self.omega * x.real] for x in turned])
            found.append(free + drive)
            free = flow * (free + kick)
        return found

    def residual(self) -> list[arb]:
        count = self.oscillator.size
        states = self.states()
        return [x[0, 0] - s * self.clearance for x, s in zip(states, self.stops, strict=True)] + [
            x[count, 0] - v for x, v in zip(states, self.velocities, strict=True)
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
        oscillator, count = self.oscillator, self.oscillator.size
        generator = first_order_matrix(chain_of(oscillator))
        bounce = identity(2 * count)
        bounce[count, count] = -arb(oscillator.restitution)
        matrix = identity(2 * count) * self.sign
        for time, state, flow in zip(self.times, self.states(), self.flows(), strict=True):
            drive = (self.omega * time).sin()
            push = arb_mat(
                [[arb(0)]] * count
                + [[arb(f) / arb(m) * drive] for f, m in zip(oscillator.forcing, oscillator.masses, strict=True)]
            )
            before, after = generator * state + push, generator * (bounce * state) + push
            jump = after - bounce * before
            saltation = arb_mat(bounce)
            for i in range(2 * count):
                saltation[i, 0] = saltation[i, 0] + jump[i, 0] / state[count, 0]
            matrix = flow * saltation * matrix
        return matrix

    def multipliers(self) -> list[complex]:
        """Eigenvalues of the monodromy matrix, of the signed half period for symmetric motions."""
        matrix, size = self.monodromy(), 2 * self.oscillator.size
        middle = arb_mat([[matrix[i, j].mid() for j in range(size)] for i in range(size)])
        return [complex(value.mid()) for value in acb_mat(middle).eig(algorithm="approx")]

    def test_function(self, multiplier: int) -> arb:
        """``prod v_i det(mu I - M)``, smooth where a velocity vanishes."""
        size = 2 * self.oscillator.size
        product = arb(1)
        for velocity in self.velocities:
            product *= velocity
        return (identity(size) * multiplier - self.monodromy()).det() * product


def solved(oscillator: Any, omega: float, clearance: float, impacts: Any) -> ImpactOrbit:
    with digits():
        return ImpactOrbit.near(oscillator, omega, clearance, impacts).solved()
