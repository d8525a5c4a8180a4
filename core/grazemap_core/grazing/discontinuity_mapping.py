"""The discontinuity mapping at a grazing point: leading order, equation (27), and exact.

The mapping acts on states of the Poincare surface ``q' = 0``. If the contact is beyond the stop there, an impact
precedes the state. The image is another state on the surface: the motion without impacts through it is the motion after
the impact. The paper's (27) omits the mapped state x; see docs/theory.md.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.backward_flow import BackwardFlow
from grazemap_core.grazing.point import GrazingPoint, checked_deviation
from grazemap_core.grazing.tolerances import DOMAIN_WIDTH, FIRST_OVERSHOOT, MAX_OVERSHOOT
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class ExactMapping:
    """The image of one state under the exact discontinuity mapping."""

    deviation: Floats
    """(2N + 1,) The image, relative to the grazing point."""
    displacement: Floats
    """(2N + 1,) The image minus the state, to full relative accuracy."""
    impact: Floats
    """(2N + 1,) Deviation just before the impact. Its q is that of the stop, ``-stop depth``."""
    velocity: float
    """Velocity of the contact just before the impact, signed."""


@dataclass(frozen=True, eq=False)
class MappingError:
    """Errors of the leading-order mapping for states that differ from the graze only by the contact beyond the stop.

    Sizes are those of `GrazingPoint.size`: the largest entry in units of amplitude, omega amplitude and radians.
    """

    overshoot: Floats
    """(n,) Distances of the contact beyond the stop."""
    displacement: Floats
    """(n,) Size of the displacement by the exact mapping."""
    leading: Floats
    """(n,) Size of the error of ``x + beta u``."""
    second: Floats
    """(n,) Size of the error of ``x + beta u + gamma u^2``."""
    leading_order: float
    """Exponent of the overshoot fitted to the first error; 1 in theory. NaN for fewer than two overshoots."""
    second_order: float
    """Exponent fitted to the second error; 3/2 in theory. NaN likewise."""


def overshoot_of(point: GrazingPoint, deviation: ArrayLike, depth: float = 0.0) -> float:
    """Return how far the contact is beyond the stop, negative if it is inside; `depth` as in `leading_mapping`."""
    return depth + point.stop * point.contact_of(checked_deviation(point, deviation, on_surface=False))[0]


def leading_mapping(point: GrazingPoint, deviation: ArrayLike, depth: float = 0.0) -> Floats:
    """Return ``x + beta u`` with ``u = sqrt(2 overshoot/|a*|)``, equation (27), or x itself without an overshoot.

    Parameters
    ----------
    point : GrazingPoint
    deviation : array_like of shape (2N + 1,)
        Deviation of the state from the grazing point, with q' = 0.
    depth : float
        Steady amplitude minus clearance; the clearance is ``point.clearance - depth``. With q of the deviation, the
        overshoot is ``depth + stop q``.

    Returns
    -------
    ndarray of shape (2N + 1,)
        Deviation of the image.

    Raises
    ------
    ParameterError
        The deviation is of the wrong shape, not finite, or not on the Poincare surface.
    """
    values = checked_deviation(point, deviation)
    overshoot = overshoot_of(point, values, depth)
    if overshoot <= 0.0:
        return values
    u = math.sqrt(2.0 * overshoot / abs(point.acceleration))
    return values + u * point.beta


def exact_mapping(point: GrazingPoint, deviation: ArrayLike, depth: float = 0.0) -> ExactMapping:
    """Return the image of a state on the Poincare surface under the exact mapping, without an expansion.

    The motion is followed backward to where the contact passed the stop; the impact law is applied; and the motion is
    followed backward again to where it would have been at rest. Both searches find the last such time, with full
    relative accuracy at any overshoot.

    Parameters
    ----------
    point, deviation, depth
        As in `leading_mapping`.

    Returns
    -------
    ExactMapping

    Raises
    ------
    ParameterError
        "overshoot": it is not positive, or beyond the domain of the mapping: the contact did not pass the stop in the
        previous half period of the forces, is accelerated toward the stop after the impact, or would not have been at
        rest in the half period before it. "deviation": as in `leading_mapping`.
    """
    values = checked_deviation(point, deviation)
    overshoot = overshoot_of(point, values, depth)
    if not overshoot > 0.0:
        raise ParameterError("overshoot", "must be greater than 0: the contact does not reach the stop")
    result = _exact(point, values, overshoot, depth)
    if isinstance(result, str):
        raise ParameterError("overshoot", result)
    return result


def mapping_error(point: GrazingPoint, overshoots: ArrayLike) -> MappingError:
    """Return the errors of the leading-order mapping and of the next order over a list of overshoots.

    Parameters
    ----------
    point : GrazingPoint
    overshoots : array_like of shape (n,)
        > 0, in the units of the clearance.

    Raises
    ------
    ParameterError
        An overshoot is not positive, or beyond the domain of the exact mapping.
    """
    values = np.array(overshoots, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.isfinite(values)):
        raise ParameterError("overshoot", "must be a list of finite numbers")
    displacement, leading, second = np.empty((3, len(values)))
    for k, overshoot in enumerate(values):
        exact = exact_mapping(point, beyond_stop(point, float(overshoot))).displacement
        u = math.sqrt(2.0 * overshoot / abs(point.acceleration))
        first = exact - u * point.beta
        displacement[k], leading[k] = point.size(exact), point.size(first)
        second[k] = point.size(first - u * u * point.gamma)
    return MappingError(values, displacement, leading, second, _order(values, leading), _order(values, second))


def largest_overshoot(point: GrazingPoint) -> float:
    """Return the overshoot up to which the exact mapping is defined for the contact displaced beyond the stop.

    The other coordinates are as in the graze. The relative error is 1e-6. Overshoots of 2^k 1e-3 amplitudes are tested:
    all below the result are in the domain. The result is infinite if all of them up to 1024 amplitudes are.
    """
    inside, outside = 0.0, FIRST_OVERSHOOT * point.amplitude
    while _defined(point, outside):
        inside, outside = outside, 2.0 * outside
        if outside > MAX_OVERSHOOT * point.amplitude:
            return math.inf
    while outside - inside > DOMAIN_WIDTH * outside:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if _defined(point, middle) else (inside, middle)
    return inside


def beyond_stop(point: GrazingPoint, overshoot: float, depth: float = 0.0) -> Floats:
    """Return the deviation of the graze displaced beyond the stop, by `Oscillator.with_contact`, and else unchanged."""
    return point.with_contact(np.zeros_like(point.state), point.stop * (overshoot - depth), 0.0)


def _defined(point: GrazingPoint, overshoot: float) -> bool:
    return isinstance(_exact(point, beyond_stop(point, overshoot), overshoot, 0.0), ExactMapping)


def _exact(point: GrazingPoint, deviation: Floats, overshoot: float, depth: float) -> ExactMapping | str:
    """Return the image, or the reason why there is none."""
    flow, restitution = BackwardFlow.of(point), point.oscillator.restitution_of(point.stop)
    phase = float(deviation[-1])
    start = flow.start(point.free_part(deviation), phase)
    back = flow.time_at_stop(start, overshoot, point.half_period)
    if back is None:
        return "is beyond the mapping's domain: the contact did not pass the stop in the previous half period"
    moment = flow.after(start, back)
    velocity = back * moment.slope
    before = start + moment.gained
    impact = deviation + _change(point, flow, moment.gained, phase, back)
    impact = point.with_contact(impact, -point.stop * depth, velocity)

    impulse, size = np.zeros_like(start), point.model.size
    impulse[:size] = point.model.unit_impulse * (-(1.0 + restitution) * velocity)
    impulse[:size, 0] *= flow.generator[:size, 0, 1]
    after = before + impulse
    if point.stop * float(np.sum(flow.rows[2] * after)) >= 0.0:
        return "is beyond the mapping's domain: after the impact the contact is accelerated toward the stop"
    again = 0.0
    if restitution > 0.0:
        flight = flow.time_at_rest(after, -restitution * velocity, point.half_period)
        if flight is None:
            return "is beyond the mapping's domain: the contact would not have been at rest in the previous half period"
        again = flight
    end = flow.after(after, again)

    displacement = _change(point, flow, moment.gained + impulse + end.gained, phase, back + again)
    # the contact is at rest; its overshoot is its displacement from the stop
    beyond = point.stop * again * (again * end.curve - restitution * velocity)
    displacement = point.with_contact(displacement, point.stop * (beyond - overshoot), 0.0)
    return ExactMapping(deviation + displacement, displacement, impact, velocity)


def _change(point: GrazingPoint, flow: BackwardFlow, gained: Floats, phase: float, time: float) -> Floats:
    """Return the change of a state at theta `phase`, shape (2N + 1,), from the change of its blocks over a time."""
    return point.deviation(flow.free(gained), 0.0) + point.steady_change(point.omega * time, phase)


def _order(overshoot: Floats, error: Floats) -> float:
    """Return the exponent of a power law fitted to errors by least squares in logarithms."""
    used = error > 0.0
    if np.count_nonzero(used) < 2:
        return math.nan
    return float(np.polyfit(np.log(overshoot[used]), np.log(error[used]), 1)[0])
