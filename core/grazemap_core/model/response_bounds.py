"""Bounds of the second derivative of the steady response with respect to omega, over intervals of omega.

In block j, with the exponents i s_1 and i s_2, the steady response to the harmonic f(s) e^{i s t} is a polynomial over
a quadratic, ``n(s)/((s - s_1)(s - s_2))``. Over an interval of s the distances from s_1 and s_2 have minima, and the
moduli of n, n', n'' are no larger than with all terms added up.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import BOUND_SAFETY


def second_derivative_bound(oscillator: Oscillator, harmonic: Harmonic, left: Floats, right: Floats) -> Floats:
    """Return bounds of ``|d^2 X/d omega^2|`` of the contact coordinate over m intervals, shape (m,).

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
