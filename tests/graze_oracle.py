"""The discontinuity mapping in 60 digits, from M, C, K and f alone: the flow is a matrix exponential, nothing expanded.

States are plain ones, (x, v, sin theta, cos theta) of one linear system, and all digits that their differences cost are
there from the start. Nothing is imported from the core.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import acb, acb_mat, arb, arb_mat
from oracles import Chain, digits, first_order_matrix, tridiagonal

PRECISION = 90
"""Digits of the arithmetic: 60 are left of a displacement of 1e-8 found by Newton's method to 1e-70."""


@dataclass
class GrazeOracle:
    """The steady motion's graze of one stop, and what an impact near it does."""

    chain: Chain
    restitution: float
    omega: float
    stop: int

    def __post_init__(self) -> None:
        with digits(PRECISION):
            count = self.chain.size
            w = arb(self.omega)
            free = first_order_matrix(self.chain)
            rows = [[free[i, j] for j in range(2 * count)] + [arb(0), arb(0)] for i in range(2 * count)]
            for i in range(count):
                rows[count + i][2 * count] = arb(self.chain.forcing[i]) / arb(self.chain.masses[i])
            zeros = [arb(0)] * (2 * count)
            self.matrix = arb_mat([*rows, [*zeros, arb(0), w], [*zeros, -w, arb(0)]])
            stiffness, damping = tridiagonal(self.chain.stiffnesses), tridiagonal(self.chain.link_damping)
            dynamic = [
                [
                    acb(stiffness[i][j] - (w * w * arb(self.chain.masses[i]) if i == j else 0), w * damping[i][j])
                    for j in range(count)
                ]
                for i in range(count)
            ]
            response = acb_mat(dynamic).solve(acb_mat([[acb(f)] for f in self.chain.forcing]))
            self.clearance = abs(response[0, 0]).mid()
            # x_1 = Im(X e^{i theta}) is stop * |X| where X e^{i theta} is i stop |X|
            turn = acb(0, self.stop) * abs(response[0, 0]) / response[0, 0]
            at = [response[i, 0] * turn for i in range(count)]
            self.state = (
                [z.imag.mid() for z in at] + [(w * z.real).mid() for z in at] + [turn.imag.mid(), turn.real.mid()]
            )

    def mapped(self, deviation: list[float], scan: bool = False) -> list[arb]:
        """Return the displacement (x_1, v_1, ..., theta) of a state given by its deviation, in that order, from x*.

        Near a graze both times are where their leading order says; farther from it they are looked for, by `scan`.
        """
        with digits(PRECISION):
            count, s = self.chain.size, self.stop
            start = self._start(deviation)
            overshoot = s * start[0] - self.clearance
            acceleration = abs(self._rate(start)[count])
            guess = self._first(start, 0, s * self.clearance) if scan else -((2 * overshoot / acceleration) ** 0.5)
            back = self._root(start, guess, 0, s * self.clearance)
            behind = self._flow(start, back)
            speed = abs(behind[count])
            behind[count] = -arb(self.restitution) * behind[count]
            again = arb(0)
            if self.restitution > 0.0:
                guess = -arb(self.restitution) * speed / acceleration
                again = self._root(behind, self._first(behind, count, arb(0)) if scan else guess, count, arb(0))
            end = self._flow(behind, again)
            moved = [end[j] - start[j] for j in range(2 * count)]
            pairs = [value for i in range(count) for value in (moved[i], moved[count + i])]
            return [*pairs, arb(self.omega) * (back + again)]

    def half_period(self, deviation: list[float]) -> list[arb]:
        """Return the deviation from the other stop's point where mass 1 stands still half a period on."""
        with digits(PRECISION):
            count = self.chain.size
            start = self._start(deviation)
            time = self._root(start, arb.pi() / arb(self.omega), count, arb(0))
            end = self._flow(start, time)
            moved = [end[j] + self.state[j] for j in range(2 * count)]
            pairs = [value for i in range(count) for value in (moved[i], moved[count + i])]
            return [*pairs, arb(deviation[-1]) + arb(self.omega) * time - arb.pi()]

    def _start(self, deviation: list[float]) -> list[arb]:
        """Return the state at a deviation."""
        count = self.chain.size
        theta = acb(0, arb(deviation[-1])).exp() * acb(self.state[-1], self.state[-2])
        start = [self.state[i] + arb(deviation[2 * i]) for i in range(count)]
        start += [self.state[count + i] + arb(deviation[2 * i + 1]) for i in range(count)]
        return [*start, theta.imag, theta.real]

    def _first(self, state: list[arb], entry: int, value: arb) -> arb:
        """Return a guess of the last time before at which an entry of the state had a value, by small steps."""
        step = -arb.pi() / arb(self.omega) / 256
        before = self._flow(state, step / 64)[entry] - value
        for k in range(1, 257):
            after = self._flow(state, k * step)[entry] - value
            if (before > 0) != (after > 0):
                return (k - abs(after) / (abs(after) + abs(before))) * step
            before = after
        raise AssertionError("the oracle found no crossing in half a period")

    def _rate(self, state: list[arb]) -> list[arb]:
        product = self.matrix * arb_mat([[value] for value in state])
        return [product[i, 0] for i in range(len(state))]

    def _flow(self, state: list[arb], time: arb) -> list[arb]:
        product = (self.matrix * time).exp() * arb_mat([[value] for value in state])
        return [product[i, 0].mid() for i in range(len(state))]

    def _root(self, state: list[arb], guess: arb, entry: int, value: arb) -> arb:
        """Newton's method for the time at which an entry of the state has a value."""
        time = guess.mid()
        for _ in range(60):
            there = self._flow(state, time)
            step = ((there[entry] - value) / self._rate(there)[entry]).mid()
            time = (time - step).mid()
            if abs(step) < abs(time) * arb(10) ** -60:
                return time
        raise AssertionError("the oracle's Newton iteration did not converge")
