"""A grazing point of the steady motion, and deviations from it.

The point is the paper's state vector (20), with the vector field there and the two coefficients of the discontinuity
mapping (27).

States near the point are represented by their *deviations* from it, because differences of states would lose digits: an
overshoot of 1e-12 of the clearance has four digits in a displacement, and all of them in a deviation.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.curve import grazing_curve
from grazemap_core.model.harmonic_response import steady_response
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator


@dataclass(frozen=True, eq=False)
class GrazingPoint:
    """The steady motion where it touches a stop; states are ordered (x_1, v_1, ..., x_N, v_N, theta), equation (20).

    Attributes
    ----------
    oscillator : Oscillator
    omega : float
    stop : {+1, -1}
        A or C.
    clearance : float
        The steady amplitude A(omega), on the grazing curve.
    state : ndarray of shape (2N + 1,)
        x*; theta in (-pi, pi] is the phase of the forcing, f sin(theta).
    vector_field : ndarray of shape (2N + 1,)
        f(x*), its last entry omega, equation (20).
    acceleration : float
        a_1*, the acceleration of mass 1: ``-stop omega^2 clearance``, always away from the stop.
    beta : ndarray of shape (2N + 1,)
        Coefficient of ``u = sqrt(2 overshoot/|a_1*|)`` in the discontinuity mapping, equation (27).
    gamma : ndarray of shape (2N + 1,)
        Coefficient of ``u^2`` in it, for deviations of the order of ``u^2``.
    model : ModalModel
        The modal model of the free motion.
    steady : ndarray of complex, shape (N,)
        Displacements of the steady motion are ``Im(steady e^{i phi})`` where theta is phi ahead of the point.
    """

    oscillator: Oscillator
    omega: float
    stop: int
    clearance: float
    state: Floats
    vector_field: Floats
    acceleration: float
    beta: Floats
    gamma: Floats
    model: ModalModel = field(repr=False)
    steady: Complexes = field(repr=False)

    @property
    def half_period(self) -> float:
        """Half a forcing period: the time to the other stop's point."""
        return math.pi / self.omega

    def opposite(self) -> GrazingPoint:
        """Return the point at the other stop, half a period later: the mirror image S x."""
        return _point(self.oscillator, self.omega, -self.stop, _wrapped(self.state[-1] + math.pi), self.model, self)

    def size(self, deviation: Floats) -> float:
        """Return the largest entry of a deviation in units of clearance, omega clearance and radians."""
        pair = [1.0 / self.clearance, 1.0 / (self.omega * self.clearance)]
        return float(np.max(np.abs(deviation) * np.array([*(pair * self.oscillator.size), 1.0])))

    def steady_change(self, turn: float, phase: float = 0.0) -> Floats:
        """Return the change of the steady motion, shape (2N + 1,), as theta advances by `turn` from `phase`.

        `phase` is relative to the point. Small changes keep their relative accuracy.
        """
        factor = complex(-2.0 * math.sin(0.5 * turn) ** 2, math.sin(turn))  # e^{i turn} - 1
        change = self.steady * cmath.exp(1j * phase) * factor
        return interleaved(change.imag, self.omega * change.real, turn)

    def free_part(self, deviation: Floats) -> Floats:
        """Return a deviation minus that of the steady motion at its phase, in block coordinates, shape (N, 2)."""
        rest = deviation - self.steady_change(float(deviation[-1]))
        return np.asarray(self.model.to_modal @ rest[self.masses_first]).reshape(-1, 2)

    def deviation(self, free: Floats, phase: float) -> Floats:
        """Return the deviation, shape (2N + 1,), of the state with this free part and with theta `phase` ahead."""
        count = self.oscillator.size
        physical = np.asarray(self.model.from_modal @ free.ravel())
        return interleaved(physical[:count], physical[count:], 0.0) + self.steady_change(phase)

    @property
    def masses_first(self) -> Integers:
        """Indices in a state of x_1 .. x_N, then of v_1 .. v_N."""
        count = self.oscillator.size
        return np.concatenate([np.arange(count) * 2, np.arange(count) * 2 + 1])


