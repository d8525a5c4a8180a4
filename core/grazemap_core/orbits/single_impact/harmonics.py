"""Trigonometric polynomials of a phase, with all their zeros, and the zero of any function between two numbers."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from grazemap_core.orbits.family import ForcedFamily
from grazemap_core.orbits.tolerances import ON_UNIT_CIRCLE, PHASE_POLISHING_STEPS, SAME_ZERO
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import EPSILON


class Harmonics(NamedTuple):
    """A trigonometric polynomial of the phase: a constant and the sum of Im(amplitude exp(i order phase))."""

    orders: tuple[int, ...]
    """H whole numbers > 0, increasing."""
    amplitudes: tuple[complex, ...]
    """H amplitudes by order. There are few, so numbers are quicker than arrays."""
    constant: float = 0.0
    """The constant."""

    @classmethod
    def of_steady(cls, forced: ForcedFamily) -> Harmonics:
        """Return the steady motion of the contact."""
        orders = tuple(harmonic.order for harmonic in forced.family.oscillator.forces)
        return cls(orders, tuple(forced.steady[:, -1].tolist()))

    def derivative(self) -> Harmonics:
        """Return the derivative."""
        return Harmonics(self.orders, tuple([1j * k * a for k, a in zip(self.orders, self.amplitudes, strict=True)]))

    def turned(self, angle: float) -> Harmonics:
        """Return the polynomial of a phase that is larger by an angle."""
        turned = tuple(a * cmath.exp(1j * k * angle) for k, a in zip(self.orders, self.amplitudes, strict=True))
        return Harmonics(self.orders, turned, self.constant)

    def plus(self, factor: float, other: Harmonics) -> Harmonics:
        """Return this one plus a factor times another one of the same orders."""
        total = tuple([a + factor * b for a, b in zip(self.amplitudes, other.amplitudes, strict=True)])
        return Harmonics(self.orders, total, self.constant + factor * other.constant)

    def times(self, factor: float) -> Harmonics:
        """Return this one times a factor."""
        return Harmonics(self.orders, tuple([factor * a for a in self.amplitudes]), factor * self.constant)

    def at(self, phase: float) -> float:
        """Return the value at a phase."""
        value = self.constant
        for order, amplitude in zip(self.orders, self.amplitudes, strict=True):
            value += (amplitude * cmath.exp(1j * order * phase)).imag
        return value

    def zeros(self) -> list[float]:
        """Return all zeros in [0, 2 pi), increasing; those closer than SAME_ZERO are one.

        A double zero may be missed, or found as two that are farther apart.
        """
        size, slopes, phases = abs(self.constant) + sum(map(abs, self.amplitudes)), self.derivative().amplitudes, []
        for phase in self._near_zeros():
            value, rate = self._value_and_slope(phase, slopes)
            for _ in range(PHASE_POLISHING_STEPS):
                before = phase
                phase -= value / rate if rate != 0.0 else 0.0
                if phase == before:
                    break
                value, rate = self._value_and_slope(phase, slopes)
            if abs(value) <= ON_UNIT_CIRCLE * size:
                phases.append(within_turn(phase))
        return apart_on_circle(phases)

    def _value_and_slope(self, phase: float, slopes: tuple[complex, ...]) -> tuple[float, float]:
        """Return the value, and the derivative from its amplitudes."""
        value, slope = self.constant, 0.0
        for order, amplitude, of_slope in zip(self.orders, self.amplitudes, slopes, strict=True):
            turn = cmath.exp(1j * order * phase)
            value += (amplitude * turn).imag
            slope += (of_slope * turn).imag
        return value, slope

    def _near_zeros(self) -> list[float]:
        """Return phases near all zeros: angles of the roots, on the unit circle, of a polynomial of exp(i phase)."""
        if len(self.orders) == 1:  # a sine
            (order,), (amplitude,) = self.orders, self.amplitudes
            if amplitude == 0.0 or abs(self.constant) > math.cosh(ON_UNIT_CIRCLE) * abs(amplitude):
                return []  # the roots are apart from the unit circle
            lag, angle = cmath.phase(amplitude), math.asin(max(-1.0, min(-self.constant / abs(amplitude), 1.0)))
            turns = [2.0 * math.pi * turn for turn in range(order)]
            return [(there - lag + turn) / order for there in (angle, math.pi - angle) for turn in turns]
        degree = self.orders[-1]
        coefficients = np.zeros(2 * degree + 1, dtype=np.complex128)
        coefficients[degree] = self.constant
        for order, amplitude in zip(self.orders, self.amplitudes, strict=True):
            coefficients[degree + order] += amplitude / 2j
            coefficients[degree - order] -= amplitude.conjugate() / 2j
        if not np.any(coefficients):
            return []
        roots = np.roots(coefficients[::-1])
        phases: list[float] = np.angle(roots[np.abs(np.abs(roots) - 1.0) <= ON_UNIT_CIRCLE]).tolist()
        return phases


def within_turn(phase: float) -> float:
    """Return a phase in [0, 2 pi); the remainder of a tiny negative one is rounded to 2 pi."""
    turned = phase % (2.0 * math.pi)
    return turned if turned < 2.0 * math.pi else 0.0


def apart_on_circle(phases: list[float]) -> list[float]:
    """Return phases in [0, 2 pi), increasing, without those that follow another one within SAME_ZERO."""
    ordered = sorted(phases)
    if not ordered:
        return []
    before = [ordered[-1] - 2.0 * math.pi, *ordered]
    kept = [phase for last, phase in zip(before, ordered, strict=False) if phase - last > SAME_ZERO]
    return kept or ordered[:1]


def bracketed_zero(test: Callable[[float], float], low: float, high: float, accuracy: float) -> float | None:
    """Return where a function changes its sign, to an absolute accuracy; None where it has one sign at both ends.

    Raises
    ------
    ValueError
        The function is not a number somewhere on the way.
    """
    ends = test(low), test(high)
    if min(ends) > 0.0 or max(ends) < 0.0:
        return None
    return float(brentq(test, low, high, xtol=accuracy, rtol=4.0 * EPSILON))
