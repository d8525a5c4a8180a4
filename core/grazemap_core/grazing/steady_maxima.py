"""The maxima of the steady motion without contact: where it comes closest to a stop, and how fast it turns back.

About the equilibrium the contact coordinate is ``q = sum_k Im(X_k e^{i k omega t})``. The right stop is grazed at the
largest q, the left one at the largest -q (theory, "Several harmonics"). With one harmonic these are its amplitude.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.errors import ParameterError
from grazemap_core.model.harmonic_response import contact_response, contact_response_and_slope
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.trig_maxima import derivatives, highest_points, roundoff
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class SteadyMaxima:
    """The largest displacement from the equilibrium toward one stop, at n frequencies; arrays of shape (n,)."""

    amplitude: Floats
    """A, this displacement."""
    phase: Floats
    """omega t there, in (-pi, pi]."""
    curvature: Floats
    """Acceleration away from the stop there, over omega^2; A of the first harmonic alone."""
    slope: Floats
    """d A/d omega; that of one of the maxima where two are equal."""


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """The steady motion of the contact coordinate at n frequencies, in H harmonics."""

    orders: Floats
    """(H,) k, increasing, without a common divisor."""
    response: Complexes
    """(n, H) X_k."""
    slopes: Complexes
    """(n, H) d X_k/d omega; NaN where the slopes were not asked for."""

    @property
    def roundoff(self) -> Floats:
        """Bound of the round-off of a displacement, shape (n,)."""
        return roundoff(self.orders, self.response)

    def require_amplitude(self) -> None:
        """Raise ParameterError if at one of the frequencies the amplitudes overflow, or all underflow."""
        size = np.abs(self.response).sum(axis=1)
        if not np.all(np.isfinite(size) & (size > 0.0)):
            raise ParameterError("omega", "contains a frequency at which the amplitude overflows or underflows")

    def toward(self, stop: int) -> SteadyMaxima:
        """Return the maxima toward the right stop (+1) or the left one (-1).

        Raises
        ------
        ParameterError
            There are several harmonics, and as `require_amplitude`.
        """
        return self._of_one_harmonic(stop) if len(self.orders) == 1 else self._of_several(stop)

    def _of_one_harmonic(self, stop: int) -> SteadyMaxima:
        response = self.response[:, 0]
        amplitude = np.abs(response)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (np.conj(response) * self.slopes[:, 0]).real / amplitude
        # q is the amplitude times `stop` where the argument of the response is stop pi/2
        return SteadyMaxima(amplitude, wrapped(stop * 0.5 * np.pi - np.angle(response)), amplitude, slope)

    def _of_several(self, stop: int) -> SteadyMaxima:
        self.require_amplitude()
        peaks = highest_points(self.orders, stop * self.response)
        slope, _, _ = derivatives(self.orders, stop * self.slopes, peaks.phase)
        return SteadyMaxima(peaks.height, wrapped(peaks.phase), peaks.curvature, slope)


def steady_motion(oscillator: Oscillator, omega: Floats, slopes: bool = False) -> SteadyMotion:
    """Return the steady motion at frequencies (n,), with its slopes if asked for. Raises as `contact_response`."""
    orders = np.array([harmonic.order for harmonic in oscillator.drive], dtype=np.float64)
    if slopes:
        return SteadyMotion(orders, *contact_response_and_slope(oscillator, omega))
    response = contact_response(oscillator, omega)
    return SteadyMotion(orders, response, np.full_like(response, np.nan))


def wrapped(phase: Floats | float) -> Floats:
    """Return phases between -3 pi and 3 pi in (-pi, pi]."""
    return np.where(phase > np.pi, phase - 2.0 * np.pi, np.where(phase <= -np.pi, phase + 2.0 * np.pi, phase))
