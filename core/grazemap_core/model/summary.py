"""What an engineer checks first: frequencies, damping, weights, steady response and impulse response of a structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError, checked_omega
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.harmonic_response import response_and_slope
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class HarmonicResponse:
    """The steady motion of the contact coordinate in one harmonic, ``q = amplitude sin(order omega t + phase)``.

    Arrays have the shape (n,), with NaN at a resonance.
    """

    order: int
    """Order of the harmonic."""
    amplitude: Floats
    """Amplitude of q."""
    phase: Floats
    """Phase of q."""
    amplitude_slope: Floats
    """d amplitude / d omega."""


@dataclass(frozen=True, eq=False)
class StructureSummary:
    """Linear properties of an oscillator (theory, "Any linear structure")."""

    effective_mass: float
    """``m_c = 1/(h^T M^-1 h)``."""
    kappa: float
    """``m_c h^T M^-1 C M^-1 h``, the rate at which damping alone would slow the contact coordinate after an impulse."""
    equilibrium: Floats
    """(N,) Displacements under the bias."""
    contact_equilibrium: float
    """The contact coordinate there, q_e."""
    natural_frequencies: Floats
    """(N,) Frequencies of the structure without damping, in increasing order; 0 for a free mode; NaN where follower
    forces make it flutter without damping."""
    damping_ratios: Floats
    """(N,) Damping ratios of the damped modes, by increasing frequency; NaN of a free mode, and where several modes do
    not oscillate and the damping is not diagonal in the modes, as their exponents form no pairs."""
    contact_weights: Floats | None
    """(N,) ``h^T phi_j`` of the mass-normalised modes without damping, not negative; None where K is not symmetric."""
    harmonics: tuple[HarmonicResponse, ...]
    """The steady motion, by increasing order."""
    impulse_response: Floats
    """(m,) g at the times: the contact coordinate after a unit jump of its velocity."""


def summary(oscillator: Oscillator, omega: ArrayLike, times: ArrayLike) -> StructureSummary:
    """Return the linear properties of an oscillator.

    Parameters
    ----------
    oscillator : Oscillator
    omega : array_like of shape (n,)
        Forcing frequencies > 0.
    times : array_like of shape (m,)
        Times >= 0.

    Raises
    ------
    ParameterError
        A frequency or a time is out of its range, or the bias has no equilibrium.
    ConditioningError
        Two modes are nearly defective together.
    """
    frequencies = checked_omega(omega)
    moments = np.ascontiguousarray(times, dtype=np.float64)
    if not np.all((moments >= 0.0) & np.isfinite(moments)):
        raise ParameterError("times", "every time must be 0 or greater")
    model = modal_model(oscillator)
    static = equilibrium(oscillator)
    momentum = oscillator.structure.solve_mass(oscillator.contact)
    natural, weights = _undamped(oscillator)
    return StructureSummary(
        effective_mass=oscillator.effective_mass,
        kappa=float(oscillator.effective_mass * (momentum @ oscillator.damping_matrix @ momentum)),
        equilibrium=static,
        contact_equilibrium=float(oscillator.contact @ static),
        natural_frequencies=natural,
        damping_ratios=_ratios(model),
        contact_weights=weights,
        harmonics=tuple(_harmonic_response(oscillator, frequencies, harmonic) for harmonic in oscillator.drive),
        impulse_response=np.where(moments > 0.0, evaluate(impulse_response(model), moments)[0], 0.0),
    )


def _undamped(oscillator: Oscillator) -> tuple[Floats, Floats | None]:
    """Return the natural frequencies, and the weights of the contact in the real modes, if there are any."""
    structure = oscillator.structure
    symmetric = not isinstance(structure, Matrices) or structure.has_symmetric_stiffness
    try:
        model = modal_model(replace(oscillator, structure=structure.undamped()))
    except ParameterError:  # the structure is stable, and the one without damping is not
        return np.full(oscillator.size, np.nan), None
    return np.sqrt(model.frequency_squared), np.abs(model.contact_row[:, 0]) if symmetric else None


def _ratios(model: ModalModel) -> Floats:
    frequency = np.sqrt(model.frequency_squared)
    ratio = np.full(model.size, np.nan)
    np.divide(model.decay, frequency, out=ratio, where=frequency > 0.0)
    overdamped = model.discriminant < 0.0
    if np.any(model.shape[:, :, 1]) and np.count_nonzero(overdamped) > 1:
        ratio[overdamped] = np.nan
    return ratio


def _harmonic_response(oscillator: Oscillator, omega: Floats, harmonic: Harmonic) -> HarmonicResponse:
    """Return amplitude, phase and slope of the contact coordinate in one harmonic (theory, "Any linear structure")."""
    value, change, exists = response_and_slope(oscillator, omega, harmonic)
    amplitude = np.where(exists, np.abs(value), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.where(exists, (np.conj(value) * change).real / amplitude, np.nan)
    return HarmonicResponse(harmonic.order, amplitude, np.where(amplitude > 0.0, np.angle(value), np.nan), rate)
