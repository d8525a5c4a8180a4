"""Recurrence after a graze: the sequence xi_m of equations (42)-(58), stability at grazing, and the next contact.

After an impact at the overshoot ``|a_1*| u^2/2``, the overshoot of mass 1 at its m-th return, half a period each, is
``-sign xi_m u`` to leading order: the sign of xi_m decides whether an impact recurs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats, Integers
from grazemap_core.checks import checked_omega, checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.curve import grazing_curve
from grazemap_core.grazing.point import grazing_point
from grazemap_core.model.harmonic_response import require_damped, require_forced
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator


@dataclass(frozen=True, eq=False)
class RecurrenceSequence:
    """xi_m for m = 1 .. M, and the first impact that recurs; if none does, the grazing motion is stable, (33)-(40).

    The rows of arrays of shape (2, M) are for a graze at stop A and at stop C; the return m is at the same stop for
    even m and at the other one for odd m.

    Attributes
    ----------
    order : ndarray of int, shape (M,)
        m.
    xi : ndarray of shape (2, M)
        ``-(1 + R) a_1* Phi_12(m T/2)``, from the impulse response: (45), (57), (58).
    size : ndarray of shape (M,)
        Sum of the moduli of the terms of xi, to which its round-off is relative.
    first_recurrence : int
        First m at which an impact recurs, 0 if none does up to M.
    recurrence_stop : {+1, -1, 0}
        The stop of that impact, for a graze at A; 0 if there is none.
    """

    order: Integers
    xi: Floats
    size: Floats
    first_recurrence: int
    recurrence_stop: int


@dataclass(frozen=True, eq=False)
class NextContact:
    """The next contact after an impact of the steady motion, at a clearance slightly below the grazing curve.

    Attributes
    ----------
    order : ndarray of int, shape (n,)
        Half periods from the impact to the next one, 0 if there is none up to the largest order.
    stop : ndarray of int, shape (n,)
        The stop of the next impact, for an impact at A: +1 (A), -1 (C), 0 if there is none.
    margin : ndarray of shape (n,)
        Minimum relative distance of G_m from its threshold, over the orders up to the next impact. The rule is of
        leading order in ``sqrt(distance)``: it is not reliable if the margin is of that size.
    """

    order: Integers
    stop: Integers
    margin: Floats


def recurrence_sequence(oscillator: Oscillator, omega: float, max_order: int = 8) -> RecurrenceSequence:
    """Return xi_m at one frequency of the grazing curve.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : float
        > 0 (rad/s in SI).
    max_order : int
        M >= 1.

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    checked_order("max_order", max_order, 1)
    curve = grazing_curve(oscillator, [omega], max_order)
    points = (grazing_point(oscillator, omega, 1), grazing_point(oscillator, omega, -1))
    order = np.arange(1, max_order + 1)
    value, _, _, terms = evaluate(impulse_response(points[0].model), order * points[0].half_period)
    factor = -(1.0 + oscillator.restitution) * np.array([[point.acceleration] for point in points])
    return RecurrenceSequence(
        order=order,
        xi=factor * value,
        size=abs(float(factor[0, 0])) * terms,
        first_recurrence=int(curve.first_recurrence[0]),
        recurrence_stop=int(curve.recurrence_stop[0]),
    )


def xi_along(oscillator: Oscillator, omega: ArrayLike, max_order: int = 8) -> Floats:
    """Return xi_m of a graze at stop A along the grazing curve, from the impulse response: (45), (57), (58).

    Parameters and Raises as for `grazing_curve`.

    Returns
    -------
    ndarray of shape (n, max_order)
        An impact recurs at the first m with ``(-1)^m xi_m < 0``, at A for even m and at C for odd m.
    """
    curve = grazing_curve(oscillator, omega, 1)
    checked_order("max_order", max_order, 1)
    half_periods, response = math.pi / curve.omega, impulse_response(modal_model(oscillator))
    factor = -(1.0 + oscillator.restitution) * (-(curve.omega**2) * curve.clearance)
    xi = np.empty((len(factor), max_order))
    for order in range(1, max_order + 1):  # one at a time, as each needs several arrays
        xi[:, order - 1] = factor * evaluate(response, order * half_periods)[0]
    return xi


def next_contact(oscillator: Oscillator, omega: ArrayLike, distance: ArrayLike, max_order: int = 8) -> NextContact:
    """Return the first return with an impact after an impact of the steady motion.

    At the clearance ``A(omega) (1 - distance)`` the impact precedes the maximum of the steady motion by the time
    u = sqrt(2 distance)/omega, and an impact recurs at the first m with

        G_m < u/(2 (1 + R)) (1 - (1 + R) G'_m)^2,    G_m = (-1)^m Phi_12(m T/2), G'_m its derivative likewise,

    which is the sign rule of `grazing_curve` for distance -> 0. The square accounts for the shift of the maximum of x_1
    by the impact: without it only the order of the threshold is correct.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        > 0 (rad/s in SI).
    distance : array_like, one number or shape (n,)
        ``1 - clearance/A(omega)``, in (0, 1).
    max_order : int
        Largest return m, >= 1.

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
    rebound = 1.0 + oscillator.restitution
    response = impulse_response(modal_model(oscillator))
    u = np.sqrt(2.0 * below) / values
    order = np.zeros(len(values), dtype=np.int64)
    margin = np.full(len(values), math.inf)
    for m in range(1, max_order + 1):
        value, slope, _, _ = evaluate(response, m * math.pi / values)
        sign = 1.0 if m % 2 == 0 else -1.0
        threshold = 0.5 * u / rebound * (1.0 - rebound * sign * slope) ** 2
        difference = sign * value - threshold
        pending = order == 0
        relative = np.abs(difference) / np.maximum(threshold, np.finfo(np.float64).tiny)
        margin = np.where(pending, np.minimum(margin, relative), margin)
        order = np.where(pending & (difference < 0.0), m, order)
    stop = np.where(order == 0, 0, np.where(order % 2 == 0, 1, -1))
    return NextContact(order, stop, margin)
