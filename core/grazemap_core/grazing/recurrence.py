"""What a graze leads to: the sequence xi_m of equations (42)-(58), stability at grazing, and the next contact below it.

An oscillator and forcing frequencies flow in. After an impact at overshoot ``|a_1*| u^2/2`` mass 1 comes to its m-th
return, half a period each, with the overshoot ``-sign xi_m u`` to leading order: the sign of xi_m decides what recurs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats, Integers
from grazemap_core.checks import checked_omega, checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.codimension_two import Family, families_of_order
from grazemap_core.grazing.curve import grazing_curve
from grazemap_core.grazing.half_period_maps import flow_jacobian, half_period_jacobian
from grazemap_core.grazing.point import GrazingPoint, grazing_point
from grazemap_core.model.harmonic_response import require_damped, require_forced
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator

Jacobian = Callable[[GrazingPoint], Floats]


@dataclass(frozen=True, eq=False)
class RecurrenceSequence:
    """xi_m for m = 1 .. M, three ways, and what it says about the stability of the grazing motion.

    Rows of the arrays of shape (2, M) are a graze at stop A and one at C; the return m is at the same stop for even
    m and at the other one for odd m.

    Attributes
    ----------
    order : ndarray of int, shape (M,)
        m.
    families : tuple of M pairs of Family
        The paper's case and n for the first and second row: cases 3 and 2 for odd m, 1 and 4 for even m, (42).
    xi : ndarray of shape (2, M)
        ``-(1 + R) a_1* Phi_12(m T/2)``, from the impulse response: (45), (57), (58).
    from_jacobians : ndarray of shape (2, M)
        The same from products of the Jacobians of P_1 and P_2 and from beta, as (42) is written.
    from_flows : ndarray of shape (2, M)
        The same from products of the flow's Jacobians, as (57) is written.
    size : ndarray of shape (M,)
        Size of the terms that xi is the sum of; its round-off is relative to this.
    first_recurrence : int
        First m with an impact that recurs, 0 if none does up to M.
    recurrence_stop : {+1, -1, 0}
        Where, for a graze at A; 0 if none does.
    """

    order: Integers
    families: tuple[tuple[Family, Family], ...]
    xi: Floats
    from_jacobians: Floats
    from_flows: Floats
    size: Floats
    first_recurrence: int
    recurrence_stop: int

    @property
    def stable(self) -> bool:
        """No impact recurs up to the last order looked at, so that it fades: equations (33)-(40)."""
        return self.first_recurrence == 0


@dataclass(frozen=True, eq=False)
class NextContact:
    """The contact after one impact of the steady motion, clearances being a little below the grazing curve.

    Attributes
    ----------
    order : ndarray of int, shape (n,)
        Half periods from the first return with an impact to the next, 0 if there is none up to the largest looked at.
    stop : ndarray of int, shape (n,)
        Where, for an impact at A: +1 (A), -1 (C), 0 if there is none.
    margin : ndarray of shape (n,)
        The least distance of an order that was looked at from its threshold, relative to the threshold. The rule is the
        leading order in ``sqrt(distance)``: it decides nothing where the margin is of that size.
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
        A mode is undamped or resonates practically undamped.
    ConditioningError
        The modal model would lose digits.
    """
    checked_order("max_order", max_order, 1)
    curve = grazing_curve(oscillator, [omega], max_order)
    points = (grazing_point(oscillator, omega, 1), grazing_point(oscillator, omega, -1))
    order = np.arange(1, max_order + 1)
    value, _, _, terms = evaluate(impulse_response(points[0].model), order * points[0].half_period)
    factor = -(1.0 + oscillator.restitution) * np.array([[point.acceleration] for point in points])
    return RecurrenceSequence(
        order=order,
        families=tuple(_families(int(m)) for m in order),
        xi=factor * value,
        from_jacobians=np.array([_term_by_term(point, max_order, half_period_jacobian) for point in points]),
        from_flows=np.array([_term_by_term(point, max_order, flow_jacobian) for point in points]),
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
    half_periods = math.pi / curve.omega
    times = np.arange(1, max_order + 1) * half_periods[:, None]
    value, _, _, _ = evaluate(impulse_response(modal_model(oscillator)), times.ravel())
    acceleration = -(curve.omega**2) * curve.clearance
    return np.asarray(-(1.0 + oscillator.restitution) * acceleration[:, None] * value.reshape(times.shape))


def next_contact(oscillator: Oscillator, omega: ArrayLike, distance: ArrayLike, max_order: int = 8) -> NextContact:
    """Return the first return at which the steady motion, once it has hit a stop, hits one again.

    At the clearance ``A(omega) (1 - distance)`` the impact is at u = sqrt(2 distance)/omega before the steady motion
    turns, and an impact recurs at the first m with

        G_m < u/(2 (1 + R)) (1 - (1 + R) G'_m)^2,    G_m = (-1)^m Phi_12(m T/2), G'_m its derivative alike,

    which is the sign rule of `grazing_curve` for distance -> 0. The square is there because the impact moves the moment
    at which mass 1 turns: without it the threshold is of the right order only.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        > 0 (rad/s in SI).
    distance : array_like, one number or shape (n,)
        ``1 - clearance/A(omega)``, in (0, 1).
    max_order : int
        Largest return m looked at, >= 1.

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model would lose digits.
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
    lost = 1.0 + oscillator.restitution
    response = impulse_response(modal_model(oscillator))
    u = np.sqrt(2.0 * below) / values
    order = np.zeros(len(values), dtype=np.int64)
    margin = np.full(len(values), math.inf)
    for m in range(1, max_order + 1):
        value, slope, _, _ = evaluate(response, m * math.pi / values)
        sign = 1.0 if m % 2 == 0 else -1.0
        threshold = 0.5 * u / lost * (1.0 - lost * sign * slope) ** 2
        apart = sign * value - threshold
        looked_at = order == 0
        relative = np.abs(apart) / np.maximum(threshold, np.finfo(np.float64).tiny)
        margin = np.where(looked_at, np.minimum(margin, relative), margin)
        order = np.where(looked_at & (apart < 0.0), m, order)
    stop = np.where(order == 0, 0, np.where(order % 2 == 0, 1, -1))
    return NextContact(order, stop, margin)


def _families(order: int) -> tuple[Family, Family]:
    """Return the families of a return after a graze at A and after one at C."""
    cases = families_of_order(order)
    from_a = next(family for family in cases if family.case in (1, 3))
    from_c = next(family for family in cases if family.case in (2, 4))
    return from_a, from_c


def _term_by_term(point: GrazingPoint, max_order: int, jacobian: Jacobian) -> Floats:
    """Return ``h_D J ... J beta`` for 1 .. max_order factors J, of stops in turn, shape (max_order,)."""
    across, back = jacobian(point), jacobian(point.opposite())
    vector, result = point.beta, np.empty(max_order)
    for m in range(max_order):
        vector = (across if m % 2 == 0 else back) @ vector
        result[m] = -vector[0]  # h_D = (-1, 0, ..., 0)
    return result
