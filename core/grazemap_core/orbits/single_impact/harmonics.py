"""Trigonometric polynomials of a phase, with all their zeros."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.tolerances import ON_UNIT_CIRCLE, PHASE_POLISHING_STEPS, SAME_ZERO
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A trigonometric polynomial of the phase: a constant and the sum of Im(amplitude exp(i order phase))."""

    orders: Floats
    """(H,) Whole numbers > 0, increasing."""
    amplitudes: Complexes
    """(H,) Amplitudes by order."""
    constant: float = 0.0
    """The constant."""

    @classmethod
    def of_steady(cls, family: OrbitFamily, omega: float, steady: Complexes | None = None) -> Harmonics:
        """Return the steady motion of the contact; `steady` are the amplitudes of `OrbitFamily.steady`, if known."""
        orders = np.array([float(harmonic.order) for harmonic in family.oscillator.forces])
        return cls(orders, (family.steady(omega) if steady is None else steady)[:, -1])

    def derivative(self) -> Harmonics:
        """Return the derivative."""
        return Harmonics(self.orders, 1j * self.orders * self.amplitudes)

    def turned(self, angle: float) -> Harmonics:
        """Return the polynomial of a phase that is larger by an angle."""
        return Harmonics(self.orders, self.amplitudes * np.exp(1j * self.orders * angle), self.constant)

    def plus(self, factor: float, other: Harmonics) -> Harmonics:
        """Return this one plus a factor times another one of the same orders."""
        return Harmonics(
            self.orders, self.amplitudes + factor * other.amplitudes, self.constant + factor * other.constant
        )

    def times(self, factor: float) -> Harmonics:
        """Return this one times a factor."""
        return Harmonics(self.orders, factor * self.amplitudes, factor * self.constant)

    def at(self, phase: float) -> float:
        """Return the value at a phase."""
        return self.constant + float(np.sum((self.amplitudes * np.exp(1j * self.orders * phase)).imag))

    def zeros(self) -> list[float]:
        """Return all zeros in [0, 2 pi), increasing; those closer than SAME_ZERO are one.

        A double zero may be missed, or found as two that are farther apart.
        """
        degree = int(self.orders[-1])
        coefficients = np.zeros(2 * degree + 1, dtype=np.complex128)
        coefficients[degree] = self.constant
        for order, amplitude in zip(self.orders.astype(np.int64).tolist(), self.amplitudes.tolist(), strict=True):
            coefficients[degree + order] += amplitude / 2j
            coefficients[degree - order] -= amplitude.conjugate() / 2j
        if not np.any(coefficients):
            return []
        roots = np.roots(coefficients[::-1])
        slope, phases = self.derivative(), []
        for root in roots[np.abs(np.abs(roots) - 1.0) <= ON_UNIT_CIRCLE].tolist():
            phase = math.atan2(root.imag, root.real)
            for _ in range(PHASE_POLISHING_STEPS):
                rate = slope.at(phase)
                phase -= self.at(phase) / rate if rate != 0.0 else 0.0
            if abs(self.at(phase)) <= ON_UNIT_CIRCLE * (abs(self.constant) + float(np.sum(np.abs(self.amplitudes)))):
                phases.append(within_turn(phase))
        return apart_on_circle(phases)


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
