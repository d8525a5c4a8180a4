"""Fifty-digit linear properties of any structure, made from M, C, K, h and the forces alone.

Slopes with respect to omega are differences of amplitudes 10**-20 apart, so nothing is shared with the formula that is
tested. Nothing is imported from the core.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx
from numpy.typing import NDArray

from tests.oracles.fifty_digits import digits, first_order_of

Floats = NDArray[np.float64]
Forces = Callable[[arb], list[acb]]
"""From omega to the complex amplitudes of the forces in one harmonic."""


@dataclass(frozen=True)
class StructureOracle:
    """A structure; the numbers are exact doubles, or balls."""

    mass: Sequence[Sequence[float | arb]]
    damping: Sequence[Sequence[float | arb]]
    stiffness: Sequence[Sequence[float | arb]]
    contact: Sequence[float]

    @property
    def size(self) -> int:
        return len(self.mass)

    def _matrix(self, rows: Sequence[Sequence[float | arb]]) -> arb_mat:
        return arb_mat(
            [[arb(float(x)) if isinstance(x, float | np.floating | int) else x for x in row] for row in rows]
        )

    def _of_mass(self) -> arb_mat:
        """Return ``M^-1 h``."""
        return self._matrix(self.mass).solve(arb_mat([[arb(float(x))] for x in self.contact]))

    def _along(self, vector: arb_mat) -> arb:
        return sum((arb(float(h)) * vector[i, 0] for i, h in enumerate(self.contact)), arb(0))

    def _generator(self) -> arb_mat:
        """Return A of ``(x, v)' = A (x, v)``."""
        mass, damping, stiffness = map(self._matrix, (self.mass, self.damping, self.stiffness))
        return first_order_of(mass.solve(stiffness), mass.solve(damping))

    def effective_mass(self) -> float:
        with digits():
            return float((1 / self._along(self._of_mass())).mid())

    def kappa(self) -> float:
        with digits():
            response = self._of_mass()
            spread = self._matrix(self.damping) * response
            moved = self._matrix(self.mass).solve(spread)
            return float((self._along(moved) / self._along(response)).mid())

    def coordinate(self, forces: Forces, order: int, omega: arb) -> acb:
        """Return X: q = Im(X e^{i order omega t})."""
        s, count = order * omega, self.size
        mass, damping, stiffness = map(self._matrix, (self.mass, self.damping, self.stiffness))
        rows = [
            [acb(stiffness[i, j] - s * s * mass[i, j], s * damping[i, j]) for j in range(count)] for i in range(count)
        ]
        solved = acb_mat(rows).solve(acb_mat([[f] for f in forces(omega)]))
        return sum((acb(arb(float(h))) * solved[i, 0] for i, h in enumerate(self.contact)), acb(0))

    def response(self, forces: Forces, order: int, omega: float) -> tuple[float, float, float]:
        """Return amplitude, phase and slope of the amplitude."""
        with digits(80):
            step = arb(10) ** -20
            here = self.coordinate(forces, order, arb(omega))
            above, below = (abs(self.coordinate(forces, order, arb(omega) + sign * step)) for sign in (1, -1))
            return float(abs(here).mid()), float(here.arg().mid()), float(((above - below) / (2 * step)).mid())

    def impulse_response(self, time: float) -> float:
        """Return ``g = h^T exp(A t) (0, a)``."""
        with digits():
            ctx.prec += 200
            jump, size = self._of_mass(), self._along(self._of_mass())
            start = arb_mat([[arb(0)]] * self.size + [[entry / size] for entry in jump.entries()])
            return float(self._along((self._generator() * arb(time)).exp() * start).mid())

    def flow(self, time: float) -> list[list[float]]:
        """Return the matrix that takes a state, displacements then velocities, to the state a time later."""
        with digits():
            return [[float(x.mid()) for x in row] for row in (self._generator() * arb(time)).exp().tolist()]

    def exponents(self) -> list[complex]:
        """Return all exponents of the free motion."""
        with digits():
            return [complex(float(x.real.mid()), float(x.imag.mid())) for x in acb_mat(self._generator()).eig()]

    def natural_frequencies(self) -> list[float]:
        with digits():
            whole = acb_mat(self._matrix(self.mass).solve(self._matrix(self.stiffness)))
            return sorted(float(x.real.sqrt().mid()) for x in whole.eig())
