"""The Poincare map of a grazing motion, the Jacobians of its smooth part, and its comparison with simulation.

The returns of a state near a graze are computed by the map ``P = P_2 o DM_2 o P_1 o DM_1``, equation (26), and by
simulation of the motion. They are half a period of the forces apart where the steady motion grazes both stops at once,
and else a whole one.

A smooth map P_1 or P_2 takes a state with the contact at rest near a stop to the state in which, without stops, it is
at rest at the next return. The motion between them is in closed form; the phase at which it arrives is found by
Newton's method. The Jacobians are (28) and (46).
"""

from __future__ import annotations

import cmath
import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.grazing.discontinuity_mapping import exact_mapping, leading_mapping, overshoot_of
from grazemap_core.grazing.point import GrazingPoint, checked_deviation, interleaved
from grazemap_core.grazing.tolerances import RETURN_ROUNDING, RETURN_SETTLED, RETURN_STEPS
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.modal import ModalModel
from grazemap_core.records import dataclass
from grazemap_core.simulation.trajectories import trajectory

Mapping = Literal["leading", "exact"]


_NOT_NEARBY = (
    "is beyond the neighbourhood of the graze: the contact is not at rest within a quarter period of the next graze"
)


@dataclass(frozen=True, eq=False)
class Returns:
    """The returns of a motion to the stops; row 0 is the initial state."""

    deviation: Floats
    """(m + 1, 2N + 1) Row k is relative to the grazing point of its stop (right and left in turn if both are grazed
    at once), on the Poincare surface, for the motion without the impact at this return. NaN once the motion is no
    longer near the graze."""
    overshoot: Floats
    """(m + 1,) Distance of the contact beyond the stop there; there is an impact if it is positive."""


@dataclass(frozen=True, eq=False)
class ReturnComparison:
    """The returns of one state by the map and by simulation."""

    mapped: Returns
    """The returns by the map."""
    simulated: Returns
    """The returns by simulation."""
    error: Floats
    """(m + 1,) Size of the difference in units of amplitude, omega amplitude and radians, `GrazingPoint.size`."""


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
    divisor = point.oscillator.common_divisor  # phases are those of omega, and speeds are compared with omega
    speed = point.stop * omega * point.amplitude
    velocity = point.oscillator.contact @ model.from_modal[point.oscillator.size :]
    scale = -point.stop * point.amplitude  # a quotient of complex numbers would be rounded more than once
    contact = (complex(x.real / scale, x.imag / scale) for x in point.contact_steady.tolist())
    waves = list(zip(point.orders.tolist(), contact, strict=True))
    # several harmonics do not cancel exactly at the point itself
    rounding = RETURN_ROUNDING * sum(k * abs(wave) for k, wave in waves) if len(waves) > 1 else 0.0
    end = 0.0
    for _ in range(RETURN_STEPS):
        arrived = _advanced(model, free, (end - phase) / omega)
        # with one harmonic sin(end) = s v_free/(omega A), and its derivative with respect to the phase
        terms = velocity * arrived.ravel() / speed
        turned = [(k, wave * cmath.exp(1j * k * end)) for k, wave in waves]
        rest = sum(k * wave.real for k, wave in turned) - float(np.sum(terms))
        slope = -sum(k * k * wave.imag for k, wave in turned)
        u, rate = arrived.T
        rates = np.stack([rate, -model.frequency_squared * u - 2.0 * model.decay * rate], axis=1)
        slope -= float(velocity @ rates.ravel()) / (omega * speed)
        if not slope > 0.0:
            break
        before, end = end, end - rest / slope
        if not abs(end) < point.quarter_turn:
            break
        settled = RETURN_SETTLED * float(np.sum(np.abs(terms))) / divisor**2
        if abs(end - before) <= settled + rounding / slope:
            return _advanced(model, free, (end - phase) / omega), end
    raise ParameterError("deviation", _NOT_NEARBY)


def flow_jacobian(point: GrazingPoint) -> Floats:
    """Return ``Phi_x(x*, T/2)``, the derivative of the state at the next return with respect to that at the graze.

    Its shape is (2N + 1, 2N + 1), in the order (x_1, v_1, ..., theta): equations (46)-(48).
    """
    count = point.oscillator.size
    model, mixed = point.model, point.masses_first
    through = block_diag(*_block_flows(model, point.return_time))
    jacobian = np.zeros((2 * count + 1, 2 * count + 1))
    jacobian[np.ix_(mixed, mixed)] = model.from_modal @ through @ model.to_modal
    # a change of theta shifts the steady motion in time; the rest of the change follows the free flow
    along, onward = point.vector_field / point.omega, point.next().vector_field / point.omega
    jacobian[:, -1] = onward - jacobian @ along
    jacobian[-1, -1] = 1.0
    return jacobian


def surface_projection(point: GrazingPoint) -> Floats:
    """Return ``I - f h_P/(h_P f)``, (2N + 1, 2N + 1), along the flow onto the surface q' = 0 at a graze, (46)."""
    still = np.zeros(point.oscillator.size)
    row, jump = (interleaved(still, weights, 0.0) for weights in (point.oscillator.contact, point.oscillator.jump))
    projection = np.eye(len(point.state)) - np.outer(point.vector_field / point.acceleration, row)
    return projection - np.outer(jump, row @ projection)


def return_jacobian(point: GrazingPoint) -> Floats:
    """Return the Jacobian (46) of `return_map` at the graze, projected at the next return, (2N + 1, 2N + 1).

    It maps the vector field to zero, equations (49) and (50).
    """
    return surface_projection(point.next()) @ flow_jacobian(point)


