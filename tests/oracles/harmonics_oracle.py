"""Steady motions of several harmonics in 50 digits from M, C, K, h and the forces alone.

Maxima are found by dense sampling and Newton's method, corners by the secant method. Nothing is imported from the core.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from flint import acb, arb

from tests.oracles.fifty_digits import secant
from tests.oracles.structure_oracle import Forces, StructureOracle

SAMPLES = 512
"""Samples of a period for each order of the highest harmonic."""


class Maximum(NamedTuple):
    """A local maximum of q toward a stop; `bend` is minus its second derivative along omega t."""

    phase: arb
    height: arb
    bend: arb


@dataclass(frozen=True)
class HarmonicsOracle:
    """A structure with forces in several harmonics, as (order, forces)."""

    structure: StructureOracle
    parts: Sequence[tuple[int, Forces]]

    def coefficients(self, omega: arb) -> list[tuple[int, acb]]:
        return [(order, self.structure.coordinate(forces, order, omega)) for order, forces in self.parts]

    def maxima(self, omega: arb, stop: int) -> list[Maximum]:
        """Return all local maxima toward a stop, the highest first."""
        coefficients = self.coefficients(omega)
        theta = np.linspace(-np.pi, np.pi, SAMPLES * max(order for order, _ in coefficients), endpoint=False)
        values = stop * sum(
            (complex(float(x.real.mid()), float(x.imag.mid())) * np.exp(1j * k * theta)).imag for k, x in coefficients
        )
        (places,) = np.nonzero((values >= np.roll(values, 1)) & (values >= np.roll(values, -1)))
        return sorted(
            (maximum(coefficients, stop, arb(theta[i])) for i in places.tolist()), key=lambda m: -float(m.height)
        )

    def amplitude(self, omega: arb, stop: int) -> arb:
        return self.maxima(omega, stop)[0].height

    def slope(self, omega: float, stop: int) -> float:
        """Return d A/d omega as a difference over 1e-20."""
        step = arb(10) ** -20
        above, below = (self.amplitude(arb(omega) + sign * step, stop) for sign in (1, -1))
        return float(((above - below) / (2 * step)).mid())

    def corner(self, omega: float, stop: int) -> tuple[arb, Maximum, Maximum]:
        """Return the frequency near omega at which the two highest maxima are equal, and these."""
        first, second = self.maxima(arb(omega), stop)[:2]

        def difference(w: arb) -> arb:
            terms = self.coefficients(w)
            return maximum(terms, stop, first.phase).height - maximum(terms, stop, second.phase).height

        place = secant(difference, omega)
        coefficients = self.coefficients(place)
        return place, maximum(coefficients, stop, first.phase), maximum(coefficients, stop, second.phase)

    def double_graze(self, omega: float, stop: int, gap: arb) -> arb:
        """Return the frequency near omega at which the amplitude toward a stop is the gap."""
        return secant(lambda w: self.amplitude(w, stop) - gap, omega)


def maximum(coefficients: Sequence[tuple[int, acb]], stop: int, start: arb) -> Maximum:
    """Return the maximum near a phase, by Newton's method."""
    phase = start
    for _ in range(60):
        turned = [(k, x * acb(0, k * phase).exp()) for k, x in coefficients]
        slope = stop * sum((k * x.real for k, x in turned), arb(0))
        bend = stop * sum((k * k * x.imag for k, x in turned), arb(0))
        following = (phase + slope / bend).mid()
        if abs(following - phase) < arb(10) ** -45:
            break
        phase = following
    return Maximum(phase, stop * sum((x.imag for _, x in turned), arb(0)), bend)
