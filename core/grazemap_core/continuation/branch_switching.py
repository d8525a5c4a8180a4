"""Branch switching: orbits of the other branches that pass through a special point.

At a PD the other branch has twice the period; at an SB it is one of the pair of motions that are not symmetric; at a GR
its orbits have one impact more, or less. Where a branch ends on another branch, the switch leads to that branch. SN and
NS have no other branch (theory, "Any impacting orbit").
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.continuation.parameters import Parameter, ParameterOrbit, ParameterPoint, symmetric_stops
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.continuation.tolerances import MERGED_ORBITS, SWITCH_STEPS
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class OrbitStart(ParameterOrbit):
    """An orbit of another branch next to a special point."""

    values: ParameterPoint
    """The parameters of the orbit; all but the branch's parameter are those of the special point."""
    impacts: ImpactSequence
    """The impacts of the orbit."""
    admissible: bool
    """Whether the orbit is a motion. For a GR, a motion on either side is chosen; if there is none, the orbit at the
    graze itself."""


@in_own_period
def starts_beyond(
    oscillator: Oscillator, point: SpecialPoint, parameter: Parameter = "clearance"
) -> tuple[OrbitStart, ...]:
    """Return starts of the branches that a special point leads to.

    Parameters
    ----------
    oscillator : Oscillator
    point : SpecialPoint
        Special point of a branch of this oscillator, which is that with the factors 1 of bias and forces.
    parameter : str
        What varies along the branches: one of `parameters.PARAMETERS`.

    Returns
    -------
    tuple of OrbitStart
        PD, SB: one. GR: one; of symmetric motions also a second one, which gains or loses the contact on one stop only
        (its mirror image is not listed). Empty for SN and NS, if only the motion without impacts remains, and if
        Newton's method does not converge.

    Raises
    ------
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`.
    """
    if point.type == "GR":
        choices = _sequences_at_graze(point, symmetric_stops(oscillator, point.values))
        starts = [_from_graze(oscillator, point, parameter, *choice) for choice in choices]
    elif point.type in ("PD", "SB"):
        parent = merged(point.impacts, point.type == "SB")
        if parent is not None:
            path, guess = ContinuationProblem.through(oscillator, parent, parameter, point.values)
            solution = path.correct(guess, np.eye(len(guess))[-1])
            starts = [None if solution is None else _start(path, solution[0])]
        else:
            starts = [_born(oscillator, point, parameter)]
    else:
        starts = []
    return tuple(start for start in starts if start is not None)


def merged(impacts: ImpactSequence, mirrored: bool = True) -> ImpactSequence | None:
    """Return the orbit of a smaller period, or the symmetric one, that a sequence coincides with, or None.

    They coincide where a branch ends on another one, to about `MERGED_ORBITS`. Symmetric orbits are looked for if
    `mirrored`: between symmetric stops.
    """
    least = impacts.repeats_after(MERGED_ORBITS)
    if least < impacts.period:
        whole = impacts.whole
        count = len(whole.stops) * least // impacts.period
        first = whole.stops[:count], whole.phases[:count], whole.velocities[:count]
        return ImpactSequence(least, *first, divisor=whole.divisor)
    return impacts.half() if mirrored and not impacts.symmetric and impacts.mirrors(MERGED_ORBITS) else None


def with_graze(impacts: ImpactSequence, phase: float, stop: int) -> tuple[ImpactSequence, int]:
    """Return a sequence with a contact of velocity 0 at a phase and a stop inserted, and the index of that contact."""
    turn = impacts.turn
    spans = math.floor((phase - impacts.phases[0]) / turn)
    phase -= spans * turn
    if impacts.symmetric and spans % 2:
        stop = -stop
    place = int(np.searchsorted(impacts.phases, phase))
    return (
        ImpactSequence(
            impacts.period,
            np.insert(impacts.stops, place, stop),
            np.insert(impacts.phases, place, phase),
            np.insert(impacts.velocities, place, 0.0),
            impacts.symmetric,
            impacts.divisor,
        ),
        place,
    )


def as_on_curve(point: SpecialPoint) -> tuple[ImpactSequence, int | None]:
    """Return the impacts of a point as on its curve, and the number of that which grazes.

    The contact that appears at a graze is one of them. Of impacts that come together only the first one is.
    """
    if point.type != "GR":
        return point.impacts, None
    if point.impact is None:
        return with_graze(point.impacts, float(point.phase or 0.0), int(point.stop or 1))
    return _alone(point.impacts, point.impact)


