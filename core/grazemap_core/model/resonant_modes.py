"""Modes whose steady motion is too large for a state to be given as a difference from it.

The motion of a forced mode is its steady motion plus a transient. Near a resonance with little damping both are much
larger than the response that builds up within half a forcing period, and cancel. Such a mode is resonant: its
coordinates are used themselves, not their differences from the steady motion.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.model.harmonic_response import forced_response
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import RESONANT_GAIN


def resonant_modes(model: ModalModel, omega: float, limit: float = RESONANT_GAIN) -> Booleans:
    """Return which modes have a steady motion larger than `limit` times their response within half a period, (N,).

    A unit force on a mode of frequency w has a steady motion ``1/|w^2 - omega^2 + 2 i eta omega|``, and from rest a
    response of up to ``pi/(w omega)`` within half a forcing period. The first can exceed the second only if the mode is
    underdamped.
    """
    frequency = np.sqrt(model.frequency_squared)
    return np.asarray(frequency * omega > limit * np.pi * np.abs(_denominators(model, omega)))


def modal_forcing(oscillator: Oscillator, model: ModalModel) -> Floats:
    """Return the forcing of the equations of u and u' of every mode, (N, 2)."""
    size = model.size
    return np.ascontiguousarray((model.to_modal[:, size:] @ (oscillator.forcing / oscillator.masses)).reshape(size, 2))


def modal_steady(oscillator: Oscillator, model: ModalModel, omega: float) -> Complexes:
    """Return the steady amplitudes of u and u' of every mode, (N, 2); infinite or NaN at an undamped resonance."""
    first, second = modal_forcing(oscillator, model).T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.stack(
                [
                    (1j * omega + 2.0 * model.decay) * first + second,
                    1j * omega * second - model.frequency_squared * first,
                ],
                axis=1,
            )
            / _denominators(model, omega)[:, None]
        )


def reference_response(oscillator: Oscillator, model: ModalModel, omega: Floats) -> Complexes:
    """Return the amplitudes of the reference motion: the steady motion, without that of the resonant modes.

    Parameters
    ----------
    model : ModalModel
        That of the oscillator.
    omega : (m,)
        Forcing frequencies.

    Returns
    -------
    ndarray of complex, shape (m, 2, N)
        Amplitudes of the displacements, and of the velocities divided by i omega. Both are equal where no mode is
        resonant; then they are those of `forced_response`.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    """
    values = checked_omega(omega)
    resonant = np.array([resonant_modes(model, w) for w in values.tolist()]).reshape(len(values), model.size)
    resonant &= bool(np.any(oscillator.forcing))
    steady = np.empty((len(values), 2, model.size), dtype=np.complex128)
    plain = ~np.any(resonant, axis=1)
    if np.any(plain):
        steady[plain] = forced_response(oscillator, values[plain])[:, None]
    for i in np.flatnonzero(~plain):
        w = float(values[i])
        amplitudes = np.where(resonant[i][:, None], 0.0, modal_steady(oscillator, model, w))
        steady[i] = (model.from_modal @ amplitudes.ravel()).reshape(2, model.size)
        steady[i, 1] /= 1j * w
    return steady


def _denominators(model: ModalModel, omega: float) -> Complexes:
    frequency = np.sqrt(model.frequency_squared)
    return np.asarray((frequency - omega) * (frequency + omega) + 2j * model.decay * omega)
