"""The Poincare map of a grazing motion, and its comparison with simulation.

The returns of a state near a graze, half a period apart, are computed by the map ``P = P_2 o DM_2 o P_1 o DM_1``,
equation (26), and by simulation of the motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.discontinuity_mapping import exact_mapping, leading_mapping, overshoot_of
from grazemap_core.grazing.half_period_maps import flow_to_rest, half_period_jacobian, half_period_map
from grazemap_core.grazing.point import GrazingPoint, checked_deviation
from grazemap_core.simulation.trajectories import trajectory

Mapping = Literal["leading", "exact"]
Smooth = Literal["linear", "exact"]


@dataclass(frozen=True, eq=False)
class Returns:
    """The returns of a motion to the stops, half a period apart; row 0 is the initial state.

    Attributes
    ----------
    deviation : ndarray of shape (m + 1, 2N + 1)
        Row k is relative to the grazing point of stop A or C in turn, on the Poincare surface, for the motion without
        the impact at this return. NaN once the motion has left the neighbourhood of the graze.
    overshoot : ndarray of shape (m + 1,)
        Distance of mass 1 beyond the stop there; there is an impact if it is positive.
    """

    deviation: Floats
    overshoot: Floats


@dataclass(frozen=True, eq=False)
class ReturnComparison:
    """The returns of one state by the map and by simulation.

    Attributes
    ----------
    mapped, simulated : Returns
    error : ndarray of shape (m + 1,)
        Size of the difference in units of clearance, omega clearance and radians, `GrazingPoint.size`.
    """

    mapped: Returns
    simulated: Returns
    error: Floats


def half_return(
    point: GrazingPoint,
    deviation: ArrayLike,
    depth: float = 0.0,
    mapping: Mapping = "leading",
    smooth: Smooth = "exact",
) -> Floats:
    """Return the deviation at the other stop half a period later, ``P_1 o DM_1`` or ``P_2 o DM_2``: (31), (32).

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
    smooth : {"linear", "exact"}
        The half-period map, linearised as in the paper or exact.

    Returns
    -------
    ndarray of shape (2N + 1,)
        Relative to ``point.opposite()``.

    Raises
    ------
    ParameterError
        The state is off the surface, beyond the domain of the exact mapping, or too far from the graze for the smooth
        map.
    """
    if mapping not in ("leading", "exact"):
        raise ParameterError("mapping", "must be leading or exact")
    if smooth not in ("linear", "exact"):
        raise ParameterError("smooth", "must be linear or exact")
    values = checked_deviation(point, deviation)
    if mapping == "leading":
        values = leading_mapping(point, values, depth)
    elif overshoot_of(point, values, depth) > 0.0:
        values = exact_mapping(point, values, depth).deviation
    return half_period_map(point, values) if smooth == "exact" else half_period_jacobian(point) @ values


def mapped_returns(
    point: GrazingPoint,
    deviation: ArrayLike,
    returns: int,
    depth: float = 0.0,
    mapping: Mapping = "leading",
    smooth: Smooth = "exact",
) -> Returns:
    """Return a number of iterates of the map, half a period each.

    Parameters and errors as in `half_return`; rows after a state outside the domain of the map are NaN.
    """
    checked_order("returns", returns, 1)
    rows = np.full((returns + 1, len(point.state)), math.nan)
    rows[0] = checked_deviation(point, deviation)
    here = point
    for k in range(returns):
        try:
            rows[k + 1] = half_return(here, rows[k], depth, mapping, smooth)
        except ParameterError as error:
            if k == 0 or error.name not in ("overshoot", "deviation"):
                raise
            break
        here = here.opposite()
    return _returns(point, rows, depth)


def simulated_returns(point: GrazingPoint, deviation: ArrayLike, returns: int, depth: float = 0.0) -> Returns:
    """Return a number of returns by simulation, starting from the impact that precedes the state.

    Parameters
    ----------
    point, deviation, depth
        As in `half_return`.
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
    clearance = point.clearance - depth
    begin = values
    if overshoot_of(point, values, depth) > 0.0:
        begin = exact_mapping(point, values, depth).impact
    state = point.state + begin
    displacement, velocity = state[:-1:2].copy(), state[1::2].copy()
    if begin is not values:
        displacement[0] = point.stop * clearance
    # sampled in the middle between two returns, where no impact is near
    turns = math.pi * (np.arange(1, returns + 1) - 0.5) - begin[-1]
    run = trajectory(
        point.oscillator,
        point.omega,
        clearance,
        displacement,
        velocity,
        state[-1],
        periods=returns // 2 + 2,
        max_period=1,
        times=turns / point.omega,
    )
    here = point
    for k in range(run.time.size):
        here = here.opposite()
        between = here.state + here.steady_change(-0.5 * math.pi)
        free = np.concatenate([run.displacement[:, k], run.velocity[:, k]]) - between[here.masses_first]
        try:
            free, phase = flow_to_rest(here, (here.model.to_modal @ free).reshape(-1, 2), -0.5 * math.pi)
        except ParameterError:
            break
        rows[k + 1] = here.deviation(free, phase)
        rows[k + 1, 1] = 0.0
    return _returns(point, rows, depth)


def compare_returns(
    point: GrazingPoint,
    deviation: ArrayLike,
    returns: int,
    depth: float = 0.0,
    mapping: Mapping = "leading",
    smooth: Smooth = "exact",
) -> ReturnComparison:
    """Return the returns by the map and by simulation, and their difference.

    With the leading-order mapping the error at the first return is of the order of the overshoot, and remains so while
    no impact recurs; after a return with an impact it is of the order of the square root of the overshoot
    (docs/theory.md).

    Parameters and errors as in `mapped_returns` and `simulated_returns`.
    """
    mapped = mapped_returns(point, deviation, returns, depth, mapping, smooth)
    simulated = simulated_returns(point, deviation, returns, depth)
    apart = mapped.deviation - simulated.deviation
    return ReturnComparison(mapped, simulated, np.array([point.size(row) for row in apart]))


def _returns(point: GrazingPoint, rows: Floats, depth: float) -> Returns:
    """Return the returns with these deviations, shape (m + 1, 2N + 1)."""
    stops = point.stop * (-1.0) ** np.arange(len(rows))
    return Returns(rows, depth + stops * rows[:, 0])