def grazing_point(oscillator: Oscillator, omega: float, stop: int = 1) -> GrazingPoint:
    """Return the point at which the steady motion of forcing frequency omega grazes stop A (+1) or C (-1).

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    if stop not in (1, -1):
        raise ParameterError("stop", "must be +1 (stop A) or -1 (stop C)")
    curve = grazing_curve(oscillator, [omega], max_order=1)
    theta = float(curve.phase[0])
    return _point(oscillator, float(omega), stop, theta if stop == 1 else _wrapped(theta + math.pi))


def checked_deviation(point: GrazingPoint, deviation: ArrayLike, on_surface: bool = True) -> Floats:
    """Return a deviation as an array of shape (2N + 1,).

    Raises
    ------
    ParameterError
        It has another shape, is not finite, or does not lie on the Poincare surface ``v_1 = 0``.
    """
    values = np.array(deviation, dtype=np.float64)
    if values.shape != point.state.shape or not np.all(np.isfinite(values)):
        raise ParameterError("deviation", "must be a list of finite numbers x_1, v_1, ..., x_N, v_N, theta")
    if on_surface and values[1] != 0.0:
        raise ParameterError("deviation", "must lie on the Poincare surface: the velocity of mass 1 must be 0")
    return values


def interleaved(displacement: Floats, velocity: Floats, theta: float) -> Floats:
    """Return (x_1, v_1, ..., x_N, v_N, theta)."""
    return np.append(np.stack([displacement, velocity], axis=1).ravel(), theta)


def _point(
    oscillator: Oscillator,
    omega: float,
    stop: int,
    theta: float,
    model: ModalModel | None = None,
    mirror: GrazingPoint | None = None,
) -> GrazingPoint:
    if mirror is None:
        response = steady_response(oscillator, [omega])[0]
        clearance = float(abs(response[0]))
        # mass 1 is exactly on the stop; the phases of the other masses are relative to it
        steady = 1j * stop * clearance * (response / response[0])
        steady[0] = 1j * stop * clearance
    else:
        steady, clearance = -mirror.steady, mirror.clearance
    displacement, velocity = steady.imag, omega * steady.real
    velocity[0] = 0.0
    acceleration = -(omega**2) * displacement
    vector_field = interleaved(velocity, acceleration, omega)
    beta, gamma = _mapping_coefficients(oscillator, omega, velocity, acceleration)
    return GrazingPoint(
        oscillator,
        omega,
        stop,
        clearance,
        interleaved(displacement, velocity, theta),
        vector_field,
        float(acceleration[0]),
        beta,
        gamma,
        modal_model(oscillator) if model is None else model,
        steady,
    )


def _mapping_coefficients(
    oscillator: Oscillator, omega: float, velocity: Floats, acceleration: Floats
) -> tuple[Floats, Floats]:
    """Return beta and gamma (docs/theory.md, "The discontinuity mapping")."""
    restitution, mass = oscillator.restitution, oscillator.masses
    rebound = 1.0 + restitution
    beta = -rebound * interleaved(velocity, acceleration, omega)
    beta[1] = 0.0
    coupling = oscillator.damping_matrix[:, 0] / mass  # C_i1/m_i
    viscous_term = restitution * rebound * coupling[0]
    x = -viscous_term * velocity + 0.5 * rebound**2 * acceleration
    v = (
        -viscous_term * acceleration
        - 0.5 * (rebound * omega) ** 2 * velocity
        + restitution * rebound * acceleration[0] * coupling
    )
    x[0] = 0.5 * (1.0 - restitution) * rebound * acceleration[0]
    v[0] = 0.0
    return beta, interleaved(x, v, -viscous_term * omega)


def _wrapped(phase: float) -> float:
    return phase - 2.0 * math.pi if phase > math.pi else phase
