"""Grazes of two equal stops at once, or of one, with the other one at another distance or absent.

See theory, "Steady motion and the grazing curve", "Recurrence of impacts" and "Any linear structure".

The steady motion touches the right stop where its clearance is ``A_R + q_e``, the left one where it is ``A_L - q_e``,
with A_R and A_L its largest displacements from the equilibrium; one harmonic has A_R = A_L. The motion exists while
both are less than the gaps; where that of the other stop is not, the graze is virtual. After a graze impacts recur on
the same stop, after whole periods of the forces: half periods have a meaning for stops that are grazed at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.checks import checked_omega, checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.recurrence import first_recurrence
from grazemap_core.grazing.steady_maxima import require_alike, steady_motion
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import require_forced
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass


@dataclass(frozen=True)
class VariedStop:
    """The stop whose clearance varies, and where the other one is."""

    stop: int
    """+1 or -1."""
    other: float | None = None
    """The fixed clearance of the other stop; None: it is absent."""
    together: bool = False
    """Whether the other stop has the clearance of this one."""

    def margin(self, oscillator: Oscillator, amplitude: Floats, other: Floats) -> Floats:
        """Return the gap of the other stop minus the amplitude toward it where this one is grazed.

        The amplitudes are those toward this stop and toward the `other` one. The margin is infinite if the other stop
        is absent. Raises ParameterError as `other_gap`.
        """
        if self.together:
            return np.asarray(2.0 * self.stop * contact_equilibrium(oscillator) - (other - amplitude))
        return self.other_gap(oscillator) - other

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
    return stop_grazes(oscillator, omega, None, max_order)


@in_own_period
def stop_grazes(oscillator: Oscillator, omega: ArrayLike, varied: VariedStop | None, max_order: int = 8) -> StopGrazes:
    """Return the grazes of one stop, or of both.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        Forcing frequencies > 0 (rad/s in SI).
    varied : VariedStop or None
        None: both stops, at equal gaps, are grazed at once; the forces change their sign after half of their period, as
        one harmonic does.
    max_order : int
        Largest number of half periods after which a recurring impact is looked for, >= 1.

    Raises
    ------
    ParameterError
        Nothing is forced, a number is out of range, the equilibrium is beyond the other stop, or, for both stops, the
        forces have even and odd harmonics.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model, which the recurrences need, is ill-conditioned.
    """
    require_forced(oscillator)
    if varied is None:
        require_alike(oscillator)
    checked_order("max_order", max_order, 1)
    values = checked_omega(omega)
    motion = steady_motion(oscillator, values)
    maxima = motion.toward(1 if varied is None else varied.stop)
    if varied is None and not np.all(np.isfinite(maxima.amplitude) & (maxima.amplitude > 0.0)):
        raise ParameterError("omega", "contains a frequency at which the amplitude overflows or underflows")
    shift, margin, halves = 0.0, np.full(len(values), np.inf), 1  # half periods between two returns
    if varied is not None:
        shift, halves = varied.stop * contact_equilibrium(oscillator), 2
        margin = varied.margin(oscillator, maxima.amplitude, motion.toward(-varied.stop).amplitude)
    impulse, return_time = impulse_response(modal_model(oscillator)), halves * np.pi / values
    returns = first_recurrence(impulse.blocks, impulse.conditioning, return_time, max_order // halves, halves == 2)
    return StopGrazes(
        omega=values,
        clearance=maxima.amplitude + shift,
        phase=maxima.phase,
        acceleration=values**2 * maxima.curvature,
        margin=margin,
        first_recurrence=halves * returns,
    )
