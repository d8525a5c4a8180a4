"""The motion of mass 1 near a graze, backward in time: to the stop, and to the moment of zero velocity.

The steady motion is treated as a block without decay. Over a time t a block changes by

    u(t) - u(0) = t T phi_1(T t) u(0),     u(t) - u(0) - t T u(0) = t^2 T^2 phi_2(T t) u(0)

so both times are computed from terms that do not cancel, however short they are. The steps of the searches are limited
by a bound of the acceleration or the jerk, so that no zero is missed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from grazemap_core.arrays import Floats
from grazemap_core.grazing.point import GrazingPoint
from grazemap_core.grazing.tolerances import BACKWARD_GROWTH, BACKWARD_STEPS, KANTOROVICH_RATIO
from grazemap_core.tolerances import EPSILON

ACCELERATION, JERK = 0, 1
"""Indices of the result of `BackwardFlow.bounds`."""


class Moment(NamedTuple):
    """A moment of a backward motion: the change of its blocks, shape (N + 1, 2), and mass 1.

    With x_1(t) = x_1 + t v_1 + t^2 curve and v_1(t) = v_1 + t slope; `acceleration` is that at t.
    """

    gained: Floats
    curve: float
    slope: float
    acceleration: float


@dataclass(frozen=True, eq=False)
class BackwardFlow:
    """The N free blocks and the steady motion, in coordinates (frequency u, u').

    Attributes
    ----------
    point : GrazingPoint
    generator : ndarray of shape (N + 1, 2, 2)
        T of each block.
    rows : ndarray of shape (4, N + 1, 2)
        Contribution of each coordinate to x_1 and its first three derivatives.
    """

    point: GrazingPoint
    generator: Floats
    rows: Floats

    @classmethod
    def of(cls, point: GrazingPoint) -> BackwardFlow:
        """Return the flow of the blocks of a grazing point."""
        model = point.model
        frequency = np.append(np.sqrt(model.frequency_squared), point.omega)
        generator = np.zeros((len(frequency), 2, 2))
        generator[:, 0, 1], generator[:, 1, 0] = frequency, -frequency
        generator[:-1, 1, 1] = -2.0 * model.decay
        row = np.concatenate([model.shape[0], [[1.0, 0.0]]])
        row[:, 0] /= frequency
        rows = [row]
        for _ in range(3):
            rows.append(np.einsum("ja,jab->jb", rows[-1], generator))
        return cls(point, generator, np.array(rows))

    def start(self, free: Floats, phase: float) -> Floats:
        """Return the blocks' state, shape (N + 1, 2), of a free part with theta `phase` ahead of the point."""
        amplitude = self.point.stop * self.point.omega * self.point.clearance
        state = np.concatenate([free, [[amplitude * math.cos(phase), -amplitude * math.sin(phase)]]])
        state[:-1, 0] *= self.generator[:-1, 0, 1]
        return state

    def free(self, state: Floats) -> Floats:
        """Return the free part of a state of the blocks, shape (N, 2)."""
        free = state[:-1].copy()
        free[:, 0] /= self.generator[:-1, 0, 1]
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
        """Return bounds of acceleration and jerk of mass 1 over a time `span` before a state.

        The energy of a block grows backward by a factor of at most exp(4 decay span).
        """
        decay = -0.5 * self.generator[:, 1, 1]
        size = np.linalg.norm(state, axis=1) * np.exp(np.minimum(2.0 * decay * span, BACKWARD_GROWTH))
        second, third = np.linalg.norm(self.rows[2:], axis=2) @ size
        return float(second), float(third)

    def time_at_stop(self, state: Floats, overshoot: float, longest: float) -> float | None:
        """Return when mass 1, at rest at an overshoot beyond the stop, passed the stop; None if not within `longest`.

        Parameters
        ----------
        state : ndarray of shape (N + 1, 2)
        overshoot : float
            > 0.
        longest : float
            Duration of the search.

        Returns
        -------
        float or None
            The last such time before 0, with a relative error of a few roundings.
        """
        stop, time = self.point.stop, 0.0
        for _ in range(BACKWARD_STEPS):
            now = self.after(state, time)
            depth, speed = overshoot + stop * time * time * now.curve, stop * time * now.slope
            here = state + now.gained
            if depth <= 0.0 or self._newton_converges(ACCELERATION, here, depth, speed):
                break
            time -= self._step(ACCELERATION, here, depth, speed)
            if time < -longest:
                return None
        else:
            return None
        if speed <= 0.0:  # a touch within round-off
            return None
        for _ in range(BACKWARD_STEPS):
            before, time = time, time - depth / speed
            if abs(time - before) <= 2.0 * EPSILON * abs(time):
                break
            now = self.after(state, time)
            depth, speed = overshoot + stop * time * time * now.curve, stop * time * now.slope
        return time if time >= -longest else None

    def time_at_rest(self, state: Floats, velocity: float, longest: float) -> float | None:
        """Return when mass 1, leaving the stop at a velocity, would have been at rest; None if not within `longest`.

        Parameters and the result are as in `time_at_stop`; the velocity is the exact one of mass 1.
        """
        stop, time = self.point.stop, 0.0
        for _ in range(BACKWARD_STEPS):
            now = self.after(state, time)
            leaving, slowing = -stop * (velocity + time * now.slope), -stop * now.acceleration
            here = state + now.gained
            if leaving <= 0.0 or self._newton_converges(JERK, here, leaving, slowing):
                break
            time -= self._step(JERK, here, leaving, slowing)
            if time < -longest:
                return None
        else:
            return None
        if slowing <= 0.0:
            return None
        for _ in range(BACKWARD_STEPS):
            before, time = time, time - leaving / slowing
            if abs(time - before) <= 2.0 * EPSILON * abs(time):
                break
            now = self.after(state, time)
            leaving, slowing = -stop * (velocity + time * now.slope), -stop * now.acceleration
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
