"""The Poincare map of a grazing motion, and its comparison with simulation.

The returns of a state near a graze are computed by the map ``P = P_2 o DM_2 o P_1 o DM_1``, equation (26), and by
simulation of the motion. They are half a period of the forces apart where the steady motion grazes both stops at once,
and else a whole one.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.discontinuity_mapping import exact_mapping, leading_mapping, overshoot_of
from grazemap_core.grazing.point import GrazingPoint, checked_deviation
from grazemap_core.grazing.return_maps import arrival, return_map
from grazemap_core.records import dataclass
from grazemap_core.simulation.trajectories import trajectory

Mapping = Literal["leading", "exact"]


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