def _alone(impacts: ImpactSequence, impact: int) -> tuple[ImpactSequence, int]:
    """Return a sequence without the impacts that come together with one, and the number of that one."""
    turn, count = impacts.turn, len(impacts.stops)
    still = np.abs(impacts.velocities) <= MERGED_ORBITS * np.max(np.abs(impacts.velocities))
    others: list[int] = []
    for i in (np.arange(impact + 1, impact + count) % count).tolist():
        after = impacts.phases[i] - impacts.phases[impact] + (turn if i < impact else 0.0)
        if not (still[i] and after <= MERGED_ORBITS * turn):
            break
        others.append(i)
    return _without(impacts, others), impact - sum(i < impact for i in others)


def _start(path: ContinuationProblem, unknowns: Floats) -> OrbitStart:
    point = path.evaluate(unknowns)
    return OrbitStart(point.values, path.impacts(unknowns), point.admissible)


def _born(oscillator: Oscillator, point: SpecialPoint, parameter: Parameter) -> OrbitStart | None:
    """Return an orbit of the branch that bifurcates at a PD or an SB.

    The branch leaves along the perturbation that returns with the opposite sign after a span. The amplitude of the
    perturbation is prescribed, and the parameter is solved for. The amplitude of the parent orbit is 0, so the solution
    is another orbit.
    """
    impacts = point.impacts
    # its equations do not depend on what varies
    parent, unknowns = ContinuationProblem.through(oscillator, impacts, "omega", point.values)
    count, turn = parent.count, parent.turn
    change = np.linalg.svd(parent.doubling_matrix(unknowns))[2][-1]
    shift, unit_impulse = change[:count], change[count:]
    sign = -1 if impacts.symmetric else 1
    twice = ImpactSequence(
        impacts.period if impacts.symmetric else 2 * impacts.period,
        np.concatenate([impacts.stops, sign * impacts.stops]),
        np.concatenate([impacts.phases, impacts.phases + turn]),
        np.concatenate([impacts.velocities, sign * impacts.velocities]),
    )
    path, middle = ContinuationProblem.through(oscillator, twice, parameter, point.values)
    along = np.concatenate([shift, -shift, unit_impulse, -sign * unit_impulse, [0.0]])
    along /= np.linalg.norm(along)
    for amplitude in SWITCH_STEPS:
        solution = path.correct(middle + amplitude * along, along)
        if solution is not None:
            return _start(path, solution[0])
    return None


def _sequences_at_graze(point: SpecialPoint, between_symmetric: bool) -> list[tuple[ImpactSequence, int | None]]:
    """Return the other sequences that solve the equations at a graze, each with the index of its grazing impact.

    Parameters
    ----------
    between_symmetric : bool
        Whether the stops are symmetric.
    """
    impacts, number = point.impacts, point.impact
    if number is None:
        assert point.phase is not None
        assert point.stop is not None
        with_it: list[tuple[ImpactSequence, int | None]] = [with_graze(impacts, point.phase, point.stop)]
        if impacts.symmetric:
            with_it.append(with_graze(impacts.whole, point.phase, point.stop))
        return with_it
    alone, place = _alone(impacts, number)
    if len(alone.stops) < len(impacts.stops):  # the branch ends on that of the sequence with one of these impacts
        return [(alone, place)]
    without: list[tuple[ImpactSequence, int | None]] = []
    if len(impacts.stops) > 1:
        without.append((_without(impacts, number), None))
    if impacts.symmetric:  # the mirror image of the impact remains
        without.append((_without(impacts.whole, number), number + len(impacts.stops) - 1))
    elif (
        between_symmetric and len(impacts.stops) == 1 and impacts.period % 2 == 1
    ):  # the steady motion: it touches both stops
        without.append((replace(impacts, symmetric=True), 0))
    return without


def _without(impacts: ImpactSequence, number: int | list[int]) -> ImpactSequence:
    return replace(
        impacts,
        stops=np.delete(impacts.stops, number),
        phases=np.delete(impacts.phases, number),
        velocities=np.delete(impacts.velocities, number),
    )


def _from_graze(
    oscillator: Oscillator, point: SpecialPoint, parameter: Parameter, impacts: ImpactSequence, graze: int | None
) -> OrbitStart | None:
    """Return an orbit with a sequence that solves the equations at a graze, from the side where it is a motion."""
    path, guess = ContinuationProblem.through(oscillator, impacts, parameter, point.values)
    if graze is None:
        normal = path.direction(guess)
    else:
        guess[path.count + graze] = 0.0
        normal = np.eye(len(guess))[path.count + graze]
    at_graze = path.correct(guess, normal)
    if at_graze is None:
        return None
    tangent = path.direction(at_graze[0])
    for step in SWITCH_STEPS:
        for side in (step, -step):
            solution = path.correct(at_graze[0] + side * tangent, tangent)
            if solution is not None and path.evaluate(solution[0]).admissible:
                return _start(path, solution[0])
    return replace(_start(path, at_graze[0]), admissible=False)
