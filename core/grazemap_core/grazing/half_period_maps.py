"""The smooth maps from one Poincare surface to the other over half a period, and their Jacobians (28), (46).

A state with mass 1 at rest near a stop is mapped to the state in which, without stops, it is at rest near the other
stop. The motion between them is in closed form; the phase at which it arrives is found by Newton's method.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.point import GrazingPoint, checked_deviation
from grazemap_core.grazing.tolerances import HALF_MAP_SETTLED, HALF_MAP_STEPS
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.modal import ModalModel

NOT_NEARBY = "is beyond the neighbourhood of the graze: mass 1 is not at rest within a quarter period of the next graze"


def half_period_map(point: GrazingPoint, deviation: ArrayLike) -> Floats:
    """Return the deviation from ``point.opposite()`` half a period later: P_1 for stop A, P_2 for stop C.

    Parameters
    ----------
    point : GrazingPoint
    deviation : array_like of shape (2N + 1,)
        On the Poincare surface, v_1 = 0.

    Returns
    -------
    ndarray of shape (2N + 1,)
        On the Poincare surface of the other stop.

    Raises
    ------
    ParameterError
        The deviation is of the wrong shape or not on the surface, or so large that mass 1 is not at rest within a
        quarter period of the other graze.
    """
    values = checked_deviation(point, deviation)
    free, phase = point.free_part(values), float(values[-1])
    arrived, end = flow_to_rest(point.opposite(), free, phase - math.pi)
    result = point.opposite().deviation(arrived, end)
    result[1] = 0.0
    return result


def flow_to_rest(point: GrazingPoint, free: Floats, phase: float) -> tuple[Floats, float]:
    """Return the state near a grazing point in which mass 1 is at rest, on a motion without impacts.

    Parameters
    ----------
    point : GrazingPoint
        The grazing point near which mass 1 is at rest.
    free : ndarray of shape (N, 2)
        Free part of the initial state, in block coordinates.
    phase : float
        theta of the initial state minus that of the point; the motion is followed to a phase near 0, forward or back.

    Returns
    -------
    free : ndarray of shape (N, 2)
    phase : float
        Where mass 1 is at rest.

    Raises
    ------
    ParameterError
        Mass 1 is not at rest within a quarter period of the point.
    """
    model, omega = point.model, point.omega
    speed = point.stop * omega * point.clearance
    velocity = model.from_modal[point.oscillator.size]
    end = 0.0
    for _ in range(HALF_MAP_STEPS):
        arrived = advanced(model, free, (end - phase) / omega)
        # sin(end) = s v_free/(omega A), and its derivative with respect to the phase
        terms = velocity * arrived.ravel() / speed
        rest = math.sin(end) - float(np.sum(terms))
        slope = math.cos(end) - float(velocity @ _rates(model, arrived).ravel()) / (omega * speed)
        if not slope > 0.0:
            break
        before, end = end, end - rest / slope
        if not abs(end) < 0.5 * math.pi:
            break
        if abs(end - before) <= HALF_MAP_SETTLED * float(np.sum(np.abs(terms))):
            return advanced(model, free, (end - phase) / omega), end
    raise ParameterError("deviation", NOT_NEARBY)


def flow_jacobian(point: GrazingPoint) -> Floats:
    """Return ``Phi_x(x*, T/2)``, the derivative of the state half a period later with respect to that at the graze.

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
        In the order (x_1, v_1, ..., theta), equations (46)-(48).
    """
    count = point.oscillator.size
    model, mixed = point.model, point.masses_first
    through = flow_of_blocks(model, point.half_period)
    jacobian = np.zeros((2 * count + 1, 2 * count + 1))
    jacobian[np.ix_(mixed, mixed)] = model.from_modal @ through @ model.to_modal
    # a change of theta shifts the steady motion in time; the rest of the change follows the free flow
    along, onward = point.vector_field / point.omega, point.opposite().vector_field / point.omega
    jacobian[:, -1] = onward - jacobian @ along
    jacobian[-1, -1] = 1.0
    return jacobian


def surface_projection(point: GrazingPoint) -> Floats:
    """Return ``I - f h_P/(h_P f)`` at a grazing point, along the flow onto the surface v_1 = 0, equation (46).

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
    """
    projection = np.eye(len(point.state))
    projection[:, 1] -= point.vector_field / point.acceleration
    projection[1] = 0.0
    return projection


def half_period_jacobian(point: GrazingPoint) -> Floats:
    """Return the Jacobian (46) of `half_period_map` at the graze, projected at the end of the half period.

    Returns
    -------
    ndarray of shape (2N + 1, 2N + 1)
        Maps the vector field to zero, equations (49) and (50).
    """
    return surface_projection(point.opposite()) @ flow_jacobian(point)


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
