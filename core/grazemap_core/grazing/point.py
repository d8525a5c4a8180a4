"""A grazing point of the steady motion, and deviations from it.

The point is the paper's state vector (20), with the vector field there and the two coefficients of the discontinuity
mapping (27), for any structure and contact coordinate ``q = h^T x`` (theory, "The discontinuity mapping").

States near the point are represented by their *deviations* from it, because differences of states would lose digits: an
overshoot of 1e-12 of the clearance has four digits in a displacement, and all of them in a deviation.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import field, replace

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import ParameterError, checked_omega
from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop, steady_motion, wrapped
from grazemap_core.grazing.tolerances import SURFACE_ROUNDING
from grazemap_core.model.equilibrium import contact_equilibrium, equilibrium
from grazemap_core.model.harmonic_response import harmonic_amplitudes, require_damped, require_forced
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class GrazingPoint:
    """The steady motion where it touches a stop; states are ordered (x_1, v_1, ..., x_N, v_N, theta), equation (20)."""

    oscillator: Oscillator
    """The oscillator."""
    omega: float
    """Forcing frequency."""
    varied: VariedStop
    """The stop that is grazed here, and where the other one is."""
    amplitude: float
    """Largest displacement of q from its equilibrium toward the stop, A(omega)."""
    margin: float
    """Gap of the other stop minus the amplitude toward it; infinite if there is none, or if both are grazed at once."""
    clearance: float
    """Clearance of the stop, on the grazing curve."""
    state: Floats
    """(2N + 1,) x*; theta in (-pi/p, pi/p] is the phase of the forcing, omega t."""
    vector_field: Floats
    """(2N + 1,) f(x*), its last entry omega, equation (20)."""
    acceleration: float
    """a*, that of q, always away from the stop; ``-stop omega^2 amplitude`` with one harmonic."""
    beta: Floats
    """(2N + 1,) Coefficient of ``u = sqrt(2 overshoot/|a*|)`` in the discontinuity mapping, equation (27)."""
    gamma: Floats
    """(2N + 1,) Coefficient of ``u^2`` in it, for deviations of the order of ``u^2``."""
    model: ModalModel = field(repr=False)
    """The modal model of the free motion."""
    orders: Floats = field(repr=False)
    """(H,) Orders k of the harmonics."""
    steady: Complexes = field(repr=False)
    """(H, N) Displacements of the steady motion are the sum of ``Im(steady_k e^{i k phi})`` where theta is phi ahead of
    the point."""
    contact_steady: Complexes = field(repr=False)
    """(H,) The same for q."""

    @property
    def stop(self) -> int:
        """+1 (right) or -1 (left)."""
        return self.varied.stop

    @property
    def turn(self) -> float:
        """By how much theta advances from a return to the next one: half a period of the forces, or a whole one."""
        return self.varied.turn / self.oscillator.common_divisor

    @property
    def return_time(self) -> float:
        """The time of a return."""
        return self.turn / self.omega

    @property
    def half_period(self) -> float:
        """Half a period of the forces."""
        return math.pi / self.oscillator.common_divisor / self.omega

    @property
    def quarter_turn(self) -> float:
        """Advance of theta in a quarter of a period of the forces."""
        return 0.5 * math.pi / self.oscillator.common_divisor

    def next(self) -> GrazingPoint:
        """Return the point after a return: that of the other stop, the mirror image S x, or this one."""
        if not self.varied.alike:
            return self
        divisor = self.oscillator.common_divisor
        theta = float(wrapped(divisor * (float(self.state[-1]) + self.turn))) / divisor
        return _point(
            self.oscillator,
            self.omega,
            self.model,
            replace(self.varied, stop=-self.stop),
            theta,
            self.amplitude,
            self.margin,
            -self.steady,
            -self.contact_steady,
        )

    def clearances(self, depth: float) -> Clearance:
        """Return the clearance of both stops, or of each, where this one is `depth` below the graze."""
        here = self.clearance - depth
        if self.varied.together:
            return here
        return (here, self.varied.other) if self.stop > 0 else (self.varied.other, here)

    def size(self, deviation: Floats) -> float:
        """Return the largest entry of a deviation in units of amplitude, p omega amplitude, and radians of p theta."""
        divisor = self.oscillator.common_divisor
        pair = [1.0 / self.amplitude, 1.0 / (divisor * self.omega * self.amplitude)]
        return float(np.max(np.abs(deviation) * np.array([*(pair * self.oscillator.size), divisor])))

    def contact_of(self, deviation: Floats) -> tuple[float, float]:
        """Return q and its velocity in a deviation."""
        row = self.oscillator.contact
        return math.fsum(row * deviation[:-1:2]), math.fsum(row * deviation[1::2])

    def with_contact(self, deviation: Floats, place: float, velocity: float) -> Floats:
        """Return a deviation moved so that q and its velocity have these values, as `Oscillator.with_contact`."""
        moved = self.oscillator.with_contact
        return interleaved(moved(deviation[:-1:2], place), moved(deviation[1::2], velocity), float(deviation[-1]))

    def steady_change(self, turn: float, phase: float = 0.0) -> Floats:
        """Return the change of the steady motion, shape (2N + 1,), as theta advances by `turn` from `phase`.

        `phase` is relative to the point. Small changes keep their relative accuracy.
        """
        displacement, velocity = np.zeros((2, self.oscillator.size))
        for order, steady in zip(self.orders.tolist(), self.steady, strict=True):
            factor = complex(-2.0 * math.sin(0.5 * order * turn) ** 2, math.sin(order * turn))  # e^{i k turn} - 1
            change = steady * cmath.exp(1j * order * phase) * factor
            displacement, velocity = displacement + change.imag, velocity + order * self.omega * change.real
        return interleaved(displacement, velocity, turn)

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


def grazing_point(oscillator: Oscillator, omega: float, varied: VariedStop = ALIKE) -> GrazingPoint:
    """Return the point at which the steady motion of forcing frequency omega grazes a stop, at its highest maximum.

    Raises
    ------
    ParameterError
        Nothing is forced, a number is out of range, the motion passes the other stop before it touches this one, or the
        stops are to be alike and there is a bias or the forces have even and odd harmonics.
    SteadyMotionError
        A mode is undamped, or a resonance is practically undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    stop = varied.stop
    if stop not in (1, -1):
        raise ParameterError("stop", "must be +1 (right stop) or -1 (left stop)")
    require_forced(oscillator)
    require_damped(oscillator)
    varied.require(oscillator)
    if varied.alike and contact_equilibrium(oscillator) != 0.0:
        raise ParameterError("bias", "moves the equilibrium from the middle, so that the stops are grazed one by one")
    reduced, divisor = oscillator.at_own_period
    values = checked_omega([divisor * omega])
    motion = steady_motion(reduced, values)
    # that of the left stop half a period after that of the right one, where both are grazed at once
    maxima, later = motion.toward(1 if varied.alike else stop), math.pi if varied.alike and stop < 0 else 0.0
    amplitude, phase = float(maxima.amplitude[0]), float(maxima.phase[0])
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        raise ParameterError("omega", "is a frequency at which the amplitude overflows or underflows")
    margin = float(varied.margins(oscillator, motion, maxima.amplitude)[0])
    if margin < 0.0:
        raise ParameterError("clearance", "lets the steady motion pass the other stop before it touches this one")
    theta, phase = float(wrapped(phase + later)) / divisor, phase + later
    steady = np.concatenate([harmonic_amplitudes(reduced, values, harmonic) for harmonic in reduced.drive])
    if len(steady) == 1:  # exactly on the stop; the phases of the displacements are relative to that of q
        contact = np.array([1j * stop * amplitude])
        steady = contact[:, None] * (steady[:, :-1] / steady[0, -1])
    else:
        turns = np.exp(1j * phase * motion.orders)
        contact = motion.response[0] * turns
        steady = steady[:, :-1] * turns[:, None]
    steady = np.array(
        [
            oscillator.with_contact(row.real, value.real) + 1j * oscillator.with_contact(row.imag, value.imag)
            for row, value in zip(steady, contact.tolist(), strict=True)
        ]
    )
    return _point(oscillator, float(omega), modal_model(oscillator), varied, theta, amplitude, margin, steady, contact)


