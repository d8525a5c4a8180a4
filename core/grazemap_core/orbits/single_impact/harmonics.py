"""Trigonometric polynomials of a phase, with all their zeros, and the zero of any function between two numbers."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import brentq

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.orbits.family import ForcedFamily
from grazemap_core.orbits.kernels.harmonics import near_zeros_of_sines, values_at, zeros_near
from grazemap_core.orbits.tolerances import ON_UNIT_CIRCLE
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import EPSILON


class Places(NamedTuple):
    """Phases of several polynomials, or of motions at several frequencies."""

    phases: Floats
    """(p,) The phases."""
    rows: Integers
    """(p,) Index of the polynomial, or of the frequency."""

    @classmethod
    def of(cls, phases: Floats | float, rows: Integers | int = 0) -> Places:
        """Return phases (p,) or one, of the row of each or of one for all."""
        shape = np.broadcast_shapes(np.shape(phases), np.shape(rows)) or (1,)
        return cls(np.full(shape, phases, dtype=np.float64), np.full(shape, rows, dtype=np.int64))

    def where(self, chosen: Booleans | Integers) -> Places:
        """Return some of the phases, by flags (p,) or indices."""
        return Places(self.phases[chosen], self.rows[chosen])


class Harmonics(NamedTuple):
    """Polynomials of the phase of the same orders: a constant and the sum of Im(amplitude exp(i order phase))."""

    orders: Floats
    """(H,) Whole numbers > 0, increasing."""
    amplitudes: Complexes
    """(m, H) Amplitudes by order."""
    constants: Floats
    """(m,) The constants."""

    @classmethod
    def of_steady(cls, forced: Sequence[ForcedFamily]) -> Harmonics:
        """Return the steady motion of the contact at each of several frequencies (m,)."""
        return cls(forced[0].family.orders, np.array([at.steady[:, -1] for at in forced]), np.zeros(len(forced)))

    def derivative(self) -> Harmonics:
        """Return the derivatives."""
        return self._replace(amplitudes=1j * self.orders * self.amplitudes, constants=np.zeros_like(self.constants))

    def turned(self, angles: Sequence[float]) -> Harmonics:
        """Return a single polynomial as functions of a phase that is larger by an angle, for each of angles (m,).

        The products are those of Python: numpy's depend on the processor in the last bit.
        """
        (amplitudes,) = self.amplitudes.tolist()
        terms = list(zip(self.orders.tolist(), amplitudes, strict=True))
        turned = [[a * cmath.exp(1j * k * angle) for k, a in terms] for angle in angles]
        return Harmonics(self.orders, np.array(turned), np.repeat(self.constants, len(angles)))

    def plus(self, factor: Floats | float, other: Harmonics) -> Harmonics:
        """Return these plus a factor, or factors (m,), times other ones of the same orders."""
        added = other.times(factor)
        return Harmonics(self.orders, self.amplitudes + added.amplitudes, self.constants + added.constants)

    def times(self, factor: Floats | float) -> Harmonics:
        """Return these times a factor, or factors (m,)."""
        factors = np.asarray(factor)
        return Harmonics(self.orders, factors[..., None] * self.amplitudes, factors * self.constants)

    def at(self, phases: Floats | float, rows: Integers | int = 0) -> Floats:
        """Return the values of the polynomials `rows` at phases, both (p,) or one for all; of one at one, a number."""
        places = Places.of(phases, rows)
        values = np.empty_like(places.phases)
        values_at(*self, *places, values)
        return values if np.ndim(phases) or np.ndim(rows) else values[0]

    def zeros(self) -> Places:
        """Return all zeros in [0, 2 pi); those closer than SAME_ZERO are one.

        Rows do not decrease, and the zeros of a row increase. A double zero may be missed, or found as two that are
        farther apart.
        """
        near = self._near_zeros()
        zeros, counts = np.empty_like(near), np.empty(len(near), dtype=np.int64)
        zeros_near(*self, near, zeros, counts)
        is_zero = np.arange(near.shape[1]) < counts[:, None]
        return Places(zeros[is_zero], np.nonzero(is_zero)[0])

    def _near_zeros(self) -> Floats:
        """Return phases near all zeros, (m, 2 degree); NaN fills the rows.

        They are the angles of the roots, on the unit circle, of polynomials of exp(i phase).
        """
        degree = int(self.orders[-1])
        near = np.full((len(self.amplitudes), 2 * degree), np.nan)
        if len(self.orders) == 1:
            near_zeros_of_sines(float(degree), self.amplitudes, self.constants, near)
            return near
        for phases, amplitudes, constant in zip(near, self.amplitudes, self.constants, strict=True):
            coefficients = np.zeros(2 * degree + 1, dtype=np.complex128)
            coefficients[degree] = constant
            for order, amplitude in zip(self.orders.astype(np.int64).tolist(), amplitudes.tolist(), strict=True):
                coefficients[degree + order] += amplitude / 2j
                coefficients[degree - order] -= amplitude.conjugate() / 2j
            if np.any(coefficients):
                roots = np.roots(coefficients[::-1])
                angles = np.angle(roots[np.abs(np.abs(roots) - 1.0) <= ON_UNIT_CIRCLE])
                phases[: len(angles)] = angles
        return near


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
