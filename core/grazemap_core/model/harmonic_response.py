"""The steady motion without impacts: the chain's response to its harmonic forcing.

An oscillator and forcing frequencies flow in, complex amplitudes flow out. No modes are needed, so both kinds of
damping take one way; what has no steady motion is refused with a reason.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.model.chain import Chain
from grazemap_core.model.kernels.tridiagonal import RESONANT, steady_amplitudes
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import RESONANCE_ROUNDING
from grazemap_core.tolerances import EPSILON


def require_forced(oscillator: Oscillator) -> None:
    """Raise ParameterError when no mass is forced: mass 1 then never reaches a stop."""
    if not np.any(oscillator.forcing):
        raise ParameterError("forcing", "is zero on every mass, so no motion ever grazes")


def require_damped(oscillator: Oscillator) -> None:
    """Refuse a chain with an undamped mode.

    A mode is undamped when no damped link stretches in it. Without damping there is nothing to look for; with damping
    in every link neither; in between the modal model decides.

    Raises
    ------
    SteadyMotionError
        A mode is undamped: motions without impacts do not settle to one steady motion.
    """
    damped = oscillator.link_damping > 0.0
    if np.all(damped):
        return
    if not np.any(damped) or np.any(modal_model(oscillator).undamped):
        raise SteadyMotionError(
            "damping", "leaves a mode undamped, so motions without impacts have no one steady motion"
        )


def steady_response(oscillator: Oscillator, omega: ArrayLike) -> Complexes:
    """Return the amplitudes of the steady motion, which every motion without impacts settles to.

    As `forced_response`, of which it is the case with every mode damped.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    SteadyMotionError
        A mode is undamped, or so little that its resonance cannot be resolved at one of these frequencies.
    """
    values = checked_omega(omega)
    require_damped(oscillator)
    return forced_response(oscillator, values)


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
        Amplitude and phase of every mass; that of mass 1 is right to a unit in the last place of its modulus.

    Raises
    ------
    ParameterError
        A frequency is not a finite number greater than 0.
    SteadyMotionError
        One of these frequencies meets a resonance that is undamped, or practically so.
    """
    values = checked_omega(omega)
    if not np.any(oscillator.forcing):
        return np.zeros((len(values), oscillator.size), dtype=np.complex128)
    amplitudes, status = steady_amplitudes(
        oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing, values
    )
    if np.any(status == RESONANT):
        raise SteadyMotionError("omega", "meets a resonance that is practically undamped: there is no steady motion")
    return amplitudes


def held_response(chain: Chain, forcing: Floats, omega: ArrayLike) -> tuple[Complexes, Booleans]:
    """Return the same for a chain held to a wall that stands still at 0, and where it exists.

    Parameters
    ----------
    chain : Chain
        With a wall.
    forcing : ndarray of shape (n,)
        Amplitudes of the forces on its masses.
    omega : array_like of shape (m,)

    Returns
    -------
    amplitudes : ndarray of complex, shape (m, n)
    exists : ndarray of bool, shape (m,)
        False at a resonance that is undamped, or practically so.
    """
    values = checked_omega(omega)
    if not np.any(forcing):
        return np.zeros((len(values), chain.size), dtype=np.complex128), np.ones(len(values), dtype=np.bool_)
    amplitudes, status = steady_amplitudes(
        chain.masses,
        chain.stiffnesses,
        chain.link_damping,
        forcing,
        values,
        chain.wall_stiffness,
        chain.wall_damping,
    )
    return amplitudes, status != RESONANT


def hidden_by_rounding(steady: Complexes, clearance: Floats) -> Booleans:
    """Say where the round-off of the steady motion of mass 1, complex (m,), hides what happens between stops, (n,).

    Shape (n, m).
    """
    return EPSILON * np.abs(steady) > RESONANCE_ROUNDING * clearance[:, None]
