"""The process orbit-branches: the branch of a periodic orbit over a parameter, and the branches that meet it."""

from __future__ import annotations

from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import OrbitBranchesRequest
from grazemap.wire.orbits import MAX_IMPACTS
from grazemap.wire.planes import is_structural, with_parameter
from grazemap.wire.states import LONGEST_PERIOD
from grazemap.wire.structure import as_pair
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import (
    Points,
    branch_point_seconds,
    contact_force,
    period_cost_at_point,
    period_impacts,
)
from grazemap_worker.processes import periodic_orbits
from grazemap_worker.processes.conversion import core_oscillator, empty_record, fields, varying_oscillator
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.periodic_orbits import clearances, orbit_asked_for
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.continuation.branch_switching import OrbitStart
    from grazemap_core.continuation.branches import OrbitBranch
    from grazemap_core.continuation.parameters import ParameterPoint
    from grazemap_core.continuation.special_points import SpecialPoint


def _seconds(request: OrbitBranchesRequest) -> float:
    if request.motion is not None:
        impacts = float(len(request.motion.stops))
    else:
        point = Points.create([(request.omega, request.clearance)])
        impacts = min(float(period_impacts(request.oscillator, point)[0]), rates.MAX_ORBIT_IMPACTS)
    points = min(2 * request.max_points, _points(request)) + rates.BRANCH_SPECIAL_POINTS
    branch = points * branch_point_seconds(request.oscillator, impacts)
    if is_structural(request.axis.vary):
        modes = rates.BRANCH_MODES_SECONDS + rates.SETUP_MASS_SECONDS * request.oscillator.size**2
        branch += points * rates.BRANCH_STRUCTURES * modes
    if request.observed:
        branch += points * rates.OBSERVED_ORBIT_SECONDS
    return periodic_orbits.expected_seconds(request) + branch


def _points(request: OrbitBranchesRequest) -> float:
    """Return the expected number of points in both directions.

    In a narrow range a branch turns, and its phases and speeds change more than the parameter. In the rest of a wide
    range they do not.
    """
    unit = abs(request.value) if request.axis.vary == "omega" or is_structural(request.axis.vary) else 1.0
    if request.axis.vary.startswith("clearance"):
        point = Points.create([(request.omega, request.clearance)])
        unit = float(point.width(contact_force(request.oscillator, point.omega)[1])[0])
    steps = (request.axis.ends[1] - request.axis.ends[0]) / (rates.BRANCH_STEP * (unit or 1.0))
    turning = min(steps * rates.BRANCH_POINTS_A_STEP, rates.BRANCH_POINTS_TURNING + steps)
    return rates.BRANCH_POINTS + turning


_STOP_FIELDS = ("clearance_right", "clearance_left", "restitution_right", "restitution_left", "bias", "forcing")
# Parameters that change both stops alike, so that branches over them have none of the fields above.
_SHARED_PARAMETERS = ("clearance", "omega", "restitution")


def compute(request: OrbitBranchesRequest, report: Report) -> ClassDocument:
    """Return the branch of the orbit or, if there is no orbit, an empty branch with the reason. Raises CoreError."""
    from grazemap_core.continuation.branch_switching import starts_beyond
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.continuation.pseudo_arclength import ENDS

    oscillator = varying_oscillator(request.oscillator, request.axis.vary)
    report(0, 3)
    orbit = orbit_asked_for(oscillator, request)
    if not isinstance(orbit, str) and not orbit.converged:
        orbit = orbit.reason
    if isinstance(orbit, str):
        return _no_branch(request, orbit)
    report(1, 3)
    branch = orbit_branch(oscillator, orbit, *request.axis.ends, request.axis.vary, max_points=request.max_points)
    report(2, 3)
    beyond = [starts_beyond(oscillator, point, request.axis.vary) for point in branch.special_points]
    stops, phases, velocities = whole_period(
        branch.stops,
        branch.phases,
        branch.velocities,
        branch.period / branch.divisor,
        branch.symmetric,
    )
    return document_of(
        results.OrbitBranch,
        branch,
        parameter=branch.values,
        **{name: finite(branch.values_of(name)) for name in _stop_fields(request)},
        stops=stops,
        phases=phases,
        velocities=velocities,
        special_points=[
            _special(request, point, starts) for point, starts in zip(branch.special_points, beyond, strict=True)
        ],
        ends=np.array([ENDS[end] for end in branch.ends]),
        reason=None,
        **_observed(request, branch),
    )


