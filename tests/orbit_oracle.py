"""Periodic motions with one impact, from M, C, K, f and R alone, in 50 digits: nothing of the closed forms tested.

A state just before the impact is periodic when the flow over the time between impacts takes what the impact leaves of
it back to it (to its mirror image, for symmetric motions). With the forcing's phase given that is one linear system;
the flow is a matrix exponential, the linearised impact the saltation matrix. Special orbits are zeros of
``v det(mu I - M)`` over the phase, found by the secant method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, arb_mat
from oracles import Chain, digits, first_order_matrix, tridiagonal


def chain_of(oscillator: Any) -> Chain:
    if oscillator.gamma is not None:
        return Chain.proportional(oscillator.masses, oscillator.stiffnesses, oscillator.gamma, oscillator.forcing)
    return Chain(oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing)


def steady(chain: Chain, omega: arb) -> list[acb]:
    """The steady motion's complex amplitudes."""
    stiffness, damping = tridiagonal(chain.stiffnesses), tridiagonal(chain.link_damping)
    count = chain.size
    rows = [
        [
            acb(stiffness[i][j] - (omega * omega * arb(chain.masses[i]) if i == j else 0), omega * damping[i][j])
            for j in range(count)
        ]
        for i in range(count)
    ]
    solved = acb_mat(rows).solve(acb_mat([[acb(f)] for f in chain.forcing]))
    return [solved[i, 0] for i in range(count)]


@dataclass(frozen=True)
class Family:
    """All motions of one pattern at one frequency: a state for every angle between the forcing and its graze."""

    chain: Chain
    restitution: arb
    amplitude: arb
    turn: acb
    generator: arb_mat
    flow: arb_mat
    bounce: arb_mat
    at_sine: arb_mat
    at_cosine: arb_mat

    @classmethod
    def of(cls, oscillator: Any, omega: arb, half_periods: int, symmetric: bool) -> Family:
        chain = chain_of(oscillator)
        count, size = chain.size, 2 * chain.size
        amplitudes = steady(chain, omega)
        turn = amplitudes[0] / abs(amplitudes[0])
        turned = [amplitude / turn for amplitude in amplitudes]
        generator = first_order_matrix(chain)
        flow = (generator * (arb.pi() * half_periods / omega)).exp()
        if symmetric:
            flow = -flow
        bounce = arb_mat([[arb(int(i == j)) for j in range(size)] for i in range(size)])
        bounce[count, count] = -arb(oscillator.restitution)
        one = arb_mat([[arb(int(i == j)) for j in range(size)] for i in range(size)])
        to_state = (one - flow * bounce).inv() * (one - flow)
        sine = arb_mat([[x.real] for x in turned] + [[-omega * x.imag] for x in turned])
        cosine = arb_mat([[x.imag] for x in turned] + [[omega * x.real] for x in turned])
        return cls(
            chain,
            arb(oscillator.restitution),
            abs(amplitudes[0]),
            turn,
            generator,
            flow,
            bounce,
            to_state * sine,
            to_state * cosine,
        )

    def state(self, angle: arb) -> arb_mat:
        """Displacements and velocities just before the impact."""
        return self.at_sine * angle.sin() + self.at_cosine * angle.cos()

    def clearance(self, angle: arb) -> arb:
        return self.state(angle)[0, 0]

    def speed(self, angle: arb) -> arb:
        return self.state(angle)[self.chain.size, 0]

    def monodromy(self, angle: arb) -> tuple[arb_mat, arb]:
        """Flow times saltation matrix, and the impact's speed."""
        count = self.chain.size
        before = self.state(angle)
        # sine of the forcing's phase at the impact: the angle less the argument of the steady motion
        drive = (acb(angle.cos(), angle.sin()) / self.turn).imag
        push = arb_mat(
            [[arb(0)]] * count
            + [[arb(f) / arb(m) * drive] for f, m in zip(self.chain.forcing, self.chain.masses, strict=True)]
        )
        rate_before = self.generator * before + push
        rate_after = self.generator * (self.bounce * before) + push
        jump = rate_after - self.bounce * rate_before
        speed = before[count, 0]
        saltation = arb_mat(self.bounce)
        for i in range(2 * count):
            saltation[i, 0] = saltation[i, 0] + jump[i, 0] / speed
        return self.flow * saltation, speed

    def test_function(self, angle: arb, multiplier: int) -> arb:
        """``v det(mu I - M)``, smooth through v = 0."""
        matrix, speed = self.monodromy(angle)
        size = 2 * self.chain.size
        shifted = arb_mat([[arb(multiplier * int(i == j)) for j in range(size)] for i in range(size)]) - matrix
        return shifted.det() * speed

    def special(self, multiplier: int, start: float) -> arb:
        """The angle near `start` at which a multiplier is +1 or -1."""
        return secant(lambda angle: self.test_function(angle, multiplier), start)

    def multipliers(self, angle: float) -> list[complex]:
        """Eigenvalues of the monodromy matrix (of the signed half period for symmetric motions)."""
        with digits():
            matrix, _ = self.monodromy(arb(angle))
            size = 2 * self.chain.size
            middle = [[matrix[i, j].mid() for j in range(size)] for i in range(size)]
            return [complex(value.mid()) for value in acb_mat(arb_mat(middle)).eig(algorithm="approx")]


def secant(function: Callable[[arb], arb], start: float) -> arb:
    """A zero near a start, to 40 digits."""
    before, here = arb(start), arb(start) + arb(1e-7)
    at_before, at_here = function(before), function(here)
    for _ in range(60):
        following = (here - at_here * (here - before) / (at_here - at_before)).mid()
        before, at_before = here, at_here
        here, at_here = following, function(following)
        if abs(here - before) < 1e-36:
            return here
    raise ArithmeticError("the secant method does not converge")


def polynomial(places: list[arb], values: list[arb]) -> list[arb]:
    """Coefficients, constant first, of the polynomial through the points."""
    size = len(places)
    rows = arb_mat([[place**power for power in range(size)] for place in places])
    solved = rows.solve(arb_mat([[value] for value in values]))
    return [solved[i, 0] for i in range(size)]
