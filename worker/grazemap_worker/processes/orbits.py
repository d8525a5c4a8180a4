"""The processes periodic-orbits and orbit-branches: an orbit near some impacts, and the branch that it belongs to."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.models import OrbitBranchesRequest, PeriodicOrbitsRequest
from grazemap_worker.processes.core_objects import core_oscillator
from grazemap_worker.processes.trajectories import motion_document

if TYPE_CHECKING:
    from grazemap_core.impact_sequences import ImpactSequence
    from grazemap_core.orbit_special_points import SpecialPoint
    from grazemap_core.oscillator import Oscillator
    from grazemap_core.periodic_orbits import PeriodicOrbit

NOTHING_FOUND = "no motion with these stops was met by trajectories from rest and from random states"


def compute_orbit(request: PeriodicOrbitsRequest, report: Callable[[int, int], object]) -> Document:
    """Return the orbit, or why there is none. Raises CoreError."""
    oscillator = core_oscillator(request.oscillator)
    orbit = _orbit(oscillator, request)
    return _no_orbit(request, orbit) if isinstance(orbit, str) else _document(orbit)


def compute_branch(request: OrbitBranchesRequest, report: Callable[[int, int], object]) -> Document:
    """Return the branch of the orbit; one without points, and the reason, where there is no orbit. Raises CoreError."""
    from grazemap_core.orbit_branches import orbit_branch
    from grazemap_core.orbit_walks import ENDS

    oscillator = core_oscillator(request.oscillator)
    report(0, 2)
    orbit = _orbit(oscillator, request)
    if not isinstance(orbit, str) and not orbit.converged:
        orbit = orbit.reason
    if isinstance(orbit, str):
        return _no_branch(request, orbit)
    report(1, 2)
    branch = orbit_branch(
        oscillator, orbit, request.range.start, request.range.stop, request.vary, max_points=request.max_points
    )
    stops, phases, velocities = branch.stops, branch.phases, branch.velocities
    if branch.symmetric:  # half of the impacts are solved for: the others are their mirror images, half a period later
        stops = np.concatenate([stops, -stops])
        phases = np.hstack([phases, phases + np.pi * branch.period])
        velocities = np.hstack([velocities, -velocities])
    return {
        "parameter": branch.values,
        "omega": branch.omega,
        "clearance": branch.clearance,
        "stops": stops,
        "period": branch.period,
        "symmetric": branch.symmetric,
        "phases": phases,
        "velocities": velocities,
        "multipliers": _pairs(branch.multipliers),
        "stable": branch.stable,
        "admissible": branch.admissible,
        "excess": branch.excess,
        "residual": branch.residual,
        "special_points": [_special(point, request.vary) for point in branch.special_points],
        "ends": np.array([ENDS[end] for end in branch.ends]),
        "reason": None,
    }


def _orbit(oscillator: Oscillator, request: PeriodicOrbitsRequest) -> PeriodicOrbit | str:
    """Return the orbit that is asked for, or why there is nothing to begin with."""
    from grazemap_core.periodic_orbits import periodic_orbit

    guess = _guess(oscillator, request)
    return guess if isinstance(guess, str) else periodic_orbit(oscillator, request.omega, request.clearance, guess)


def _guess(oscillator: Oscillator, request: PeriodicOrbitsRequest) -> ImpactSequence | str:
    from grazemap_core.errors import ParameterError
    from grazemap_core.impact_sequences import ImpactSequence, impacts_of
    from grazemap_core.orbit_search import sequence_of_stops
    from grazemap_core.trajectory import trajectory

    motion, initial = request.motion, request.initial
    if motion is not None:
        if motion.phases is not None and motion.velocities is not None:
            return ImpactSequence.create(motion.period, motion.stops, motion.phases, motion.velocities)
        found = sequence_of_stops(oscillator, request.omega, request.clearance, motion.period, motion.stops)
        return NOTHING_FOUND if found is None else found
    assert initial is not None  # filled in where both were left out
    run = trajectory(
        oscillator,
        request.omega,
        request.clearance,
        np.array(initial.displacement),
        np.array(initial.velocity),
        initial.phase,
        periods=2 * request.max_period,
        transient_periods=request.transient_periods,
        samples_per_period=1,
        max_period=request.max_period,
    )
    try:
        return impacts_of(run)
    except ParameterError as error:
        return str(error) + (f": {run.motion.reason}" if run.motion.reason else "")


def _document(orbit: PeriodicOrbit) -> Document:
    whole = orbit.impacts.whole
    return {
        "omega": orbit.omega,
        "clearance": orbit.clearance,
        "converged": orbit.converged,
        "reason": orbit.reason or None,
        "period": orbit.impacts.period,
        "stops": whole.stops,
        "phases": whole.phases,
        "times": whole.phases / orbit.omega,
        "velocities": whole.velocities,
        "residual": orbit.residual,
        "kantorovich": orbit.kantorovich,
        "radius": orbit.radius,
        "certified": orbit.certified,
        "multipliers": _pairs(orbit.multipliers),
        "stable": orbit.stable,
        "physical": orbit.physical,
        "admissible": orbit.admissible,
        "contacts": orbit.contacts,
        "excess": orbit.excess,
        "excess_phase": orbit.excess_phase,
        "excess_stop": orbit.excess_stop,
        "start": {
            "displacement": orbit.start.displacement,
            "velocity": orbit.start.velocity,
            "phase": orbit.start.phase,
        },
        "motion": motion_document(orbit.motion),
    }


def _no_orbit(request: PeriodicOrbitsRequest, reason: str) -> Document:
    """Return the document of an orbit that was not found: no impacts, numbers that are not."""
    from grazemap_core.motion import Motion

    count = request.oscillator.size
    nothing, nowhere = np.zeros(0), np.full(count, np.nan)
    return {
        "omega": request.omega,
        "clearance": request.clearance,
        "converged": False,
        "reason": reason,
        "period": 0 if request.motion is None else request.motion.period,
        "stops": np.zeros(0, dtype=np.int64),
        **dict.fromkeys(("phases", "times", "velocities"), nothing),
        **dict.fromkeys(("residual", "kantorovich", "radius", "excess", "excess_phase"), np.nan),
        "certified": False,
        "multipliers": np.full((2 * count, 2), np.nan),
        **dict.fromkeys(("stable", "physical", "admissible"), False),
        "contacts": "not searched",
        "excess_stop": 0,
        "start": {"displacement": nowhere, "velocity": nowhere, "phase": 0.0},
        "motion": motion_document(Motion(kind="unresolved", reason=reason)),
    }


def _no_branch(request: OrbitBranchesRequest, reason: str) -> Document:
    """Return the document of a branch without points."""
    nothing = np.zeros(0)
    return {
        **dict.fromkeys(("parameter", "omega", "clearance", "excess", "residual"), nothing),
        "stops": np.zeros(0, dtype=np.int64),
        "period": 0 if request.motion is None else request.motion.period,
        "symmetric": False,
        **dict.fromkeys(("phases", "velocities"), np.zeros((0, 0))),
        "multipliers": np.zeros((0, 2 * request.oscillator.size, 2)),
        **dict.fromkeys(("stable", "admissible"), np.zeros(0, dtype=np.bool_)),
        "special_points": [],
        "ends": np.array(["", ""]),
        "reason": reason,
    }


def _special(point: SpecialPoint, vary: str) -> dict[str, Any]:
    whole = point.impacts.whole
    return {
        "type": point.type,
        "parameter": point.clearance if vary == "clearance" else point.omega,
        "clearance": point.clearance,
        "omega": point.omega,
        "status": point.status,
        "admissible": point.admissible,
        "segment": point.segment,
        "stop": point.stop,
        "phase": point.phase,
        "impact": point.impact,
        "phases": whole.phases,
        "velocities": whole.velocities,
    }


def _pairs(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return complex numbers (...) as real and imaginary parts, (..., 2): JSON has no others."""
    return np.stack([values.real, values.imag], axis=-1)
