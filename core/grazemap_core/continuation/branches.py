"""Branches of periodic motions with impacts over a parameter, through grazes and saddle-nodes.

A branch is followed both ways from an orbit by pseudo-arclength continuation, with its special points (theory, "Any
impacting orbit").

References
----------
H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", in *Applications of Bifurcation
Theory*, 1977, 359-384.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.continuation.branch_ends import Meeting
from grazemap_core.continuation.continuation_problem import (
    ContinuationPoint,
    ContinuationProblem,
    OrbitCurve,
    curve_fields,
)
from grazemap_core.continuation.parameters import Parameter, ParameterPoint, check_interval
from grazemap_core.continuation.pseudo_arclength import check_steps, follow_path
from grazemap_core.continuation.special_points import BranchSegment, SpecialPoint, special_point_at
from grazemap_core.errors import ParameterError
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.orbit_observables import OrbitObserver
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.observables import Observables


class OrbitPoint(NamedTuple):
    """An orbit, and the values of all parameters there."""

    orbit: PeriodicOrbit
    """The orbit."""
    at: ParameterPoint
    """The values of all parameters there."""


def at_point(oscillator: Oscillator, orbit: PeriodicOrbit | OrbitPoint) -> OrbitPoint:
    """Return an orbit with the values of all parameters: without any, those of the oscillator, with factors 1."""
    if isinstance(orbit, OrbitPoint):
        return orbit
    return OrbitPoint(orbit, ParameterPoint.of(oscillator, orbit.omega, orbit.clearance))


@dataclass(frozen=True, eq=False)
class OrbitBranch(OrbitCurve):
    """A branch of m periodic orbits in its order, with k impacts each."""

    parameter: Parameter
    """One of `parameters.PARAMETERS`."""
    values: Floats
    """(m,) Values of the parameter."""
    multipliers: Complexes
    """(m, 2N) Multipliers over the period, by decreasing modulus; NaN where two impacts come together."""
    isolated: Booleans
    """(m,) As in `PeriodicOrbit`."""
    admissible: Booleans
    """(m,) As in `PeriodicOrbit`."""
    stable: Booleans
    """(m,) As in `PeriodicOrbit`."""
    verified: Booleans
    """(m,) As in `PeriodicOrbit`."""
    excess: Floats
    """(m,) As in `PeriodicOrbit`."""
    special_points: tuple[SpecialPoint, ...]
    """In the order of the branch."""


@in_own_period
def orbit_branch(
    oscillator: Oscillator,
    orbit: PeriodicOrbit | OrbitPoint,
    start: float,
    stop: float,
    parameter: Parameter = "clearance",
    longest_step: float = 0.05,
    max_points: int = 2000,
    to_special: bool = False,
) -> OrbitBranch:
    """Follow the branch of an orbit both ways, until its parameter leaves a range.

    Parameters
    ----------
    oscillator : Oscillator
    orbit : PeriodicOrbit or OrbitPoint
        A converged orbit of this oscillator or, for an OrbitPoint, of this oscillator with the values of the point. A
        symmetric orbit is continued as a symmetric one, if the parameter keeps the stops symmetric.
    start, stop : float
        Range of the parameter, start < stop, which contains the orbit's value. It lies within [0, 1] for a restitution,
        and above 0 for the frequency, the clearance of both stops together, and the factor of the forces.
    parameter : str
        What varies: one of `parameters.PARAMETERS`, or a parameter of the structure.
    longest_step : float
        Maximum length of a step: phases in radians, speeds in units of speed, and the parameter relative to its value
        at the start, taken together as one vector. Two special points of one type within a step may be missed.
    max_points : int
        Maximum number of points in either direction.
    to_special : bool
        End the branch after the first segment with a special point, in either direction.

    Raises
    ------
    ParameterError
        The orbit has not converged, a number is out of range, or an oscillator with these stops has no such parameter.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`; if the frequency varies, at any point of the branch.
    """
    orbit, values = at_point(oscillator, orbit)
    if not orbit.converged:
        raise ParameterError("orbit", "has not converged")
    here = values.value(parameter)
    if parameter == "bias" and contact_equilibrium(oscillator) == 0.0:
        raise ParameterError("parameter", "bias does not move the contact, so the orbits do not depend on it")
    check_interval(parameter, start, stop)
    if not start <= here <= stop:
        raise ParameterError("start", "must not be above the orbit's value, nor stop below it")
    check_steps(longest_step, max_points)

    impacts = orbit.impacts.half() if orbit.symmetric else orbit.impacts.whole
    path, unknowns = ContinuationProblem.through(oscillator, impacts, parameter, values)
    bounds = (start / path.units[parameter], stop / path.units[parameter])
    first = path.evaluate(unknowns)
    tangent = path.tangent(unknowns, np.eye(len(unknowns))[-1])
    if tangent is None:  # a saddle-node, from which the parameter falls both ways, or rises: either direction will do
        tangent = path.direction(unknowns)

    limits = longest_step, max_points, to_special
    ahead, after, end = _follow(path, first, tangent, bounds, *limits)
    back, before, beginning = ([], [], end) if end == "closed" else _follow(path, first, -tangent, bounds, *limits)
    points = [*reversed(back), first, *ahead]
    turned = [replace(point, segment=len(back) - 1 - point.segment) for point in reversed(before)]
    special = turned + [replace(point, segment=len(back) + point.segment) for point in after]
    return _branch(path, parameter, points, tuple(special), (beginning, end))


def _follow(
    path: ContinuationProblem,
    first: ContinuationPoint,
    tangent: Floats,
    bounds: tuple[float, float],
    longest: float,
    most: int,
    to_special: bool,
) -> tuple[list[ContinuationPoint], list[SpecialPoint], str]:
    """Follow a branch one way; return its points after the first, their special points, and why it ends."""
    points = [first]
    special: list[SpecialPoint] = []
    meeting: Meeting | None = None

    def beside(here: Floats, step: Floats) -> Floats | None:
        nonlocal meeting
        meeting = Meeting.between(path, here, step)
        if meeting is None or not bounds[0] <= meeting.unknowns[-1] <= bounds[1]:
            return None
        return meeting.beside

    def visit(along: Floats, unknowns: Floats, turned: bool) -> str | None:
        point = path.evaluate(unknowns)
        within = BranchSegment(path, points[-1], point, along).special_points(turned)
        special.extend(replace(item, segment=len(points) - 1) for item in within)
        points.append(point)
        return "special" if to_special and within else None

    end = follow_path(path, first.unknowns, tangent, [(len(tangent) - 1, *bounds)], longest, most, visit, beside)
    if end == "together" and meeting is not None:
        graze = {"admissible": points[-1].admissible, "impact": meeting.impact, "segment": len(points) - 1}
        at_meeting = path.evaluate(meeting.unknowns)
        points.append(replace(at_meeting, multipliers=np.full_like(at_meeting.multipliers, np.nan)))
        special.append(special_point_at(path, points[-1], "GR", "", **graze))
    return points[1:], special, end


def _branch(
    path: ContinuationProblem,
    parameter: Parameter,
    points: list[ContinuationPoint],
    special: tuple[SpecialPoint, ...],
    ends: tuple[str, str],
) -> OrbitBranch:
    multipliers = np.array([point.multipliers for point in points])
    if path.pattern.symmetric:
        with np.errstate(invalid="ignore", over="ignore"):
            multipliers = multipliers * multipliers
    isolated = np.array([point.isolated for point in points])
    admissible = np.array([point.admissible for point in points])
    stable = np.all(np.abs(multipliers) < 1.0, axis=1)
    period = path.pattern.multiple
    least_period = np.array([path.impacts(point.unknowns).repeats_after() == period for point in points])
    return OrbitBranch(
        **curve_fields(path, points),
        parameter=parameter,
        values=np.array([point.values.value(parameter) for point in points]),
        multipliers=multipliers,
        isolated=isolated,
        admissible=admissible,
        stable=stable,
        verified=isolated & admissible & stable & least_period,
        excess=np.array([point.excess for point in points]) * path.length,
        special_points=special,
        ends=ends,
    )


@in_own_period
def branch_observables(oscillator: Oscillator, branch: OrbitBranch, wanted: Observables) -> Floats:
    """Return the values (m, count) of the wanted observables, each over its orbit's period.

    NaN for orbits that are not admissible.

    Parameters
    ----------
    oscillator : Oscillator
        The oscillator of the branch, where the factors of bias and forces are 1.
    """
    observer, structure = OrbitObserver(oscillator, wanted), ParameterPoint.of(oscillator, 1.0, 1.0).structure
    figures = np.full((len(branch.points), wanted.count), np.nan)
    for i in np.flatnonzero(branch.admissible).tolist():
        impacts = ImpactSequence(branch.period, branch.stops, branch.phases[i], branch.velocities[i], branch.symmetric)
        values = branch.points[i]
        applied = values.applied(oscillator)
        if values.structure != structure:  # an observer has the modes of a structure
            observer, structure = OrbitObserver(applied, wanted), values.structure
        figures[i] = observer.figures(applied, values.omega, values.clearance, impacts)
    return figures
