"""The motion of the contact near a graze, backward in time: to the stop, and to the moment of zero velocity.

Every harmonic of the steady motion is treated as a block without decay. Over a time t a block changes by

    u(t) - u(0) = t T phi_1(T t) u(0),     u(t) - u(0) - t T u(0) = t^2 T^2 phi_2(T t) u(0)

so both times are computed from terms that do not cancel, however short they are. The steps of the searches are limited
by a bound of the acceleration or the jerk, so that no zero is missed.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable

import numpy as np
from scipy.linalg import expm

from grazemap_core.arrays import Floats
from grazemap_core.grazing.point import GrazingPoint
from grazemap_core.grazing.tolerances import BACKWARD_GROWTH, BACKWARD_STEPS, KANTOROVICH_RATIO
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.tolerances import EPSILON

ACCELERATION, JERK = 0, 1
"""Indices of the result of `BackwardFlow.bounds`."""


class Moment(NamedTuple):
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
class BackwardFlow:
    """The N free blocks and the H harmonics, in coordinates (frequency u, u')."""

    point: GrazingPoint
    """The graze at which the motion ends."""
    generator: Floats
    """(N + H, 2, 2) T of each block."""
    rows: Floats
    """(4, N + H, 2) Contribution of each coordinate to q and its first three derivatives."""

    @classmethod
    def of(cls, point: GrazingPoint) -> BackwardFlow:
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

    def after(self, state: Floats, time: float) -> Moment:
        """Return the moment a time of either sign after a state."""
        nested = np.zeros((len(state), 6, 6))
        nested[:, :2, :2] = self.generator * time
        nested[:, :2, 2:4] = nested[:, 2:4, 4:] = np.eye(2)
        functions = expm(nested)
        whole, first, second = functions[:, :2, :2], functions[:, :2, 2:4], functions[:, :2, 4:]
        speeding = self.rows[2]
        return Moment(
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
        """Return when the contact, at rest beyond the stop by an overshoot, passed it; None if not within `longest`.

        Parameters
        ----------
        state : ndarray of shape (N + H, 2)
        overshoot : float
            > 0.
        longest : float
            Duration of the search.

        Returns
        -------
        float or None
            The last such time before 0, with a relative error of a few roundings.
        """
        stop = self.point.stop

        def depth(time: float, now: Moment) -> tuple[float, float]:
            return overshoot + stop * time * time * now.curve, stop * time * now.slope

        return self._last_zero(ACCELERATION, state, longest, depth)

    def time_at_rest(self, state: Floats, velocity: float, longest: float) -> float | None:
        """Return when the contact, leaving a stop at a velocity, would have rested; None if not within `longest`.

        Parameters and the result are as in `time_at_stop`; the velocity is the exact one of the contact.
        """
        stop = self.point.stop

        def leaving(time: float, now: Moment) -> tuple[float, float]:
            return -stop * (velocity + time * now.slope), -stop * now.acceleration

        return self._last_zero(JERK, state, longest, leaving)

    def _last_zero(
        self, which: int, state: Floats, longest: float, function: Callable[[float, Moment], tuple[float, float]]
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
            if abs(time - before) <= 2.0 * EPSILON * abs(time):
                break
            value, rate = function(time, self.after(state, time))
        return time if time >= -longest else None

    def _step(self, which: int, state: Floats, value: float, rate: float) -> float:
        """Return a backward step over which a positive value that decreases at a rate has no zero, by bounds."""

        def reach(bound: float) -> float:
            return 2.0 * value / (rate + math.sqrt(rate * rate + 2.0 * bound * value))

        return reach(self.bounds(state, reach(self.bounds(state, 0.0)[which]))[which])

    def _newton_converges(self, which: int, state: Floats, value: float, rate: float) -> bool:
        """Return whether Newton's method converges to the next zero of the value, by Kantorovich's condition."""
        if rate <= 0.0:
            return False
        return self.bounds(state, 2.0 * value / rate)[which] * value <= KANTOROVICH_RATIO * rate * rate