def checked_deviation(point: GrazingPoint, deviation: ArrayLike, on_surface: bool = True) -> Floats:
    """Return a deviation as an array of shape (2N + 1,).

    Raises
    ------
    ParameterError
        The deviation has another shape, is not finite, or does not lie on the Poincare surface, where the velocity of q
        is 0.
    """
    values = np.array(deviation, dtype=np.float64)
    if values.shape != point.state.shape or not np.all(np.isfinite(values)):
        raise ParameterError("deviation", "must be a list of finite numbers x_1, v_1, ..., x_N, v_N, theta")
    terms = point.oscillator.contact * values[1::2]
    rounding = (
        SURFACE_ROUNDING * float(np.sum(np.abs(terms))) if np.count_nonzero(point.oscillator.contact) > 1 else 0.0
    )
    if on_surface and abs(math.fsum(terms)) > rounding:
        raise ParameterError("deviation", "must lie on the Poincare surface: the velocity of the contact must be 0")
    return values


def interleaved(displacement: Floats, velocity: Floats, theta: float) -> Floats:
    """Return (x_1, v_1, ..., x_N, v_N, theta)."""
    return np.append(np.stack([displacement, velocity], axis=1).ravel(), theta)


def _point(
    oscillator: Oscillator,
    omega: float,
    model: ModalModel,
    varied: VariedStop,
    theta: float,
    amplitude: float,
    margin: float,
    steady: Complexes,
    contact: Complexes,
) -> GrazingPoint:
    """Return the point at which the steady motion touches a stop, at the phase `theta`; the rest as in the record."""
    orders = np.array([harmonic.order for harmonic in oscillator.drive], dtype=np.float64)
    stop, place = varied.stop, contact_equilibrium(oscillator)
    clearance = amplitude + stop * place
    rates = orders[:, None] * omega
    displacement, velocity = np.sum(steady.imag, axis=0), np.sum(rates * steady.real, axis=0)
    velocity = oscillator.with_contact(velocity, 0.0)
    of_contact = float(np.sum(-((orders * omega) ** 2) * contact.imag))
    acceleration = oscillator.with_contact(np.sum(-(rates**2) * steady.imag, axis=0), of_contact)
    jerk = -np.sum(rates**2 * (rates * steady.real), axis=0)
    if place != 0.0:
        displacement = oscillator.with_contact(equilibrium(oscillator) + displacement, stop * clearance)
    beta, gamma = _mapping_coefficients(oscillator, stop, omega, np.stack([velocity, acceleration, jerk]))
    return GrazingPoint(
        oscillator,
        omega,
        varied,
        amplitude,
        margin,
        clearance,
        interleaved(displacement, velocity, theta),
        interleaved(velocity, acceleration, omega),
        of_contact,
        beta,
        gamma,
        model,
        orders,
        steady,
        contact,
    )


