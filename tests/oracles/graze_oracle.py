"""The discontinuity mapping in 60 digits, from M, C, K, h and f alone: the flow is a matrix exponential, not expanded.

States are plain ones, (x, v, sin k theta, cos k theta of every harmonic) of one linear system, measured from the static
equilibrium, and all digits that their differences cost are there from the start. Nothing is imported from the core.
"""

from __future__ import annotations

from typing import Any, Self

from flint import acb, acb_mat, arb, arb_mat

from tests.oracles.contact_system import matrix_of, real
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle

PRECISION = 90
"""Digits of the arithmetic: 60 are left of a displacement of 1e-8 found by Newton's method to 1e-70."""


class GrazeOracle:
    """The steady motion's graze of one stop, and what an impact near it does.

    Attributes
    ----------
    gap : arb
        Distance of the stop from the equilibrium.
    state : list of arb
        Of the steady motion as it touches the stop.
    theta : arb
        Its phase.
    """

    def __init__(self, oracle: GeneralOracle, stop: int, near: float) -> None:
        """Take the numbers of a structure; `near` is about the phase of the forcing at the graze."""
        with digits(PRECISION):
            self.omega, self.stop = real(oracle.omega), stop
            self.restitution = real(oracle.restitution[0 if stop > 0 else 1])
            mass, damping, stiffness = (matrix_of(matrix) for matrix in (oracle.mass, oracle.damping, oracle.stiffness))
            self.count, self.orders = mass.nrows(), [order for order, _ in oracle.harmonics]
            forces = [[acb(f) for f in amplitudes] for _, amplitudes in oracle.harmonics]
            self.contact = [real(h) for h in oracle.contact]
            jump = mass.solve(arb_mat([[h] for h in self.contact])).entries()
            self.jump = [x / self._contact_of(jump) for x in jump]
            self.matrix = self._equations(mass.solve(stiffness), mass.solve(damping), mass, forces)
            motions = [
                acb_mat(
                    [
                        [acb(stiffness[i, j] - w * w * mass[i, j], w * damping[i, j]) for j in range(self.count)]
                        for i in range(self.count)
                    ]
                ).solve(acb_mat([[f] for f in force]))
                for w, force in zip([order * self.omega for order in self.orders], forces, strict=True)
            ]
            self.motions = [motion.entries() for motion in motions]
            self.theta = self._maximum(arb(near))
            self.state = self._steady(self.theta)
            self.gap = (self.stop * self._contact_of(self.state)).mid()

    @classmethod
    def of(cls, point: Any) -> Self:
        """Take over the numbers of a grazing point's oscillator, and about its phase."""
        oracle = GeneralOracle.of(point.oscillator, point.omega, None, None, digits=PRECISION)
        return cls(oracle, point.stop, float(point.state[-1]))

    def mapped(self, deviation: list[float], scan: bool = False) -> list[arb]:
        """Return the displacement (x_1, v_1, ..., theta) of a state given by its deviation, in that order, from x*.

        Near a graze both times are where their leading order says; farther from it they are looked for, by `scan`.
        """
        with digits(PRECISION):
            place, rate = self._contact_of, self._rate_of
            start, level = self._start(deviation), self.stop * self.gap
            overshoot = self.stop * (place(start) - level)
            acceleration = abs(rate(self._rates(start)))
            guess = self._first(start, place, level) if scan else -((2 * overshoot / acceleration) ** 0.5)
            back = self._root(start, guess, place, level)
            behind = self._flow(start, back)
            speed = rate(behind)
            for i, a in enumerate(self.jump):
                behind[self.count + i] = (behind[self.count + i] - (1 + self.restitution) * speed * a).mid()
            again = arb(0)
            if self.restitution > 0.0:
                guess = -self.restitution * abs(speed) / acceleration
                again = self._root(behind, self._first(behind, rate, arb(0)) if scan else guess, rate, arb(0))
            return self._moved(start, self._flow(behind, again), self.omega * (back + again))

    def returned(self, deviation: list[float], halves: bool) -> list[arb]:
        """Return the deviation from the next point where the contact stands still half a period on, or a whole one."""
        with digits(PRECISION):
            start, turn = self._start(deviation), arb.pi() * (1 if halves else 2)
            time = self._root(start, turn / self.omega, self._rate_of, arb(0))
            point = [-x for x in self.state] if halves else self.state
            return self._moved(point, self._flow(start, time), arb(deviation[-1]) + self.omega * time - turn)

    def _equations(self, spring: arb_mat, drag: arb_mat, mass: arb_mat, forces: list[list[acb]]) -> arb_mat:
        size = 2 * self.count + 2 * len(self.orders)
        matrix = arb_mat(size, size)
        for i in range(self.count):
            matrix[i, self.count + i] = arb(1)
            for j in range(self.count):
                matrix[self.count + i, j], matrix[self.count + i, self.count + j] = -spring[i, j], -drag[i, j]
        for k, (order, force) in enumerate(zip(self.orders, forces, strict=True)):
            sine, cosine = 2 * self.count + 2 * k, 2 * self.count + 2 * k + 1
            pushed = mass.solve(arb_mat([[f.real, f.imag] for f in force]))
            for i in range(self.count):
                matrix[self.count + i, sine], matrix[self.count + i, cosine] = pushed[i, 0], pushed[i, 1]
            matrix[sine, cosine], matrix[cosine, sine] = order * self.omega, -order * self.omega
        return matrix

    def _steady(self, theta: arb) -> list[arb]:
        """Return the state of the steady motion at a phase."""
        turns = [acb(0, order * theta).exp() for order in self.orders]
        pairs = list(zip(self.orders, self.motions, turns, strict=True))
        places = [sum(((x[i] * turn).imag for _, x, turn in pairs), arb(0)) for i in range(self.count)]
        rates = [sum((k * self.omega * (x[i] * t).real for k, x, t in pairs), arb(0)) for i in range(self.count)]
        return [x.mid() for x in (*places, *rates, *(part for turn in turns for part in (turn.imag, turn.real)))]

    def _maximum(self, theta: arb) -> arb:
        for _ in range(60):
            state = self._steady(theta)
            step = (self.omega * self._rate_of(state) / self._rate_of(self._rates(state))).mid()
            theta = (theta - step).mid()
            if abs(step) < arb(10) ** (5 - PRECISION):
                return theta
        raise AssertionError("the oracle's Newton iteration did not converge")

    def _contact_of(self, state: list[arb]) -> arb:
        return sum((h * x for h, x in zip(self.contact, state, strict=False)), arb(0))

    def _rate_of(self, state: list[arb]) -> arb:
        return self._contact_of(state[self.count :])

    def _moved(self, start: list[arb], end: list[arb], turn: arb) -> list[arb]:
        moved = [end[j] - start[j] for j in range(2 * self.count)]
        return [*(value for i in range(self.count) for value in (moved[i], moved[self.count + i])), turn]

    def _start(self, deviation: list[float]) -> list[arb]:
        """Return the state at a deviation."""
        start = self._steady(self.theta + arb(deviation[-1]))
        for i in range(self.count):
            start[i] = self.state[i] + arb(deviation[2 * i])
            start[self.count + i] = self.state[self.count + i] + arb(deviation[2 * i + 1])
        return start

    def _first(self, state: list[arb], value: Any, level: arb) -> arb:
        """Return a guess of the last time before at which a value of the state was at a level, by small steps."""
        step = -arb.pi() / self.omega / 256
        before = value(self._flow(state, step / 64)) - level
        for k in range(1, 257):
            after = value(self._flow(state, k * step)) - level
            if (before > 0) != (after > 0):
                return (k - abs(after) / (abs(after) + abs(before))) * step
            before = after
        raise AssertionError("the oracle found no crossing in half a period")

    def _rates(self, state: list[arb]) -> list[arb]:
        return list((self.matrix * arb_mat([[value] for value in state])).entries())

    def _flow(self, state: list[arb], time: arb) -> list[arb]:
        product = (self.matrix * time).exp() * arb_mat([[value] for value in state])
        return [x.mid() for x in product.entries()]

    def _root(self, state: list[arb], guess: arb, value: Any, level: arb) -> arb:
        """Newton's method for the time at which a value of the state is at a level."""
        time = guess.mid()
        for _ in range(60):
            there = self._flow(state, time)
            step = ((value(there) - level) / value(self._rates(there))).mid()
            time = (time - step).mid()
            if abs(step) < abs(time) * arb(10) ** -60:
                return time
        raise AssertionError("the oracle's Newton iteration did not converge")
