"""The bifurcation curves of one motion in a window of the plane of forcing frequency and clearance.

The branches of an orbit over clearance and over frequency are followed as long as they stay in the window. Each of
their special points is followed as a curve, and each curve is kept once. A curve that neither branch meets is not
found: unlike the closed forms of `window_curves` this search may be incomplete.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grazemap_core.continuation.bifurcation_curves import BifurcationCurve, bifurcation_curve
from grazemap_core.continuation.branch_switching import as_on_curve, merged
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.continuation_problem import Parameter
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.continuation.tolerances import SAME_CURVE
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops

PLACES = (0.5, 0.25, 0.75)
"""Shares of a window's sides at which a motion is searched for; at each frequency, all clearances are tried."""

Window = tuple[float, float]


def motion_curves(
    oscillator: Oscillator,
    orbit: PeriodicOrbit,
    omega: Window,
    clearance: Window,
    longest_step: float = 0.05,
    max_points: int = 500,
) -> list[BifurcationCurve]:
    """Return the curves of an orbit's special points inside a window, in the order in which its branches meet them.

    Parameters
    ----------
    oscillator : Oscillator
    orbit : PeriodicOrbit
        Converged, with its omega and clearance in the window.
    omega, clearance : (float, float)
        The window, 0 < start < stop each.
    longest_step : float
        As for `branches.orbit_branch`.
    max_points : int
        Maximum number of points of every branch and curve, in either direction.

    Raises
    ------
    ParameterError
        The orbit has not converged, or a number is out of range.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`, anywhere in the window.
    """
    ranges: dict[Parameter, Window] = {"clearance": clearance, "omega": omega}
    for name, value in (("omega", orbit.omega), ("clearance", orbit.clearance)):
        if not ranges[name][0] <= value <= ranges[name][1]:  # type: ignore[index]
            raise ParameterError(name, "must contain that of the orbit")
    branches = [
        orbit_branch(oscillator, orbit, *bounds, name, longest_step, max_points) for name, bounds in ranges.items()
    ]
    curves: list[BifurcationCurve] = []
    for special in (point for branch in branches for point in branch.special_points):
        point = followable(oscillator, special)
        if point is not None and not any(lies_on(point, curve) for curve in curves):
            curves.append(bifurcation_curve(oscillator, point, omega, clearance, longest_step, max_points))
    return curves


def orbit_in_window(
    oscillator: Oscillator, omega: Window, clearance: Window, period: int, stops: Sequence[int]
) -> PeriodicOrbit | None:
    """Return an orbit of a motion somewhere in a window, or None where none was found.

    A window may be a single point. Closed forms and trajectories are tried
    (`search.sequence_of_stops`) at its middle and at quarters of its sides; an admissible orbit is
    preferred to one that is not.

    Raises
    ------
    ParameterError, SteadyMotionError, ConditioningError
        As for `search.sequence_of_stops`.
    """
    virtual = None
    for frequency in _places(omega):
        for gap in _places(clearance):
            guess = sequence_of_stops(oscillator, frequency, gap, period, stops)
            if guess is None:
                continue
            orbit = periodic_orbit(oscillator, frequency, gap, guess)
            if orbit.admissible:
                return orbit
            if orbit.converged and virtual is None:
                virtual = orbit
    return virtual


def lies_on(point: SpecialPoint, curve: BifurcationCurve) -> bool:
    """Return whether a special point lies on a curve: it has the curve's type, and its orbit is one of the curve's."""
    impacts, number = as_on_curve(point)
    if point.type != curve.type or number != curve.impact or not np.array_equal(impacts.stops, curve.stops):
        return False
    if (impacts.period, impacts.symmetric) != (curve.period, curve.symmetric):
        return False
    # all coordinates are relative, so that they can be compared
    speed = point.omega * point.clearance
    whole = 2.0 * math.pi * impacts.period
    turns = np.round((curve.phases[:, :1] - impacts.phases[0]) / whole) * whole
    path = np.concatenate(
        [
            curve.phases - turns - impacts.phases,
            (curve.velocities - impacts.velocities) / speed,
            (curve.omega[:, None] - point.omega) / point.omega,
            (curve.clearance[:, None] - point.clearance) / point.clearance,
        ],
        axis=1,
    )
    return _distance_from_origin(path) <= SAME_CURVE


def _distance_from_origin(path: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Return how far a polyline, points (m, d), is from the origin."""
    if len(path) == 1:
        return float(np.linalg.norm(path[0]))
    here, side = path[:-1], np.diff(path, axis=0)
    length = np.einsum("ij,ij->i", side, side)
    share = np.clip(-np.einsum("ij,ij->i", here, side) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    return float(np.min(np.linalg.norm(here + share[:, None] * side, axis=1)))


def followable(oscillator: Oscillator, point: SpecialPoint) -> SpecialPoint | None:
    """Return the special point at which its curve can start, or None.

    Where the branch ends on another one, it is the special point of the other branch: the parameter is accurate to
    round-off there, and so is the orbit of the other branch.
    """
    parent = merged(point.impacts) if point.type in ("PD", "SB") else None
    if parent is None:
        return point if point.status == "converged" else None
    orbit = periodic_orbit(oscillator, point.omega, point.clearance, parent)
    return replace(point, status="converged", impacts=orbit.impacts) if orbit.converged else None


def _places(side: Window) -> list[float]:
    start, stop = side
    return [start] if start == stop else [start + share * (stop - start) for share in PLACES]
