"""The grazing curve, on which the steady motion grazes both stops, and the first recurring impact along it.

See theory, sections 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats, Integers
from grazemap_core.checks import checked_omega, checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.recurrence import first_recurrence
from grazemap_core.model.harmonic_response import contact_response, require_forced
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator


@dataclass(frozen=True, eq=False)
class GrazingCurve:
    """The curve ``clearance = A(omega)`` of equations (16)-(19), the paper's Figure 2.

    Attributes
    ----------
    omega : ndarray of shape (n,)
        Forcing frequencies.
    clearance : ndarray of shape (n,)
        The steady amplitude of mass 1, at which it grazes both stops.
    phase : ndarray of shape (n,)
        tau in (-pi, pi], such that x_1(0) = clearance.
    first_recurrence : ndarray of int, shape (n,)
        First m in 1..max_order at which an impact recurs m half periods after a graze, 0 if none does.
    recurrence_stop : ndarray of int, shape (n,)
        The stop of that impact if the graze is at A: +1 (A) for even m, -1 (C) for odd m, 0 if there is none.
    """

    omega: Floats
    clearance: Floats
    phase: Floats
    first_recurrence: Integers
    recurrence_stop: Integers


def grazing_curve(oscillator: Oscillator, omega: ArrayLike, max_order: int = 8) -> GrazingCurve:
    """Return the grazing curve at the given frequencies.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        Forcing frequencies > 0 (rad/s in SI).
    max_order : int
        Largest return m at which a recurring impact is looked for, >= 1.

    Returns
    -------
    GrazingCurve

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model, which the recurrences need, is ill-conditioned.
    """
    require_forced(oscillator)
    checked_order("max_order", max_order, 1)
    values = checked_omega(omega)
    response = contact_response(oscillator, values)
    if not np.all(np.isfinite(response) & (np.abs(response) > 0.0)):
        raise ParameterError("omega", "contains a frequency at which the amplitude overflows or underflows")
    # q(0) = Im(response e^{i tau}) is largest, the amplitude, where the argument is pi/2
    phase = 0.5 * np.pi - np.angle(response)
    phase = np.where(phase > np.pi, phase - 2.0 * np.pi, phase)

    impulse = impulse_response(modal_model(oscillator))
    order = first_recurrence(impulse.blocks, impulse.conditioning, np.pi / values, max_order, False)
    stop = np.where(order == 0, 0, np.where(order % 2 == 0, 1, -1))
    return GrazingCurve(values, np.abs(response), phase, order, stop)
