"""The discontinuity mapping at a grazing point: leading order, equation (27), and exact.

The mapping acts on states of the Poincare surface ``q' = 0``. If the contact is beyond the stop there, an impact
precedes the state. The image is another state on the surface: the motion without impacts through it is the motion after
the impact. The paper's (27) omits the mapped state x; see docs/theory.md.

The exact mapping follows the contact backward in time: to the stop, and to the moment of zero velocity. Every harmonic
of the steady motion is treated as a block without decay. Over a time t a block changes by

    u(t) - u(0) = t T phi_1(T t) u(0),     u(t) - u(0) - t T u(0) = t^2 T^2 phi_2(T t) u(0)

so both times are computed from terms that do not cancel, however short they are. The steps of the searches are limited
by a bound of the acceleration or the jerk, so that no zero is missed.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.point import GrazingPoint, checked_deviation
from grazemap_core.grazing.tolerances import (
    BACKWARD_GROWTH,
    BACKWARD_SETTLED,
    BACKWARD_STEPS,
    DOMAIN_WIDTH,
    FIRST_OVERSHOOT,
    KANTOROVICH_RATIO,
    MAX_OVERSHOOT,
)
from grazemap_core.records import NamedTuple, dataclass

_ACCELERATION, _JERK = 0, 1
"""Indices of the result of `_BackwardFlow.bounds`."""


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

    The other coordinates are as in the graze. The relative error is DOMAIN_WIDTH. Overshoots of 2^k FIRST_OVERSHOOT
    amplitudes are tested: all below the result are in the domain. The result is infinite if all of them up to
    MAX_OVERSHOOT amplitudes are.
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


class _Moment(NamedTuple):
    """A moment t of a backward motion, with q(t) = q + t q' + t^2 curve and q'(t) = q' + t slope."""

    gained: Floats
    """(N + H, 2) The change of the blocks."""
    curve: float
    """(q(t) - q - t q')/t^2."""
    slope: float
    """(q'(t) - q')/t."""
    acceleration: float
    """Acceleration of q at t."""


