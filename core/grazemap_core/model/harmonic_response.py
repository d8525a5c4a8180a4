"""The steady motion without impacts: the response of a structure to its harmonic forces, as complex amplitudes.

The linear system is solved directly, not by modes, so the damping need not be diagonal in them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.model.chain import Chain
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.structure import Response
from grazemap_core.model.tolerances import RESONANCE_ROUNDING
from grazemap_core.tolerances import EPSILON

FREQUENCIES_AT_ONCE = 2**16
"""Maximum number of frequencies at which the response is computed together, to limit memory."""


def require_forced(oscillator: Oscillator) -> None:
    """Raise ParameterError if no force acts: the steady motion of the contact then never reaches a stop."""
    if not oscillator.drive:
        raise ParameterError("forcing", "is zero on every mass, so no motion ever grazes")


def require_damped(oscillator: Oscillator) -> None:
    """Check that every mode is damped.

    A chain whose links are all damped has no undamped mode. Without damping all modes are undamped. Otherwise the modal
    model decides.

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


def contact_response(oscillator: Oscillator, omega: ArrayLike) -> Complexes:
    """Return the complex amplitudes of the contact coordinate in the steady motion, in H harmonics; shape (n, H).

    ``q = sum_k Im(amplitude_k e^{i order_k omega t})`` about the equilibrium. Each amplitude has an error of about one
    rounding.

    Raises
    ------
    ParameterError
        A frequency is out of its range.
    SteadyMotionError
        A mode is undamped, or its damping is too small to resolve its resonance at one of these frequencies.
    """
    values = checked_omega(omega)
    require_damped(oscillator)
    amplitudes = np.empty((len(values), len(oscillator.drive)), dtype=np.complex128)
    for h, harmonic in enumerate(oscillator.drive):
        # in pieces, because the amplitudes of all masses take memory
        for first in range(0, len(values), FREQUENCIES_AT_ONCE):
            some = values[first : first + FREQUENCIES_AT_ONCE]
            response = oscillator.structure.response(
                harmonic.order * some, harmonic.amplitudes(some), oscillator.contact
            )
            _require_steady(bool(np.all(response.exists)))
            amplitudes[first : first + FREQUENCIES_AT_ONCE, h] = response.coordinate
    return amplitudes


def contact_response_and_slope(oscillator: Oscillator, omega: Floats) -> tuple[Complexes, Complexes]:
    """Return `contact_response` of a forced oscillator, and its derivative with respect to omega; (n, H) each.

    Neither `omega` nor the damping is checked.

    Raises
    ------
    SteadyMotionError
        A mode has too little damping to resolve its resonance at one of these frequencies.
    """
    responses = [response_and_slope(oscillator, omega, harmonic) for harmonic in oscillator.drive]
    _require_steady(all(np.all(exists & np.isfinite(slope)) for _, slope, exists in responses))
    return np.stack([value for value, _, _ in responses], axis=1), np.stack(
        [slope for _, slope, _ in responses], axis=1
    )


def response_and_slope(
    oscillator: Oscillator, omega: Floats, harmonic: Harmonic
) -> tuple[Complexes, Complexes, Booleans]:
    """Return the amplitudes of q in one harmonic, their derivatives, and where the amplitudes exist; (n,) each.

    Each derivative takes a second solution with the same matrix (theory, "Any linear structure"). It is NaN where that
    solution does not exist.
    """
    steady = oscillator.structure.response(harmonic.order * omega, harmonic.amplitudes(omega), oscillator.contact)
    return steady.coordinate, response_slope(oscillator, omega, harmonic, steady.amplitudes), steady.exists


def response_slope(oscillator: Oscillator, omega: Floats, harmonic: Harmonic, amplitudes: Complexes) -> Complexes:
    """Return the derivatives (n,) of q in one harmonic, from the amplitudes (n, N) of the displacements.

    A derivative that does not exist is NaN.
    """
    structure, order = oscillator.structure, harmonic.order
    moved = 2.0 * order * order * omega[:, None] * (amplitudes @ structure.mass_matrix.T)
    moved = moved - 1j * order * (amplitudes @ structure.damping_matrix.T)
    slope = structure.response(order * omega, harmonic.slopes(omega) + moved, oscillator.contact)
    return np.where(slope.exists, slope.coordinate, np.nan)


def _require_steady(exists: bool) -> None:
    if not exists:
        raise SteadyMotionError("omega", "is at a resonance that is practically undamped, so there is no steady motion")


def harmonic_amplitudes(oscillator: Oscillator, omega: Floats, harmonic: Harmonic) -> Response:
    """Return the steady motion in one harmonic, ``(K - s^2 M + i s C)^{-1} f`` with s = order omega; damped or not.

    Raises
    ------
    SteadyMotionError
        One of the frequencies is at a resonance with no damping or too little.
    """
    forces = harmonic.amplitudes(omega)
    if not np.any(forces):
        return Response(forces, np.zeros(len(omega), dtype=np.complex128), np.ones(len(omega), dtype=np.bool_))
    response = oscillator.structure.response(harmonic.order * omega, forces, oscillator.contact)
    _require_steady(bool(np.all(response.exists)))
    return response


def hidden_by_rounding(amplitude: float | Floats, clearance: Floats) -> Booleans:
    """Return where the round-off of a reference motion, of this amplitude in q, is too large for the clearance."""
    return EPSILON * amplitude > RESONANCE_ROUNDING * clearance
