"""Recurrence after a graze: the sequence xi_m of equations (42)-(58), stability at grazing, and the next contact.

After an impact at the overshoot ``|a*| u^2/2``, the overshoot of the contact at its m-th return is ``-sign xi_m u`` to
leading order: the sign of xi_m decides whether an impact recurs. Returns are half a period of the forces apart where
the steady motion grazes both stops at once, and else a whole one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats, Integers
from grazemap_core.errors import ParameterError, checked_omega, checked_order
from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop, first_recurrence, grazing_curve, steady_motion
from grazemap_core.grazing.point import GrazingPoint
from grazemap_core.model.harmonic_response import require_damped, require_forced
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class RecurrenceSequence:
    """xi_m for m = 1 .. M, and the first impact that recurs; if none does, the grazing motion is stable, (33)-(40).

    If both stops are grazed at once, the return m is at the same stop for even m and at the other one for odd m.
    """

    order: Integers
    """(M,) m."""
    xi: Floats
    """(M,) ``-(1 + R) a* Phi_12(t_m)`` after the time t_m of m returns, from the impulse response: (45), (57), (58)."""
    size: Floats
    """(M,) Sum of the moduli of the terms of xi, to which its round-off is relative."""
    first_recurrence: int
    """First m at which an impact recurs, 0 if none does up to M."""
    recurrence_stop: int
    """The stop of that impact, +1 or -1; 0 if there is none."""


@dataclass(frozen=True, eq=False)
class NextContact:
    """The next contact after an impact of the steady motion, at a clearance slightly below the grazing curve."""

    order: Integers
    """(n,) Returns from the impact to the next one, 0 if there is none up to the largest order."""
    stop: Integers
    """(n,) The stop of the next impact, 0 if there is none."""
    margin: Floats
    """(n,) Minimum relative distance of G_m from its threshold, over the orders up to the next impact. The rule is of
    leading order in ``sqrt(distance)``: it is not reliable if the margin is of that size."""


def recurrence_sequence(point: GrazingPoint, max_order: int = 8) -> RecurrenceSequence:
    """Return xi_m at one grazing point; max_order is M >= 1."""
    checked_order("max_order", max_order, 1)
    order, impulse = np.arange(1, max_order + 1), impulse_response(point.model)
    value, _, _, terms = evaluate(impulse, order * point.return_time)
    factor = -(1.0 + point.oscillator.restitution_of(point.stop)) * point.acceleration
    phases, sides = point.varied.returns(max_order)
    (first,) = first_recurrence(impulse, np.array([point.varied.turn / point.return_time]), phases, sides).tolist()
    return RecurrenceSequence(
        order=order,
        xi=factor * value,
        size=abs(factor) * terms,
        first_recurrence=first,
        recurrence_stop=0 if first == 0 else int(point.stop * sides[first - 1]),
    )


def xi_along(oscillator: Oscillator, omega: ArrayLike, max_order: int = 8) -> Floats:
    """Return xi_m of a graze of the right stop along the grazing curve, from the impulse response: (45), (57), (58).

    Parameters and Raises as for `grazing_curve`.

    Returns
    -------
    ndarray of shape (n, max_order)
        An impact recurs at the first m with ``(-1)^m xi_m < 0``, at the right stop for even m, at the left for odd m.
    """
    curve = grazing_curve(oscillator, omega, 1)
    checked_order("max_order", max_order, 1)
    half_periods = math.pi / (oscillator.common_divisor * curve.omega)
    response = impulse_response(modal_model(oscillator))
    factor = (1.0 + oscillator.restitution) * curve.acceleration
    xi = np.empty((len(factor), max_order))
    for order in range(1, max_order + 1):  # one at a time, as each needs several arrays
        xi[:, order - 1] = factor * evaluate(response, order * half_periods)[0]
    return xi


def next_contact(
    oscillator: Oscillator,
    omega: ArrayLike,
    distance: ArrayLike,
    max_order: int = 8,
    varied: VariedStop = ALIKE,
) -> NextContact:
    """Return the first return with an impact after an impact of the steady motion.

    Where the clearance is less than on the grazing curve by distance A(omega), the impact precedes the maximum of the
    steady motion by the time u = sqrt(2 distance A/|a*|), and an impact recurs at the first m with

        G_m < u/(2 (1 + R)) (1 - (1 + R) G'_m)^2,    G_m = (-1)^m Phi_12(m T/2), G'_m its derivative likewise,

    which is the sign rule of `grazing_curve` for distance -> 0. The square accounts for the shift of the maximum of q
    by the impact: without it only the order of the threshold is correct. For one stop T stands for T/2, and (-1)^m
    is left out.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        > 0 (rad/s in SI).
    distance : array_like, one number or shape (n,)
        Distance below the grazing curve, in units of A(omega), in (0, 1).
    max_order : int
        Largest return m, >= 1.
    varied : VariedStop
        The stop of the impact. Impacts on the other one are not looked for unless both are grazed at once.

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    require_forced(oscillator)
    require_damped(oscillator)
    checked_order("max_order", max_order, 1)
    values = checked_omega(omega)
    below = np.asarray(distance, dtype=np.float64)
    if below.ndim > 0 and below.shape != values.shape:
        raise ParameterError("distance", "must be one number, or one for every omega")
    if not np.all((below > 0.0) & (below < 1.0)):
        raise ParameterError("distance", "must lie between 0 and 1, both excluded")
    rebound = 1.0 + oscillator.restitution_of(varied.stop)
    response = impulse_response(modal_model(oscillator))
    reduced, divisor = oscillator.at_own_period
    values = divisor * values
    maxima = steady_motion(reduced, values).toward(varied.stop)
    u = np.sqrt(2.0 * below * (maxima.amplitude / maxima.curvature)) / values
    order = np.zeros(len(values), dtype=np.int64)
    margin = np.full(len(values), math.inf)
    phases, sides = varied.returns(max_order)
    for m, phase, sign in zip(range(1, max_order + 1), phases.tolist(), sides.tolist(), strict=True):
        value, slope, _, _ = evaluate(response, phase / values)
        threshold = 0.5 * u / rebound * (1.0 - rebound * sign * slope) ** 2
        difference = sign * value - threshold
        pending = order == 0
        relative = np.abs(difference) / np.maximum(threshold, np.finfo(np.float64).tiny)
        margin = np.where(pending, np.minimum(margin, relative), margin)
        order = np.where(pending & (difference < 0.0), m, order)
    return NextContact(order, (varied.stop * np.append(0.0, sides)[order]).astype(np.int64), margin)