def _mapping_coefficients(oscillator: Oscillator, stop: int, omega: float, motion: Floats) -> tuple[Floats, Floats]:
    """Return beta and gamma (docs/theory.md, "The discontinuity mapping"); `motion` (3, N): the derivatives of x*."""
    velocity, acceleration, jerk = motion
    restitution, jump, row = oscillator.restitution_of(stop), oscillator.jump, oscillator.contact
    rebound, slowing, change = 1.0 + restitution, float(row @ acceleration), float(row @ jerk)
    pushed = oscillator.with_contact(-rebound * (acceleration - slowing * jump), 0.0)
    beta = interleaved(-rebound * velocity, pushed, -rebound * omega)
    coupling = oscillator.structure.solve_mass(oscillator.damping_matrix @ jump)
    late = stop * change / abs(slowing) * (1.0 / 6.0 + 2.0 / 3.0 * restitution + 0.5 * restitution**2)
    late = late - restitution * rebound * float(row @ coupling)
    x = late * velocity + 0.5 * rebound**2 * acceleration - restitution * rebound * slowing * jump
    v = late * acceleration + 0.5 * rebound**2 * jerk - rebound * change / 3.0 * jump
    v = v + restitution * rebound * slowing * coupling
    x = oscillator.with_contact(x, 0.5 * (1.0 - restitution) * rebound * slowing)
    return beta, interleaved(x, oscillator.with_contact(v, 0.0), late * omega)
