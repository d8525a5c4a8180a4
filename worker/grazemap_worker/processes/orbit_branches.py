"""The process orbit-branches: the branch of a periodic orbit over a parameter, and the branches that meet it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.wire import OrbitBranchesRequest
from grazemap.wire.orbits import MAX_IMPACTS
from grazemap.wire.process import LONGEST_PERIOD
from grazemap_worker.processes.conversion import EVIDENCE, Report, core_oscillator, fields, pairs
from grazemap_worker.processes.periodic_orbits import orbit_asked_for
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap_core.continuation.branch_switching import OrbitStart
    from grazemap_core.continuation.special_points import SpecialPoint

_PER_POINT = ("omega", "clearance", "restitution", "excess", "residual")


def compute(request: OrbitBranchesRequest, report: Report) -> Document:
    """Return the branch of the orbit; without an orbit, a branch without points and the reason. Raises CoreError."""
    from grazemap_core.continuation.branch_switching import starts_beyond
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.continuation.pseudo_arclength import ENDS

    oscillator = core_oscillator(request.oscillator)
    report(0, 3)
    orbit = orbit_asked_for(oscillator, request)
    if not isinstance(orbit, str) and not orbit.converged:
        orbit = orbit.reason
    if isinstance(orbit, str):
        return _no_branch(request, orbit)
    report(1, 3)
    branch = orbit_branch(
        oscillator, orbit, request.range.start, request.range.stop, request.vary, max_points=request.max_points
    )
    report(2, 3)
    beyond = [starts_beyond(oscillator, point, request.vary) for point in branch.special_points]
    stops, phases, velocities = whole_period(
        branch.stops, branch.phases, branch.velocities, branch.period, branch.symmetric
    )
    return {
        "parameter": branch.values,
        **fields(branch, *_PER_POINT, *EVIDENCE, "period", "symmetric"),
        "stops": stops,
        "phases": phases,
        "velocities": velocities,
        "multipliers": pairs(branch.multipliers),
        "special_points": [
            _special(request, point, starts) for point, starts in zip(branch.special_points, beyond, strict=True)
        ],
        "ends": np.array([ENDS[end] for end in branch.ends]),
        "reason": None,
    }


def whole_period(
    stops: NDArray[np.int64],
    phases: NDArray[np.float64],
    velocities: NDArray[np.float64],
    period: int,
    symmetric: bool,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return stops (k,), phases and velocities (m, k) of all impacts of a period, from what was solved for.

    For symmetric motions half of the impacts are solved for; the others are mirror images, half a period later.
    """
    if not symmetric:
        return stops, phases, velocities
    return (
        np.concatenate([stops, -stops]),
        np.hstack([phases, phases + np.pi * period]),
        np.hstack([velocities, -velocities]),
    )


def _no_branch(request: OrbitBranchesRequest, reason: str) -> Document:
    """Return the document of a branch without points."""
    nothing = np.zeros(0)
    return {
        **dict.fromkeys(("parameter", *_PER_POINT), nothing),
        "stops": np.zeros(0, dtype=np.int64),
        "period": 0 if request.motion is None else request.motion.period,
        "symmetric": False,
        **dict.fromkeys(("phases", "velocities"), np.zeros((0, 0))),
        "multipliers": np.zeros((0, 2 * request.oscillator.size, 2)),
        **dict.fromkeys(EVIDENCE, np.zeros(0, dtype=np.bool_)),
        "special_points": [],
        "ends": np.array(["", ""]),
        "reason": reason,
    }


def _special(request: OrbitBranchesRequest, point: SpecialPoint, beyond: tuple[OrbitStart, ...]) -> dict[str, Any]:
    whole = point.impacts.whole
    return {
        **fields(point, "type", "clearance", "omega", "restitution", "status", "admissible"),
        **fields(point, "segment", "stop", "phase", "impact"),
        "parameter": getattr(point, request.vary),
        **fields(whole, "phases", "velocities"),
        "beyond": [
            {"admissible": start.admissible, "request": _request(request, start)}
            for start in beyond
            # a doubled motion may have too many impacts or periods for a request
            if len(start.impacts.whole.stops) <= MAX_IMPACTS and start.impacts.whole.period <= LONGEST_PERIOD
        ],
    }


def _request(request: OrbitBranchesRequest, start: OrbitStart) -> dict[str, Any]:
    """Return the request for an orbit beyond a special point; with a range, it is a request for its branch."""
    impacts = start.impacts.whole
    return {
        "oscillator": {**request.oscillator.model_dump(mode="json"), "restitution": start.restitution},
        "omega": start.omega,
        "clearance": start.clearance,
        "motion": {
            "period": impacts.period,
            "stops": impacts.stops.tolist(),
            "phases": impacts.phases.tolist(),
            "velocities": impacts.velocities.tolist(),
        },
    }


PROCESS = Process(whole=compute)
