"""The smooth maps from one return to a stop to the next one, and their Jacobians (28), (46).

A state with the contact at rest near a stop is mapped to the state in which, without stops, it is at rest near the
other stop half a period of the forces later, if the steady motion grazes both at once, or near the same one after a
whole period. The motion between them is in closed form; the phase at which it arrives is found by Newton's method.
"""

from __future__ import annotations

import cmath

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.point import GrazingPoint, checked_deviation, interleaved
from grazemap_core.grazing.tolerances import RETURN_SETTLED, RETURN_STEPS
from grazemap_core.model.drive import fundamental
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.modal import ModalModel
from grazemap_core.tolerances import EPSILON

NOT_NEARBY = (
    "is beyond the neighbourhood of the graze: the contact is not at rest within a quarter period of the next graze"
)


def return_map(point: GrazingPoint, deviation: ArrayLike) -> Floats:
    """Return the deviation from ``point.next()`` at the next return: P_1 for the right stop, P_2 for the left.

    Parameters
    ----------
    point : GrazingPoint
    deviation : array_like of shape (2N + 1,)
        On the Poincare surface, q' = 0.

    Returns
    -------
    ndarray of shape (2N + 1,)
        On the Poincare surface of the next point.

    Raises
    ------
    ParameterError
        The deviation is of the wrong shape or not on the surface, or so large that the contact is not at rest
        within a quarter period of the next graze.
    """
    values = checked_deviation(point, deviation)
    free, phase = point.free_part(values), float(values[-1])
    return arrival(point.next(), free, phase - point.turn)


def arrival(point: GrazingPoint, free: Floats, phase: float) -> Floats:
    """Return the deviation of the state near a grazing point in which the contact is at rest; as `flow_to_rest`."""
    deviation = point.deviation(*flow_to_rest(point, free, phase))
    return point.with_contact(deviation, point.contact_of(deviation)[0], 0.0)


def flow_to_rest(point: GrazingPoint, free: Floats, phase: float) -> tuple[Floats, float]:
    """Return the state near a grazing point in which the contact is at rest, on a motion without impacts.

    Parameters
    ----------
    point : GrazingPoint
        The grazing point near which the contact is at rest.
    free : ndarray of shape (N, 2)
        Free part of the initial state, in block coordinates.
    phase : float
        theta of the initial state minus that of the point; the motion is followed to a phase near 0, forward or back.

    Returns
    -------
    free : ndarray of shape (N, 2)
    phase : float
        Where the contact is at rest.

    Raises
    ------
    ParameterError
        The contact is not at rest within a quarter period of the point.
    """
    model, omega = point.model, point.omega
    times = fundamental(point.oscillator.drive)  # phases are those of omega, and speeds are compared with omega
    speed = point.stop * omega * point.amplitude
    velocity = point.oscillator.contact @ model.from_modal[point.oscillator.size :]
    scale = -point.stop * point.amplitude  # a quotient of complex numbers would be rounded more than once
    contact = (complex(x.real / scale, x.imag / scale) for x in point.contact_steady.tolist())
    waves = list(zip(point.orders.tolist(), contact, strict=True))
    # several harmonics do not cancel exactly at the point itself
    rounding = 4.0 * EPSILON * sum(k * abs(wave) for k, wave in waves) if len(waves) > 1 else 0.0
    end = 0.0
    for _ in range(RETURN_STEPS):
        arrived = advanced(model, free, (end - phase) / omega)
        # with one harmonic sin(end) = s v_free/(omega A), and its derivative with respect to the phase
        terms = velocity * arrived.ravel() / speed
        turned = [(k, wave * cmath.exp(1j * k * end)) for k, wave in waves]
        rest = sum(k * wave.real for k, wave in turned) - float(np.sum(terms))
        slope = -sum(k * k * wave.imag for k, wave in turned)
        slope -= float(velocity @ _rates(model, arrived).ravel()) / (omega * speed)
        if not slope > 0.0:
            break
        before, end = end, end - rest / slope
        if not abs(end) < point.quarter_turn:
            break
        settled = RETURN_SETTLED * float(np.sum(np.abs(terms))) / times**2
        if abs(end - before) <= settled + rounding / slope:
            return advanced(model, free, (end - phase) / omega), end
    raise ParameterError("deviation", NOT_NEARBY)


def flow_jacobian(point: GrazingPoint) -> Floats:
    """Return ``Phi_x(x*, T/2)``, the derivative of the state at the next return with respect to that at the graze.

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
        In the order (x_1, v_1, ..., theta), equations (46)-(48).
    """
    count = point.oscillator.size
    model, mixed = point.model, point.masses_first
    through = flow_of_blocks(model, point.return_time)
    jacobian = np.zeros((2 * count + 1, 2 * count + 1))
    jacobian[np.ix_(mixed, mixed)] = model.from_modal @ through @ model.to_modal
    # a change of theta shifts the steady motion in time; the rest of the change follows the free flow
    along, onward = point.vector_field / point.omega, point.next().vector_field / point.omega
    jacobian[:, -1] = onward - jacobian @ along
    jacobian[-1, -1] = 1.0
    return jacobian


def surface_projection(point: GrazingPoint) -> Floats:
    """Return ``I - f h_P/(h_P f)`` at a grazing point, along the flow onto the surface q' = 0, equation (46).

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
    """
    still = np.zeros(point.oscillator.size)
    row, jump = (interleaved(still, weights, 0.0) for weights in (point.oscillator.contact, point.oscillator.jump))
    projection = np.eye(len(point.state)) - np.outer(point.vector_field / point.acceleration, row)
    return projection - np.outer(jump, row @ projection)


def return_jacobian(point: GrazingPoint) -> Floats:
    """Return the Jacobian (46) of `return_map` at the graze, projected at the next return.

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
        Maps the vector field to zero, equations (49) and (50).
    """
    return surface_projection(point.next()) @ flow_jacobian(point)


def flow_of_blocks(model: ModalModel, time: float) -> Floats:
    """Return the flow of all blocks over a time, shape (2N, 2N)."""
    flow = np.zeros((2 * model.size, 2 * model.size))
    for j in range(model.size):
        entries = block_flow(model.decay[j], model.discriminant[j], model.frequency_squared[j], time)
        flow[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = np.reshape(entries, (2, 2))
    return flow


def advanced(model: ModalModel, free: Floats, time: float) -> Floats:
    """Return a free part, shape (N, 2), after a time."""
    result = np.empty_like(free)
    for j, (u, rate) in enumerate(free):
        decay, discriminant = float(model.decay[j]), float(model.discriminant[j])
        e11, e12, e21, e22 = block_flow(decay, discriminant, float(model.frequency_squared[j]), time)
        result[j] = e11 * u + e12 * rate, e21 * u + e22 * rate
    return result


def _rates(model: ModalModel, free: Floats) -> Floats:
    """Return the derivative of a free part."""
    return np.stack([free[:, 1], -model.frequency_squared * free[:, 0] - 2.0 * model.decay * free[:, 1]], axis=1)
