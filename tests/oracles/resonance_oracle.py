"""Impacts of a chain in ball arithmetic, exactly at resonance too, sharing nothing with the core.

The sine and the cosine of the forcing are two more coordinates of the state z, so that z' = A z with a constant matrix
and z(t) = exp(A t) z(0): the same formula away from a resonance and at one, where A has no basis of eigenvectors. On
each step the displacement of mass 1 is a polynomial with an enclosed remainder. A contact is excluded, or enclosed as
the one zero of a decreasing distance, by interval bounds on parts of the step; what cannot be decided is an error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil, factorial
from typing import Any

from flint import arb, arb_mat, arb_poly

from tests.oracles.fifty_digits import digits

TERMS = 50
SLOWEST = 1e-7
"""Speed of an impact, in units of omega times the clearance, after which a run ends: a complete chatter may begin."""
NARROWEST = 1e-45
"""Parts of a step, in units of the step, that are not halved again."""


@dataclass
class ResonanceOracle:
    """Mass 1 of a chain between two stops, from rest; numbers are exact doubles, or balls.

    `times`, `stops` and `speeds` are those of the impacts so far.
    """

    masses: list[Any]
    stiffnesses: list[Any]
    gamma: Any
    forcing: list[Any]
    restitution: Any
    omega: Any
    clearance: Any
    precision: int = 60
    times: list[arb] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)
    speeds: list[arb] = field(default_factory=list)

    def _matrix(self) -> arb_mat:
        n, w = len(self.masses), arb(self.omega)
        matrix = arb_mat(2 * n + 2, 2 * n + 2)
        for i in range(n):
            matrix[i, n + i] = arb(1)
            matrix[n + i, 2 * n] = arb(self.forcing[i]) / arb(self.masses[i])
        for i, k in enumerate(self.stiffnesses):  # link i joins mass i and i + 1, the last one the ground
            ends = [(i, 1), (i + 1, -1)] if i + 1 < n else [(i, 1)]
            for row, sign in ends:
                for column, other in ends:
                    pull = sign * other * arb(k) / arb(self.masses[row])
                    matrix[n + row, column] -= pull
                    matrix[n + row, n + column] -= 2 * arb(self.gamma) * pull
        matrix[2 * n, 2 * n + 1], matrix[2 * n + 1, 2 * n] = w, -w
        return matrix

    def run(self, until: arb) -> None:
        """Follow the motion from rest until a time, or until an impact that is very slow."""
        with digits(self.precision):
            matrix = self._matrix()
            size = matrix.nrows()
            norm = max(float(sum(abs(matrix[i, j]) for j in range(size)).mid()) for i in range(size))
            self._step = 1 / arb(ceil(norm))
            powers = [arb_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])]
            for k in range(1, TERMS + 1):
                powers.append(powers[-1] * matrix * (self._step / k))
            self._rows = arb_mat([[power[0, j] for j in range(size)] for power in powers[:-1]])
            self._rest = 2.0 / factorial(TERMS)  # of the norm of the state, as that of A times the step is at most 1
            whole = (matrix * self._step).exp()
            state = arb_mat([[arb(0)] for _ in range(size - 1)] + [[arb(1)]])
            time, left = arb(0), 0
            slowest = SLOWEST * float(arb(self.omega) * arb(self.clearance))
            while not time > until and (not self.speeds or abs(float(self.speeds[-1])) > slowest):
                stop, part = self._contact(state, left)
                part = arb(1) if part is None else part
                flow = whole if stop == 0 else (matrix * (self._step * part)).exp()
                state, time, left = (flow * state).mid(), (time + self._step * part).mid(), stop
                if stop:
                    self._impact(state, time, stop)

    def _impact(self, state: arb_mat, time: arb, stop: int) -> None:
        n = len(self.masses)
        self.times.append(time)
        self.stops.append(stop)
        self.speeds.append(state[n, 0])
        state[0, 0] = stop * arb(self.clearance)
        state[n, 0] = (-arb(self.restitution) * state[n, 0]).mid()

    def _contact(self, state: arb_mat, left: int) -> tuple[int, arb | None]:
        """Return the stop and the part of the step at which mass 1 first meets one."""
        series = (self._rows * state).entries()
        size = max(float(abs(entry)) for entry in state.entries())
        rest = arb(0, self._rest * size)
        best: tuple[int, arb | None] = (0, None)
        for stop in (1, -1):
            gap = [-stop * c for c in series]
            gap[0] += arb(self.clearance)
            if stop == left:
                gap = gap[1:]  # on the stop at the start; the quotient by t has the same other zeros
            root = first_zero(arb_poly(gap), rest)
            if root is not None and (best[1] is None or root < best[1]):
                best = stop, root
        return best


def first_zero(gap: arb_poly, rest: arb) -> arb | None:
    """Return the first zero in (0, 1] of a polynomial that is positive at 0, or None if it is positive throughout.

    `rest` is a ball that contains what the polynomial omits.
    """
    slope = gap.derivative()
    bend = slope.derivative()
    stack = [(arb(0), arb(1))]
    while stack:
        low, width = stack.pop()
        middle, half = low + width / 2, arb(0, 1) * (width / 2)
        falls = slope(middle + half) < 0
        # the Taylor form of second order about the middle
        value = gap(middle) + slope(middle) * half + bend(middle + half) * half * half / 2 + rest
        if value > 0 or (falls and gap(low + width) + rest > 0):
            continue
        if falls and gap(low) + rest > 0 and gap(low + width) + rest < 0:
            return _newton(gap, slope, middle)
        if width < NARROWEST:
            raise ArithmeticError("a contact is not decided at this precision")
        stack += [(low + width / 2, width / 2), (low, width / 2)]
    return None


def _newton(gap: arb_poly, slope: arb_poly, start: arb) -> arb:
    t = start.mid()
    for _ in range(100):
        step = (gap(t) / slope(t)).mid()
        t = (t - step).mid()
        if abs(step) < arb("1e-58"):
            return t
    raise ArithmeticError("Newton's method did not converge")
