"""The steady motion without impacts: the response of the chain to its harmonic forcing, as complex amplitudes.

The linear system is solved without modes, in the same way for both kinds of damping.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.model.chain import Chain
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import RESONANCE_ROUNDING
from grazemap_core.tolerances import EPSILON


def require_forced(oscillator: Oscillator) -> None:
    """Raise ParameterError if nothing is forced: the contact coordinate then never reaches a stop."""
    if not oscillator.drive:
        raise ParameterError("forcing", "is zero on every mass, so no motion ever grazes")


def require_damped(oscillator: Oscillator) -> None:
    """Raise SteadyMotionError if a mode is undamped.

    A mode is undamped if no damped link stretches in it. If some links are damped and others are not, the modal model
    decides.

    Raises
    ------
    SteadyMotionError
        A mode is undamped: motions without impacts do not settle to one steady motion.
    """
    structure = oscillator.structure
    damped = structure.link_damping > 0.0 if isinstance(structure, Chain) else np.any(structure.damping_matrix)
    if isinstance(structure, Chain) and np.all(damped):
        return
    if not np.any(damped) or np.any(modal_model(oscillator).undamped):
        raise SteadyMotionError(
            "damping", "leaves a mode undamped, so motions without impacts do not settle to one steady motion"
        )


def steady_response(oscillator: Oscillator, omega: ArrayLike) -> Complexes:
    """Return the amplitudes of the steady motion, to which every motion without impacts settles.

    As `forced_response`, for an oscillator whose modes are all damped.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    SteadyMotionError
        A mode is undamped, or its damping is too small to resolve its resonance at one of these frequencies.
    """
    values = checked_omega(omega)
    require_damped(oscillator)
    return forced_response(oscillator, values)


def contact_response(oscillator: Oscillator, omega: ArrayLike) -> Complexes:
    """Return the complex amplitudes of the contact coordinate in the steady motion, shape (n,).

    ``q = Im(amplitude e^{i omega t})`` about the equilibrium; each has an error of about one rounding.

    Raises
    ------
    ParameterError
        A frequency is out of its range, or the forces have other harmonics than the first.
    SteadyMotionError
        A mode is undamped, or its damping is too small to resolve its resonance at one of these frequencies.
    """
    values = checked_omega(omega)
    require_damped(oscillator)
    if [one.order for one in oscillator.drive] != [1]:
        raise ParameterError("forcing", "has other harmonics than the first, which grazing curves do not cover yet")
    response = oscillator.structure.response(values, oscillator.drive[0].amplitudes(values), oscillator.contact)
    if not np.all(response.exists):
        raise SteadyMotionError("omega", "is at a resonance that is practically undamped, so there is no steady motion")
    return response.coordinate


def forced_response(oscillator: Oscillator, omega: ArrayLike) -> Complexes:
    """Return ``(K - omega^2 M + i omega C)^{-1} f``, the amplitudes in ``x(t) = Im(amplitude e^{i (omega t + tau)})``.

    Parameters
    ----------
    oscillator : Oscillator
        Damped or not.
    omega : array_like of shape (n,)
        Forcing frequencies > 0 (rad/s in SI).

    Returns
    -------
    ndarray of complex, shape (n, N)
        Amplitude and phase of every mass; the error of mass 1 is a unit in the last place of its modulus.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    SteadyMotionError
        One of these frequencies is at a resonance with no damping or too little.
    """
    values = checked_omega(omega)
    if not np.any(oscillator.forcing):
        return np.zeros((len(values), oscillator.size), dtype=np.complex128)
    forces = np.broadcast_to(oscillator.forcing.astype(np.complex128), (len(values), oscillator.size)).copy()
    response = oscillator.structure.response(values, forces, oscillator.contact)
    if not np.all(response.exists):
        raise SteadyMotionError("omega", "is at a resonance that is practically undamped, so there is no steady motion")
    return response.amplitudes


def held_response(chain: Chain, forcing: Floats, omega: ArrayLike) -> tuple[Complexes, Booleans]:
    """Return the steady amplitudes of a chain linked to a wall at rest, and where they exist.

    Parameters
    ----------
    chain : Chain
        Its first mass is linked to a wall.
    forcing : ndarray of shape (n,)
        Amplitudes of the forces on its masses.
    omega : array_like of shape (m,)

    Returns
    -------
    amplitudes : ndarray of complex, shape (m, n)
    exists : ndarray of bool, shape (m,)
        False at a resonance with no damping or too little.
    """
    values = checked_omega(omega)
    if not np.any(forcing):
        return np.zeros((len(values), chain.size), dtype=np.complex128), np.ones(len(values), dtype=np.bool_)
    forces = np.broadcast_to(forcing.astype(np.complex128), (len(values), chain.size)).copy()
    first = np.zeros(chain.size)
    first[0] = 1.0
    response = chain.response(values, forces, first)
    return response.amplitudes, response.exists


def hidden_by_rounding(amplitude: float, clearance: Floats) -> Booleans:
    """Return where round-off of the reference motion of mass 1, of this amplitude, is too large against a clearance."""
    return EPSILON * amplitude > RESONANCE_ROUNDING * clearance