def _observed(request: OrbitBranchesRequest, branch: OrbitBranch | None) -> Document:
    """Return the fields of observables and outputs of a branch, or of an empty branch."""
    from grazemap_core.continuation.branches import branch_observables

    wanted = core_observables(request)
    if wanted is None:
        return {}
    figures = np.zeros((0, wanted.count))
    if branch is not None:
        figures = branch_observables(core_oscillator(request.oscillator), branch, wanted)
    return observed_document(request, figures.T)


def _stop_fields(request: OrbitBranchesRequest) -> tuple[str, ...]:
    """Return the names of the fields of single stops and forces; none if the parameter changes both stops alike."""
    both = as_pair(request.clearance)
    alike = both.right == both.left and isinstance(core_oscillator(request.oscillator).restitution_left, NoneType)
    return () if alike and request.axis.vary in _SHARED_PARAMETERS else _STOP_FIELDS


def finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with NaN in place of infinity, which is the clearance of an absent stop."""
    return np.where(np.isinf(values), np.nan, values)


def whole_period(
    stops: NDArray[np.int64],
    phases: NDArray[np.float64],
    velocities: NDArray[np.float64],
    turns: float,
    symmetric: bool,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return stops (k,), phases and velocities (m, k) of all impacts of a period, from those that were solved for.

    For symmetric motions only half of the impacts are solved for; the others are their mirror images, half a period
    later. `turns` is the number of turns of the phase in a period.
    """
    if not symmetric:
        return stops, phases, velocities
    return (
        np.concatenate([stops, -stops]),
        np.hstack([phases, phases + np.pi * turns]),
        np.hstack([velocities, -velocities]),
    )


def _no_branch(request: OrbitBranchesRequest, reason: str) -> ClassDocument:
    """Return the document of an empty branch."""
    empty = empty_record(
        results.OrbitBranch.schema,
        period=0 if request.motion is None else request.motion.period,
        multipliers=np.zeros((0, 2 * request.oscillator.size, 2)),
        ends=np.array(["", ""]),
        reason=reason,
    )
    stop_fields = dict.fromkeys(_stop_fields(request), np.zeros(0))
    return document_of(results.OrbitBranch, **empty, **stop_fields, **_observed(request, None))


def _special(request: OrbitBranchesRequest, point: SpecialPoint, beyond: tuple[OrbitStart, ...]) -> Document:
    whole = point.impacts.whole
    return document_of(
        results.SpecialPoint,
        point,
        parameter=point.values.value(request.axis.vary),
        clearance=clearances(point.clearance)["clearance"],
        **{name: float(finite(np.array(getattr(point.values, name)))) for name in _stop_fields(request)},
        reason=point.reason or None,
        phases=whole.phases,
        velocities=whole.velocities,
        **fields(point, "stop", "phase", "impact"),
        beyond=[
            document_of(results.Beyond, admissible=start.admissible, request=_request(request, start))
            for start in beyond
            # a period-doubled motion may have too many impacts or periods for a request
            if len(start.impacts.whole.stops) <= MAX_IMPACTS and start.impacts.whole.period <= LONGEST_PERIOD
        ],
    )


def _request(request: OrbitBranchesRequest, start: OrbitStart) -> dict[str, Any]:
    """Return the request for an orbit beyond a special point. A client adds a range to request the branch of it."""
    impacts, clearance = start.impacts.whole, start.clearance
    return {
        "oscillator": _oscillator(request, start.values),
        "omega": start.omega,
        "clearance": dict(zip(("right", "left"), clearance, strict=True))
        if isinstance(clearance, tuple)
        else clearance,
        "motion": {
            "period": impacts.period,
            "stops": impacts.stops.tolist(),
            "phases": impacts.phases.tolist(),
            "velocities": impacts.velocities.tolist(),
        },
    }


def _oscillator(request: OrbitBranchesRequest, values: ParameterPoint) -> dict[str, Any]:
    """Return the oscillator of a request with the parameters of a point."""
    described = request.oscillator
    named = {"restitution_right": values.restitution_right, "restitution_left": values.restitution_left}
    named |= {name: factor for name in ("bias", "forcing") if (factor := getattr(values, name)) != 1.0}
    for name, value in (named | dict(values.structure)).items():
        described = with_parameter(described, name, value)
    oscillator: dict[str, Any] = described.model_dump(mode="json")
    return oscillator


PROCESS = Process(
    whole=compute,
    periods=periodic_orbits.expected_periods,
    seconds=_seconds,
    counts=periodic_orbits.counts,
    longest_period_cost=period_cost_at_point,
    kernels="orbits",
)
