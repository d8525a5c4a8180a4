"""The bifurcation curves of one motion in a window of a plane of two parameters, as forcing frequency and clearance.

The branches of an orbit over both parameters are followed as long as they stay in the window. Each of their special
points is followed as a curve, and each curve is kept once. Where the stops are not symmetric, so are branches from the
mirror images of the orbits: those of symmetric stops meet at a symmetry breaking, and remain as two that do not. A
curve that no branch meets is not found: unlike the closed forms of `window_curves` this search may be incomplete.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.continuation.bifurcation_curves import BifurcationCurve, bifurcation_curve
from grazemap_core.continuation.branch_switching import as_on_curve, merged
from grazemap_core.continuation.branches import OrbitBranch, OrbitPoint, at_point, orbit_branch
from grazemap_core.continuation.parameters import PARAMETERS, Parameter, ParameterPoint, symmetric_stops
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.continuation.tolerances import MIRRORED_ORBITS, MOST_BRANCHES, SAME_CURVE, SEARCHED_SHARES
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.orbits.search import explicit_sequences, mirrored, sequence_of_stops, turned_to

Window = tuple[float, float]
Through = Callable[[OrbitPoint], OrbitBranch]
"""Returns the branch of an orbit over the vertical parameter."""
OMEGA_CLEARANCE: Final[tuple[Parameter, Parameter]] = ("omega", "clearance")


@in_own_period
def motion_curves(
    oscillator: Oscillator,
    orbit: PeriodicOrbit | OrbitPoint,
    horizontal: Window,
    vertical: Window,
    longest_step: float = 0.05,
    max_points: int = 500,
    plane: tuple[Parameter, Parameter] = OMEGA_CLEARANCE,
) -> list[BifurcationCurve]:
    """Return the curves of an orbit's special points inside a window, in the order in which its branches meet them.

    Parameters
    ----------
    oscillator : Oscillator
    orbit : PeriodicOrbit or OrbitPoint
        Converged, with its values of the two parameters in the window; as for `branches.orbit_branch`.
    horizontal, vertical : (float, float)
        The window, start < stop each.
    longest_step : float
        As for `branches.orbit_branch`.
    max_points : int
        Maximum number of points of every branch and curve, in either direction.
    plane : (str, str)
        The two parameters that vary; the others are those of the orbit.

    Raises
    ------
    ParameterError
        The orbit has not converged, or a number is out of range.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`, anywhere in the window.
    """
    ranges = dict(zip(plane, (horizontal, vertical), strict=True))
    orbit_point = at_point(oscillator, orbit)
    for name, (start, stop) in reversed(ranges.items()):
        if not start <= orbit_point.at.value(name) <= stop:
            raise ParameterError(name, "must contain that of the orbit")

    def through(orbit: OrbitPoint, name: Parameter = plane[1]) -> OrbitBranch:
        return orbit_branch(oscillator, orbit, *ranges[name], name, longest_step, max_points)

    branches = [through(orbit_point), through(orbit_point, plane[0])]
    branches += _other_branches(oscillator, branches[0], through)
    curves: list[BifurcationCurve] = []
    for special in (point for branch in branches for point in branch.special_points):
        point = followable(oscillator, special)
        if point is not None and not any(lies_on(point, curve) for curve in curves):
            curves.append(bifurcation_curve(oscillator, point, horizontal, vertical, longest_step, max_points, plane))
    return curves


@in_own_period
def orbit_in_window(
    oscillator: Oscillator,
    at: ParameterPoint,
    ranges: Mapping[Parameter, Window],
    period: int,
    stops: Sequence[int],
) -> OrbitPoint | None:
    """Return an orbit of a motion somewhere in a window, or None where none was found.

    A window may be a single point. Closed forms and trajectories are tried (`search.sequence_of_stops`) at its middle
    and at quarters of its sides; an admissible orbit is preferred to one that is not. `at` has the values of the
    parameters that do not vary.

    Raises
    ------
    ParameterError, SteadyMotionError, ConditioningError
        As for `search.sequence_of_stops`.
    """
    virtual = None
    for values in itertools.product(*map(_places, ranges.values())):
        here = at
        for name, value in zip(ranges, values, strict=True):
            here = here.varied(name, value)
        there = here.applied(oscillator)
        guess = sequence_of_stops(there, here.omega, here.clearance, period, stops)
        if guess is None:
            continue
        orbit = periodic_orbit(there, here.omega, here.clearance, guess)
        if orbit.admissible:
            return OrbitPoint(orbit, here)
        if orbit.converged and virtual is None:
            virtual = OrbitPoint(orbit, here)
    return virtual


def _other_branches(oscillator: Oscillator, branch: OrbitBranch, through: Through) -> list[OrbitBranch]:
    """Return other branches of a sequence of stops over the same parameter, where the stops are not symmetric.

    Orbits of them are looked for near the mirror images of orbits of the branch, and among the orbits with one impact
    on each stop, which are explicit.
    """
    branches = [branch]
    if symmetric_stops(oscillator, branch.points[0]):
        return []
    physical = np.flatnonzero(np.all(branch.velocities * branch.stops > 0.0, axis=1))
    if not len(physical):
        return []
    for place in physical[np.unique(np.linspace(0, len(physical) - 1, MIRRORED_ORBITS).astype(int))].tolist():
        values = branch.points[place]
        impacts = ImpactSequence.create(branch.period, branch.stops, branch.phases[place], branch.velocities[place])
        mirror = turned_to(mirrored(impacts), branch.period, branch.stops)
        there = values.applied(oscillator)
        explicit = explicit_sequences(there, values.omega, values.clearance, branch.period, branch.stops)
        for guess in ([] if mirror is None else [mirror]) + explicit:
            orbit = periodic_orbit(there, values.omega, values.clearance, guess)
            if not (orbit.converged and orbit.physical) or len(branches) > MOST_BRANCHES:
                continue
            if all(_apart(orbit.impacts, values, other, (branch.parameter,)) > SAME_CURVE for other in branches):
                branches.append(through(OrbitPoint(orbit, values)))
    return branches[1:]


def lies_on(point: SpecialPoint, curve: BifurcationCurve) -> bool:
    """Return whether a special point lies on a curve: it has the curve's type, and its orbit is one of the curve's."""
    impacts, number = as_on_curve(point)
    if point.type != curve.type or number != curve.impact or not np.array_equal(impacts.stops, curve.stops):
        return False
    if (impacts.period, impacts.symmetric) != (curve.period, curve.symmetric):
        return False
    return _apart(impacts, point.values, curve, curve.plane) <= SAME_CURVE


def _apart(
    impacts: ImpactSequence,
    values: ParameterPoint,
    curve: BifurcationCurve | OrbitBranch,
    parameters: tuple[Parameter, ...],
) -> float:
    """Return how far an orbit is from a curve or a branch of its stops, along which these parameters vary."""
    # all coordinates are relative, so that they can be compared
    width = min(abs(values.clearance_right), abs(values.clearance_left)) or 1.0
    speed, whole = values.omega * width, 2.0 * math.pi * impacts.period
    turns = np.round((curve.phases[:, :1] - impacts.phases[0]) / whole) * whole
    path = [curve.phases - turns - impacts.phases, (curve.velocities - impacts.velocities) / speed]
    for name in parameters:
        here = values.value(name)
        unit = width if name.startswith("clearance") else 1.0
        if name == "omega" or name not in PARAMETERS:
            unit = here or 1.0
        path.append(np.array([[(place.value(name) - here) / unit] for place in curve.points]))
    line = np.concatenate(path, axis=1)
    return float(distances_from_line(np.zeros((1, line.shape[1])), line)[0])


def distances_from_line(points: Floats, line: Floats, drawn: Booleans | None = None) -> Floats:
    """Return the distances (p,) of points (p, d) from a polyline with the corners (m, d).

    If it is given which corners are drawn, segments of which neither end is drawn do not count; the distance is
    infinite if no segment counts.
    """
    if drawn is None:
        drawn = np.ones(len(line), dtype=np.bool_)
    if len(line) == 1:
        line, drawn = np.repeat(line, 2, axis=0), np.repeat(drawn, 2)
    best = np.full(len(points), np.inf)
    for k in np.flatnonzero(drawn[:-1] | drawn[1:]):
        start, side = line[k], line[k + 1] - line[k]
        length = float(side @ side)
        share = np.clip((points - start) @ side / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(points))
        best = np.minimum(best, np.linalg.norm(points - start - share[:, None] * side, axis=1))
    return best


def followable(oscillator: Oscillator, point: SpecialPoint) -> SpecialPoint | None:
    """Return the special point at which its curve can start, or None.

    Where the branch ends on another one, it is the special point of the other branch: the parameter is accurate to
    round-off there, and so is the orbit of the other branch.
    """
    parent = merged(point.impacts, point.type == "SB") if point.type in ("PD", "SB") else None
    if parent is None:
        return None if point.reason else point
    orbit = periodic_orbit(point.values.applied(oscillator), point.omega, point.clearance, parent)
    return replace(point, reason="", impacts=orbit.impacts) if orbit.converged else None


def _places(side: Window) -> list[float]:
    start, stop = side
    return [start] if start == stop else [start + share * (stop - start) for share in SEARCHED_SHARES]
