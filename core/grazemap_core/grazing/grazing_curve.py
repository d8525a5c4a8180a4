"""Grazes of two equal stops at once, or of one, with the other one at another distance or absent; what recurs there.

See theory, "Steady motion and the grazing curve", "Recurrence of impacts", "Any linear structure" and "Several
harmonics".

About the equilibrium the contact coordinate of the steady motion is ``q = sum_k Im(X_k e^{i k omega t})``. The motion
touches the right stop where its clearance is ``A_R + q_e``, the left one where it is ``A_L - q_e``, with A_R the
largest q and A_L the largest -q; one harmonic has A_R = A_L, its amplitude. The motion exists while both are less than
the gaps; where that of the other stop is not, the graze is virtual. After a graze impacts recur on the same stop, after
whole periods of the forces. Where both stops are grazed at once they recur after half periods, on the other stop and on
the same one in turn.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.errors import ParameterError, checked_omega, checked_order
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import contact_response, contact_response_and_slope, require_forced
from grazemap_core.model.impulse_response import ImpulseResponse, evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
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
            As `require_amplitude`, where there are several harmonics.
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


@dataclass(frozen=True)
class VariedStop:
    """The stop that is grazed, whose clearance varies along the grazing curve, and where the other one is."""

    stop: int
    """+1 or -1."""
    other: float | None = None
    """The fixed clearance of the other stop; None: it is absent, or `together`."""
    together: bool = False
    """Whether the other stop has the clearance of this one."""
    alike: bool = False
    """Whether both are grazed at once, half a period of the forces apart: they are at equal gaps from the equilibrium,
    and the forces change their sign after half of their period, as one harmonic does."""

    @property
    def half_periods(self) -> int:
        """Half periods of the forces from a graze to the next one of the same motion, of either stop if alike."""
        return 1 if self.alike else 2

    @property
    def turn(self) -> float:
        """Advance of omega t in this time; omega is the own frequency of the forces."""
        return self.half_periods * math.pi

    def returns(self, count: int) -> tuple[Floats, Floats]:
        """Return omega t from a graze to each of the next returns, and +1 if it is to the same stop, -1 if not.

        Both have the shape (count,); count is 0 or greater.
        """
        number = np.arange(1.0, count + 1.0)
        return self.turn * number, (-1.0) ** number if self.alike else np.ones(count)

    def require(self, oscillator: Oscillator) -> None:
        """Raise ParameterError if the stops are to be alike and the forces have even and odd harmonics."""
        if self.alike and not oscillator.is_half_wave_symmetric:
            raise ParameterError("forcing", "has even and odd harmonics, so that equal stops are not grazed at once")

    def clearance(self, oscillator: Oscillator, amplitude: Floats) -> Floats:
        """Return the clearance at which the steady motion grazes the stop, from its amplitude toward it."""
        return amplitude if self.alike else amplitude + self.stop * contact_equilibrium(oscillator)

    def margins(self, oscillator: Oscillator, motion: SteadyMotion, amplitude: Floats) -> Floats:
        """Return the `margin` of a motion with this amplitude toward the stop; infinite if both are grazed at once."""
        if self.alike:
            return np.full(len(amplitude), np.inf)
        return self.margin(oscillator, amplitude, motion.toward(-self.stop).amplitude)

    def margin(self, oscillator: Oscillator, amplitude: Floats, other: Floats) -> Floats:
        """Return the gap of the other stop minus the amplitude toward it where this one is grazed.

        The amplitudes are those toward this stop and toward the `other` one. The margin is infinite if the other stop
        is absent. Raises ParameterError as `other_gap`.
        """
        if self.together:
            return np.asarray(2.0 * self.stop * contact_equilibrium(oscillator) - (other - amplitude))
        return np.asarray(self.other_gap(oscillator) - other)

    def other_gap(self, oscillator: Oscillator) -> float:
        """Return the gap of the other stop from the equilibrium, if it is fixed; infinite if it is not.

        Raises
        ------
        ParameterError
            The gap is not greater than 0: the equilibrium is beyond that stop, so there is no motion without contact.
        """
        if self.other is None:
            return math.inf
        gap = self.other + self.stop * contact_equilibrium(oscillator)
        if not gap > 0.0:
            raise ParameterError("clearance", "of the fixed stop leaves the equilibrium beyond it: nothing grazes")
        return gap


ALIKE = VariedStop(1, together=True, alike=True)
"""Two equal stops that are grazed at once, the right one first."""


@dataclass(frozen=True, eq=False)
class StopGrazes:
    """The grazes of one stop, or of both at once, at n frequencies: equations (16)-(19), the paper's Figure 2.

    Half periods are those of the forces: with p the common divisor of the harmonics, pi/(p omega).
    """

    omega: Floats
    """(n,) Forcing frequencies."""
    clearance: Floats
    """(n,) Of this stop, at which the steady motion touches it; of both stops, its largest displacement."""
    phase: Floats
    """(n,) omega t at the contact, in (-pi/p, pi/p]."""
    acceleration: Floats
    """(n,) Away from the stop, at the graze."""
    margin: Floats
    """(n,) Gap of the other stop minus the amplitude toward it; infinite if it is absent, or if both are grazed. The
    graze is virtual where it is negative."""
    first_recurrence: Integers
    """(n,) Number of half periods of the forces after which an impact first recurs; 0: none up to max_order. On one
    stop it is even."""

    @property
    def virtual(self) -> Booleans:
        """Whether the steady motion meets the other stop before it touches this one."""
        return np.asarray(self.margin < 0.0)

    @property
    def recurrence_stop(self) -> Integers:
        """The stop (+1 right, -1 left) that is hit again after a graze of both, the right one first; 0 if none is."""
        order = self.first_recurrence
        return np.where(order == 0, 0, np.where(order % 2 == 0, 1, -1))


def grazing_curve(oscillator: Oscillator, omega: ArrayLike, max_order: int = 8) -> StopGrazes:
    """Return the grazing curve, on which the steady motion grazes both stops; as `stop_grazes`."""
    return stop_grazes(oscillator, omega, ALIKE, max_order)


@in_own_period
def stop_grazes(oscillator: Oscillator, omega: ArrayLike, varied: VariedStop, max_order: int = 8) -> StopGrazes:
    """Return the grazes of one stop, or of both.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        Forcing frequencies > 0 (rad/s in SI).
    varied : VariedStop
    max_order : int
        Largest number of half periods after which a recurring impact is looked for, >= 1.

    Raises
    ------
    ParameterError
        Nothing is forced, a number is out of range, the equilibrium is beyond the other stop, or the stops are to be
        alike and the forces have even and odd harmonics.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model, which the recurrences need, is ill-conditioned.
    """
    require_forced(oscillator)
    varied.require(oscillator)
    checked_order("max_order", max_order, 1)
    values = checked_omega(omega)
    motion = steady_motion(oscillator, values)
    if varied.alike:
        motion.require_amplitude()
    maxima = motion.toward(varied.stop)
    margin = varied.margins(oscillator, motion, maxima.amplitude)
    returns = varied.returns(max_order // varied.half_periods)
    impulse = impulse_response(modal_model(oscillator))
    return StopGrazes(
        omega=values,
        clearance=varied.clearance(oscillator, maxima.amplitude),
        phase=maxima.phase,
        acceleration=values**2 * maxima.curvature,
        margin=margin,
        first_recurrence=varied.half_periods * first_recurrence(impulse, values, *returns),
    )


def first_recurrence(response: ImpulseResponse, omega: Floats, phases: Floats, sides: Floats) -> Integers:
    """Return the number of the first contact after a graze at which an impact recurs, 0 if none does.

    That is the first contact with ``side g(phase/omega) < 0``, equations (33)-(40), where g is the response of the
    contact to an impulse. Where g is smaller than its round-off, as at a codimension-two point of that order, or
    underflows, no impact recurs.

    Parameters
    ----------
    response : ImpulseResponse
    omega : ndarray of shape (n,)
    phases : ndarray of shape (M,)
        Advance of omega t from the graze to each contact, increasing.
    sides : ndarray of shape (M,)
        +1 where a contact is with the grazed stop, and -1 where it is with the other one.

    Returns
    -------
    ndarray of int, shape (n,)
    """
    first = np.zeros(len(omega), dtype=np.int64)
    for number, (phase, side) in enumerate(zip(phases.tolist(), sides.tolist(), strict=True), start=1):
        pending = np.flatnonzero(first == 0)
        if not len(pending):
            break
        value, _, roundoff, _ = evaluate(response, phase / omega[pending])
        first[pending[side * value < -roundoff]] = number
    return first
