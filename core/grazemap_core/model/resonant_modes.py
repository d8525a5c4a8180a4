"""Modes whose steady motion is too large for a state to be given as a difference from it.

The motion of a forced mode is its steady motion plus a transient. Near a resonance with little damping both are much
larger than the response that builds up within half a forcing period, and cancel. Such a mode is resonant: its
coordinates are used themselves, not their differences from the steady motion.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.harmonic_response import harmonic_amplitudes
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import RESONANT_GAIN


def resonant_modes(model: ModalModel, omega: Floats, order: int = 1, limit: float = RESONANT_GAIN) -> Booleans:
    """Return which modes have a steady motion larger than `limit` times their response within half a period.

    A unit force of the harmonic s = order omega on a mode of frequency w has a steady motion
    ``1/|w^2 - s^2 + 2 i eta s|``, and from rest a response of up to ``pi/(w omega)`` within half a forcing period. The
    first can exceed the second only if the mode is underdamped. For frequencies (n,) the shape is (n, N).
    """
    at = omega[:, None]
    frequency = np.sqrt(model.frequency_squared)
    return np.asarray(frequency * at > limit * np.pi * np.abs(_denominators(model, order * at)))


def modal_forcing(oscillator: Oscillator, model: ModalModel, omega: float, harmonic: Harmonic) -> Complexes:
    """Return the amplitudes of a harmonic in the equations of u and u' of every mode, (N, 2)."""
    size = model.size
    force = harmonic.amplitudes(np.array([omega]))[0]
    parts = [model.to_modal[:, size:] @ oscillator.structure.solve_mass(part) for part in (force.real, force.imag)]
    return np.ascontiguousarray((parts[0] + 1j * parts[1]).reshape(size, 2))


def modal_steady(oscillator: Oscillator, model: ModalModel, omega: float, harmonic: Harmonic) -> Complexes:
    """Return the steady amplitudes of u and u' of every mode, (N, 2); infinite or NaN at an undamped resonance."""
    first, second = modal_forcing(oscillator, model, omega, harmonic).T
    s = harmonic.order * omega
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.stack(
                [
                    (1j * s + 2.0 * model.decay) * first + second,
                    1j * s * second - model.frequency_squared * first,
                ],
                axis=1,
            )
            / _denominators(model, s)[:, None]
        )


def reference_response(oscillator: Oscillator, model: ModalModel, omega: Floats) -> Complexes:
    """Return the amplitudes of the reference motion: the steady motion, without that of the resonant modes.

    Parameters
    ----------
    model : ModalModel
        The oscillator's modal model.
    omega : (m,)
        Forcing frequencies.

    Returns
    -------
    ndarray of complex, shape (m, H, 2, N + 1)
        For each harmonic of `Oscillator.forces` the amplitudes of the displacements and of the contact coordinate, and
        of the velocities divided by i order omega. Both are equal where no mode is resonant; then they are those of
        `harmonic_amplitudes`.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    """
    values = checked_omega(omega)
    steady = np.empty((len(values), len(oscillator.forces), 2, model.size + 1), dtype=np.complex128)
    for h, harmonic in enumerate(oscillator.forces):
        resonant = resonant_modes(model, values, harmonic.order) & bool(oscillator.drive)
        plain = ~np.any(resonant, axis=1)
        if np.any(plain):
            steady[plain, h] = _with_contact(oscillator, values[plain], harmonic)[:, None]
        for i in np.flatnonzero(~plain):
            w = float(values[i])
            amplitudes = np.where(resonant[i][:, None], 0.0, modal_steady(oscillator, model, w, harmonic))
            steady[i, h, :, :-1] = (model.from_modal @ amplitudes.ravel()).reshape(2, model.size)
            steady[i, h, 1] /= 1j * harmonic.order * w
            steady[i, h, :, -1] = np.sum(amplitudes * model.contact_row)
    return steady


def _with_contact(oscillator: Oscillator, omega: Floats, harmonic: Harmonic) -> Complexes:
    """Return the amplitudes of the displacements and of the contact coordinate, shape (m, N + 1)."""
    response = harmonic_amplitudes(oscillator, omega, harmonic)
    return np.concatenate([response.amplitudes, response.coordinate[:, None]], axis=1)


def _denominators(model: ModalModel, omega: Floats | float) -> Complexes:
    frequency = np.sqrt(model.frequency_squared)
    return np.asarray((frequency - omega) * (frequency + omega) + 2j * model.decay * omega)