def _block_flows(model: ModalModel, time: float) -> Floats:
    """Return the flow of each block over a time, shape (N, 2, 2)."""
    blocks = zip(model.decay.tolist(), model.discriminant.tolist(), model.frequency_squared.tolist(), strict=True)
    return np.array([block_flow(*block, time) for block in blocks]).reshape(-1, 2, 2)


def _advanced(model: ModalModel, free: Floats, time: float) -> Floats:
    """Return a free part, shape (N, 2), after a time."""
    flow = _block_flows(model, time)
    return np.asarray(flow[:, :, 0] * free[:, :1] + flow[:, :, 1] * free[:, 1:])


def mapped_return(
    point: GrazingPoint,
    deviation: ArrayLike,
    depth: float = 0.0,
    mapping: Mapping = "leading",
) -> Floats:
    """Return the deviation at the next return, ``P_1 o DM_1`` or ``P_2 o DM_2``: (31), (32).

    Parameters
    ----------
    point : GrazingPoint
        At the stop of the initial state.
    deviation : array_like of shape (2N + 1,)
        On the Poincare surface.
    depth : float
        Steady amplitude minus clearance.
    mapping : {"leading", "exact"}
        Which discontinuity mapping.

    Returns
    -------
    ndarray of shape (2N + 1,)
        Relative to ``point.next()``.

    Raises
    ------
    ParameterError
        The state is off the surface, beyond the domain of the exact mapping, or too far from the graze for the smooth
        map.
    """
    if mapping not in ("leading", "exact"):
        raise ParameterError("mapping", "must be leading or exact")
    values = checked_deviation(point, deviation)
    if mapping == "leading":
        values = leading_mapping(point, values, depth)
    elif overshoot_of(point, values, depth) > 0.0:
        values = exact_mapping(point, values, depth).deviation
    return return_map(point, values)


def mapped_returns(
    point: GrazingPoint,
    deviation: ArrayLike,
    returns: int,
    depth: float = 0.0,
    mapping: Mapping = "leading",
) -> Returns:
    """Return a number of iterates of the map.

    Parameters and errors as in `mapped_return`; rows after a state outside the domain of the map are NaN.
    """
    checked_order("returns", returns, 1)
    rows = np.full((returns + 1, len(point.state)), math.nan)
    rows[0] = checked_deviation(point, deviation)
    here = point
    for k in range(returns):
        try:
            rows[k + 1] = mapped_return(here, rows[k], depth, mapping)
        except ParameterError as error:
            if k == 0 or error.name not in ("overshoot", "deviation"):
                raise
            break
        here = here.next()
    return _returns(point, rows, depth)


def simulated_returns(point: GrazingPoint, deviation: ArrayLike, returns: int, depth: float = 0.0) -> Returns:
    """Return a number of returns by simulation, starting from the impact that precedes the state.

    Parameters
    ----------
    point, deviation, depth
        As in `mapped_return`.
    returns : int
        >= 1.

    Raises
    ------
    ParameterError
        The state is off the surface or beyond the domain of the exact mapping, or a number is out of range.
    """
    checked_order("returns", returns, 1)
    values = checked_deviation(point, deviation)
    rows = np.full((returns + 1, len(point.state)), math.nan)
    rows[0] = values
    begin = values
    if overshoot_of(point, values, depth) > 0.0:
        begin = exact_mapping(point, values, depth).impact
    state = point.state + begin
    displacement, velocity = state[:-1:2].copy(), state[1::2].copy()
    if begin is not values:
        displacement = point.oscillator.with_contact(displacement, point.stop * (point.clearance - depth))
    # sampled a quarter of a period before every return, where no impact is near
    ahead = point.quarter_turn / point.turn
    turns = point.turn * (np.arange(1, returns + 1) - ahead) - begin[-1]
    run = trajectory(
        point.oscillator,
        point.omega,
        point.clearances(depth),
        displacement,
        velocity,
        state[-1],
        periods=math.ceil(returns * point.return_time / (2.0 * point.half_period)) + 2,
        max_period=1,
        times=turns / point.omega,
    )
    here = point
    for k in range(run.time.size):
        here = here.next()
        between = here.state + here.steady_change(-here.quarter_turn)
        free = np.concatenate([run.displacement[:, k], run.velocity[:, k]]) - between[here.masses_first]
        try:
            rows[k + 1] = arrival(here, (here.model.to_modal @ free).reshape(-1, 2), -here.quarter_turn)
        except ParameterError:
            break
    return _returns(point, rows, depth)


def compare_returns(
    point: GrazingPoint,
    deviation: ArrayLike,
    returns: int,
    depth: float = 0.0,
    mapping: Mapping = "leading",
) -> ReturnComparison:
    """Return the returns by the map and by simulation, and their difference.

    With the leading-order mapping the error at the first return is of the order of the overshoot, and remains so while
    no impact recurs; after a return with an impact it is of the order of the square root of the overshoot
    (docs/theory.md).

    Parameters and errors as in `mapped_returns` and `simulated_returns`.
    """
    mapped = mapped_returns(point, deviation, returns, depth, mapping)
    simulated = simulated_returns(point, deviation, returns, depth)
    apart = mapped.deviation - simulated.deviation
    return ReturnComparison(mapped, simulated, np.array([point.size(row) for row in apart]))


def _returns(point: GrazingPoint, rows: Floats, depth: float) -> Returns:
    """Return the returns with these deviations, shape (m + 1, 2N + 1)."""
    stops = point.stop * np.append(1.0, point.varied.returns(len(rows) - 1)[1])
    return Returns(rows, depth + stops * np.array([point.contact_of(row)[0] for row in rows]))