@dataclass(frozen=True, eq=False)
class _BackwardFlow:
    """The N free blocks and the H harmonics, in coordinates (frequency u, u')."""

    point: GrazingPoint
    """The graze at which the motion ends."""
    generator: Floats
    """(N + H, 2, 2) T of each block."""
    rows: Floats
    """(4, N + H, 2) Contribution of each coordinate to q and its first three derivatives."""

    @classmethod
    def of(cls, point: GrazingPoint) -> _BackwardFlow:
        """Return the flow of the blocks of a grazing point."""
        model = point.model
        frequency = np.append(np.sqrt(model.frequency_squared), point.orders * point.omega)
        generator = np.zeros((len(frequency), 2, 2))
        generator[:, 0, 1], generator[:, 1, 0] = frequency, -frequency
        generator[: model.size, 1, 1] = -2.0 * model.decay
        row = np.concatenate([model.contact_row, [[1.0, 0.0]] * len(point.orders)])
        row[:, 0] /= frequency
        rows = [row]
        for _ in range(3):
            rows.append(np.einsum("ja,jab->jb", rows[-1], generator))
        return cls(point, generator, np.array(rows))

    def start(self, free: Floats, phase: float) -> Floats:
        """Return the blocks' state, shape (N + H, 2), of a free part with theta `phase` ahead of the point."""
        rates = self.point.omega * self.point.orders * self.point.contact_steady
        turned = [rate * cmath.exp(1j * k * phase) for k, rate in zip(self.point.orders.tolist(), rates, strict=True)]
        state = np.concatenate([free, [[rate.imag, rate.real] for rate in turned]])
        state[: len(free), 0] *= self.generator[: len(free), 0, 1]
        return state

    def free(self, state: Floats) -> Floats:
        """Return the free part of a state of the blocks, shape (N, 2)."""
        free = state[: self.point.model.size].copy()
        free[:, 0] /= self.generator[: len(free), 0, 1]
        return free

    def after(self, state: Floats, time: float) -> _Moment:
        """Return the moment a time of either sign after a state."""
        nested = np.zeros((len(state), 6, 6))
        nested[:, :2, :2] = self.generator * time
        nested[:, :2, 2:4] = nested[:, 2:4, 4:] = np.eye(2)
        functions = expm(nested)
        whole, first, second = functions[:, :2, :2], functions[:, :2, 2:4], functions[:, :2, 4:]
        speeding = self.rows[2]
        return _Moment(
            gained=time * np.einsum("jab,jbc,jc->ja", first, self.generator, state),
            curve=float(np.einsum("ja,jab,jb->", speeding, second, state)),
            slope=float(np.einsum("ja,jab,jb->", speeding, first, state)),
            acceleration=float(np.einsum("ja,jab,jb->", speeding, whole, state)),
        )

    def bounds(self, state: Floats, span: float) -> tuple[float, float]:
        """Return bounds of acceleration and jerk of the contact over a time `span` before a state.

        The energy of a block grows backward by a factor of at most exp(4 decay span).
        """
        decay = -0.5 * self.generator[:, 1, 1]
        size = np.linalg.norm(state, axis=1) * np.exp(np.minimum(2.0 * decay * span, BACKWARD_GROWTH))
        second, third = np.linalg.norm(self.rows[2:], axis=2) @ size
        return float(second), float(third)

    def time_at_stop(self, state: Floats, overshoot: float, longest: float) -> float | None:
        """Return when the contact, at rest beyond the stop by an overshoot > 0, passed it last.

        That is a time of at least ``-longest``, with a relative error of a few roundings, or None.
        """
        stop = self.point.stop

        def depth(time: float, now: _Moment) -> tuple[float, float]:
            return overshoot + stop * time * time * now.curve, stop * time * now.slope

        return self._last_zero(_ACCELERATION, state, longest, depth)

    def time_at_rest(self, state: Floats, velocity: float, longest: float) -> float | None:
        """Return when the contact, leaving a stop at a velocity, would have rested last; as `time_at_stop`.

        The velocity is the exact one of the contact.
        """
        stop = self.point.stop

        def leaving(time: float, now: _Moment) -> tuple[float, float]:
            return -stop * (velocity + time * now.slope), -stop * now.acceleration

        return self._last_zero(_JERK, state, longest, leaving)

    def _last_zero(
        self, which: int, state: Floats, longest: float, function: Callable[[float, _Moment], tuple[float, float]]
    ) -> float | None:
        """Return the last zero before 0, within `longest`, of a function that is positive at 0.

        `function` returns its value and its rate; `which` of the `bounds` is that of the change of its rate.
        """
        time = 0.0
        for _ in range(BACKWARD_STEPS):
            now = self.after(state, time)
            value, rate = function(time, now)
            here = state + now.gained
            if value <= 0.0 or self._newton_converges(which, here, value, rate):
                break
            time -= self._step(which, here, value, rate)
            if time < -longest:
                return None
        else:
            return None
        if rate <= 0.0:  # a touch within round-off
            return None
        for _ in range(BACKWARD_STEPS):
            before, time = time, time - value / rate
            if abs(time - before) <= BACKWARD_SETTLED * abs(time):
                break
            value, rate = function(time, self.after(state, time))
        return time if time >= -longest else None

    def _step(self, which: int, state: Floats, value: float, rate: float) -> float:
        """Return a backward step over which a positive value that decreases at a rate has no zero, by bounds."""

        def reach(bound: float) -> float:
            return 2.0 * value / (rate + math.sqrt(rate * rate + 2.0 * bound * value))

        return reach(self.bounds(state, reach(self.bounds(state, 0.0)[which]))[which])

    def _newton_converges(self, which: int, state: Floats, value: float, rate: float) -> bool:
        """Return whether Newton's method converges to the next zero, by Kantorovich's condition."""
        if rate <= 0.0:
            return False
        return self.bounds(state, 2.0 * value / rate)[which] * value <= KANTOROVICH_RATIO * rate * rate


def _defined(point: GrazingPoint, overshoot: float) -> bool:
    return isinstance(_exact(point, beyond_stop(point, overshoot), overshoot, 0.0), ExactMapping)


def _exact(point: GrazingPoint, deviation: Floats, overshoot: float, depth: float) -> ExactMapping | str:
    """Return the image, or the reason why there is none."""
    flow, restitution = _BackwardFlow.of(point), point.oscillator.restitution_of(point.stop)
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


def _change(point: GrazingPoint, flow: _BackwardFlow, gained: Floats, phase: float, time: float) -> Floats:
    """Return the change of a state at theta `phase`, shape (2N + 1,), from the change of its blocks over a time."""
    return point.deviation(flow.free(gained), 0.0) + point.steady_change(point.omega * time, phase)


def _order(overshoot: Floats, error: Floats) -> float:
    """Return the exponent of a power law fitted to errors by least squares in logarithms."""
    used = error > 0.0
    if np.count_nonzero(used) < 2:
        return math.nan
    return float(np.polyfit(np.log(overshoot[used]), np.log(error[used]), 1)[0])
