"""Grazes of one stop, with the other one at another distance, or absent (theory, "Any linear structure").

The steady motion touches the right stop where its clearance is ``A + q_e``, the left one where it is ``A - q_e``. The
motion exists while the amplitude A is less than both gaps; where the other gap is smaller the graze is virtual. After a
graze impacts recur on the same stop, after whole periods: where one gap is larger than the other, the half periods of
equal stops have no meaning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eig

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.checks import checked_omega, checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.recurrence import first_recurrence
from grazemap_core.grazing.tolerances import DOUBLE_GRAZE_STEPS, REAL_EIGENVALUE
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import contact_response, require_forced
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.summary import harmonic_response
from grazemap_core.tolerances import EPSILON


@dataclass(frozen=True)
class VariedStop:
    """The stop whose clearance varies, +1 or -1, and where the other one is.

    Attributes
    ----------
    stop : {+1, -1}
    other : float or None
        The fixed clearance of the other stop; None: it is absent.
    together : bool
        Whether the other stop has the clearance of this one.
    """

    stop: int
    other: float | None = None
    together: bool = False

    def margin(self, oscillator: Oscillator, amplitude: Floats) -> Floats:
        """Return the gap of the other stop minus the amplitude where this one is grazed; infinite if it is absent.

        Raises ParameterError as `other_gap`.
        """
        if self.together:
            return np.full(len(amplitude), 2.0 * self.stop * contact_equilibrium(oscillator))
        return self.other_gap(oscillator) - amplitude

    def other_gap(self, oscillator: Oscillator) -> float:
        """Return the gap of the other stop from the equilibrium, if it is fixed; infinite if it is not.

        Raises
        ------
        ParameterError
            It is not greater than 0: the equilibrium is beyond that stop, so there is no motion without contact.
        """
        if self.other is None:
            return math.inf
        gap = self.other + self.stop * contact_equilibrium(oscillator)
        if not gap > 0.0:
            raise ParameterError("clearance", "of the fixed stop leaves the equilibrium beyond it: nothing grazes")
        return gap


@dataclass(frozen=True, eq=False)
class StopGrazes:
    """The grazes of one stop at n frequencies.

    Attributes
    ----------
    clearance : ndarray of shape (n,)
        Of this stop, at which the steady motion touches it.
    phase : ndarray of shape (n,)
        Of the forcing at the contact, in (-pi, pi].
    margin : ndarray of shape (n,)
        Gap of the other stop minus the amplitude; infinite if it is absent. The graze is virtual where it is negative.
    first_recurrence : ndarray of int, shape (n,)
        Number of half periods, even, after which an impact on this stop first recurs; 0: none up to max_order.
    """

    clearance: Floats
    phase: Floats
    margin: Floats
    first_recurrence: Integers

    @property
    def virtual(self) -> Booleans:
        """Whether the steady motion meets the other stop before it touches this one."""
        return np.asarray(self.margin < 0.0)


def stop_grazes(oscillator: Oscillator, omega: ArrayLike, varied: VariedStop, max_order: int = 8) -> StopGrazes:
    """Return the grazes of one stop.

    Parameters
    ----------
    oscillator : Oscillator
        Forced in the first harmonic, every mode damped.
    omega : array_like of shape (n,)
        Forcing frequencies > 0.
    varied : VariedStop
    max_order : int
        Largest number of half periods after which a recurring impact is looked for, >= 1.

    Raises
    ------
    ParameterError, SteadyMotionError, ConditioningError
        As `grazing_curve`; the equilibrium is beyond the other stop.
    """
    require_forced(oscillator)
    checked_order("max_order", max_order, 1)
    values = checked_omega(omega)
    response = contact_response(oscillator, values)
    amplitude = np.abs(response)
    # q = q_e + stop A where the argument of the response is stop pi/2
    phase = varied.stop * 0.5 * np.pi - np.angle(response)
    phase = np.where(phase > np.pi, phase - 2.0 * np.pi, np.where(phase <= -np.pi, phase + 2.0 * np.pi, phase))
    impulse = impulse_response(modal_model(oscillator))
    periods = first_recurrence(impulse.blocks, impulse.conditioning, 2.0 * np.pi / values, max_order // 2, True)
    return StopGrazes(
        clearance=amplitude + varied.stop * contact_equilibrium(oscillator),
        phase=phase,
        margin=varied.margin(oscillator, amplitude),
        first_recurrence=2 * periods,
    )


def double_grazes(oscillator: Oscillator, gap: float, start: float, stop: float) -> list[float]:
    """Return every frequency in [start, stop] at which the amplitude of the steady motion is `gap`, increasing.

    ``|h^T Z(w)^{-1} f(w)|^2 = gap^2`` holds where a quadratic matrix polynomial of size 2N + 1 is singular: with
    ``Z y = f a``, ``Z^H z = h (h^T y)`` the condition is ``f^H z = gap^2 a``. Its real eigenvalues are polished with
    the response itself. Frequencies at which the amplitude only touches the gap may be found twice or not at all.
    """
    structure, contact = oscillator.structure, oscillator.contact
    drive, count = oscillator.drive[0], oscillator.size
    size = 2 * count + 1
    # units in which gap, forces and frequencies are of order 1
    scale = math.sqrt(start * stop)
    mass, damping, stiffness = structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix
    parts = [np.zeros((size, size), dtype=np.complex128) for _ in range(3)]
    dynamic = [stiffness, (1j * scale * damping).astype(np.complex128), -mass * scale**2]
    forces = [drive.constant, 1j * drive.rate * scale, drive.quadratic * scale**2]
    weight = max(float(np.max(np.abs(force))) for force in forces)
    stiff = max(float(np.max(np.abs(part))) for part in dynamic)
    for power in range(3):
        part = parts[power]
        part[:count, :count] = dynamic[power] / stiff
        part[count:-1, count:-1] = np.conj(dynamic[power]).T / stiff
        part[:count, -1] = -forces[power] / weight
        part[-1, count:-1] = np.conj(forces[power]) / weight
    parts[0][count:-1, :count] = -np.outer(contact, contact) / (contact @ contact)
    parts[0][-1, -1] = -((gap * stiff / weight) ** 2) / (contact @ contact)
    nothing, identity = np.zeros((size, size)), np.eye(size)
    left = np.block([[nothing, identity], [-parts[0], -parts[1]]])
    right = np.block([[identity, nothing], [nothing, parts[2]]])
    values = eig(left, right, right=False)
    real = values[np.isfinite(values) & (np.abs(values.imag) <= REAL_EIGENVALUE * np.abs(values))].real * scale
    found = [_polished(oscillator, gap, w) for w in real[(real > 0.5 * start) & (real < 2.0 * stop)].tolist()]
    inside = sorted(w for w in found if w is not None and start <= w <= stop)
    return [w for i, w in enumerate(inside) if i == 0 or w > inside[i - 1] * (1.0 + 1e3 * EPSILON)]


def _polished(oscillator: Oscillator, gap: float, omega: float) -> float | None:
    """Return the frequency near omega at which the amplitude is the gap, by Newton's method; None if it is lost."""
    for _ in range(DOUBLE_GRAZE_STEPS):
        steady = harmonic_response(oscillator, np.array([omega]))
        amplitude, rate = float(steady.amplitude[0]), float(steady.amplitude_slope[0])
        if rate == 0.0 or not math.isfinite(rate):
            return None
        step = (gap - amplitude) / rate
        omega += step
        if not omega > 0.0:
            return None
        if abs(step) <= 4.0 * EPSILON * omega:
            return omega
    return None
