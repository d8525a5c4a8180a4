"""The steady motion without impacts: the response of a structure to its harmonic forces, as complex amplitudes.

The linear system is solved directly, not by modes, so the damping need not be diagonal in them.

The states of trajectories are differences from it, but for those of *resonant* modes. The motion of a forced mode is
its steady motion plus a transient. Near a resonance with little damping both are much larger than the response that
builds up within half a forcing period, and cancel. `reference_response` therefore leaves such modes out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.errors import ParameterError, SteadyMotionError, checked_omega
from grazemap_core.model.chain import Chain
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import BOUND_SAFETY, RESONANCE_ROUNDING, RESONANT_GAIN
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
            piece = slice(first, first + FREQUENCIES_AT_ONCE)
            amplitudes[piece, h] = harmonic_amplitudes(oscillator, values[piece], harmonic)[:, -1]
    return amplitudes


def harmonic_amplitudes(oscillator: Oscillator, omega: Floats, harmonic: Harmonic) -> Complexes:
    """Return the steady motion in one harmonic, ``(K - s^2 M + i s C)^{-1} f`` with s = order omega; damped or not.

    Returns
    -------
    ndarray of complex, shape (n, N + 1)
        Amplitudes of the displacements, then of the contact coordinate, at forcing frequencies (n,).

    Raises
    ------
    SteadyMotionError
        One of the frequencies is at a resonance with no damping or too little.
    """
    forces = harmonic.amplitudes(omega)
    if not np.any(forces):
        return np.zeros((len(omega), oscillator.size + 1), dtype=np.complex128)
    response = oscillator.structure.response(harmonic.order * omega, forces, oscillator.contact)
    _require_steady(bool(np.all(response.exists)))
    return np.column_stack([response.amplitudes, response.coordinate])


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


def hidden_by_rounding(amplitude: float | Floats, clearance: Floats) -> Booleans:
    """Return where the round-off of a reference motion, of this amplitude in q, is too large for the clearance."""
    return EPSILON * amplitude > RESONANCE_ROUNDING * clearance


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
            steady[plain, h] = harmonic_amplitudes(oscillator, values[plain], harmonic)[:, None]
        for i in np.flatnonzero(~plain):
            w = float(values[i])
            amplitudes = np.where(resonant[i][:, None], 0.0, modal_steady(oscillator, model, w, harmonic))
            steady[i, h, :, :-1] = (model.from_modal @ amplitudes.ravel()).reshape(2, model.size)
            steady[i, h, 1] /= 1j * harmonic.order * w
            steady[i, h, :, -1] = np.sum(amplitudes * model.contact_row)
    return steady


def _denominators(model: ModalModel, omega: Floats | float) -> Complexes:
    frequency = np.sqrt(model.frequency_squared)
    return np.asarray((frequency - omega) * (frequency + omega) + 2j * model.decay * omega)


def steady_curvature_bound(oscillator: Oscillator, harmonic: Harmonic, left: Floats, right: Floats) -> Floats:
    """Return bounds of ``|d^2 X/d omega^2|`` of the contact coordinate over m intervals, shape (m,).

    In block j, with the exponents i s_1 and i s_2, the steady response to the harmonic f(s) e^{i s t} is a polynomial
    over a quadratic, ``n(s)/((s - s_1)(s - s_2))``. Over an interval of s the distances from s_1 and s_2 have minima,
    and the moduli of n, n', n'' are no larger than with all terms added up.

    Parameters
    ----------
    oscillator : Oscillator
        Every mode that contact sees is damped.
    harmonic : Harmonic
        Of its drive.
    left, right : ndarray of shape (m,)
        Ends of the intervals of omega, 0 < left <= right.
    """
    model, order = modal_model(oscillator), harmonic.order
    terms = _numerators(oscillator, model, harmonic)
    seen = np.any(terms, axis=1)
    decay, discriminant, square = (
        values[seen] for values in (model.decay, model.discriminant, model.frequency_squared)
    )
    split = np.sqrt(np.abs(discriminant))
    turning, swift = np.where(discriminant > 0.0, split, 0.0), decay + np.where(discriminant > 0.0, 0.0, split)
    slow = np.where(discriminant > 0.0, decay, square / np.where(swift > 0.0, swift, 1.0))
    first, last = order * left[:, None], order * right[:, None]
    near = np.hypot(np.maximum(np.maximum(first - turning, turning - last), 0.0), swift)
    far = np.hypot(np.maximum(first + turning, 0.0), slow)

    n, powers = np.abs(terms[seen]), last ** np.arange(4)
    value = powers @ n.T
    slope = powers[:, :3] @ (n[:, 1:] * [1.0, 2.0, 3.0]).T
    second = powers[:, :2] @ (n[:, 2:] * [2.0, 6.0]).T
    inverse = 1.0 / near + 1.0 / far
    squares = inverse * inverse + 1.0 / near**2 + 1.0 / far**2
    total = np.sum((second + 2.0 * slope * inverse + value * squares) / (near * far), axis=1)
    return np.asarray(BOUND_SAFETY * order * order * total)


def _numerators(oscillator: Oscillator, model: ModalModel, harmonic: Harmonic) -> Complexes:
    """Return the coefficients of 1, s, s^2, s^3 in n(s) of every block, shape (N, 4)."""
    count, structure = model.size, oscillator.structure
    amplitudes = np.stack([harmonic.constant, harmonic.rate, harmonic.quadratic], axis=1)
    accelerations = structure.solve_mass(amplitudes.real) + 1j * structure.solve_mass(amplitudes.imag)
    forces = (model.to_modal[:, count:] @ accelerations).reshape(count, 2, 3)
    square, twice = model.frequency_squared[:, None], 2.0 * model.decay[:, None]
    # what the contact sees of the blocks' forces, and of these carried on by the blocks' generator
    row = model.contact_row
    direct = np.einsum("ja,jab->jb", row, forces)
    carried = row[:, :1] * forces[:, 1] - row[:, 1:] * (square * forces[:, 0] + twice * forces[:, 1])
    numerators = np.zeros((count, 4), dtype=np.complex128)
    numerators[:, :3] = (twice * direct + carried) * [1.0, 1j, 1.0]
    numerators[:, 1:] += 1j * direct * [1.0, 1j, 1.0]
    return numerators
