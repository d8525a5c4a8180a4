"""The processes periodic-orbits and orbit-branches: an orbit near some impacts, and the branch that it belongs to."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap.codec import Document
from grazemap.wire import OrbitBranchesRequest, PeriodicOrbitsRequest
from grazemap.wire.orbits import MAX_IMPACTS
from grazemap.wire.process import LONGEST_PERIOD
from grazemap_worker.processes.conversion import core_oscillator
from grazemap_worker.processes.trajectories import motion_document

if TYPE_CHECKING:
    from grazemap_core.continuation.branch_switching import OrbitStart
    from grazemap_core.continuation.special_points import SpecialPoint
    from grazemap_core.model.oscillator import Oscillator
    from grazemap_core.orbits.impact_sequences import ImpactSequence
    from grazemap_core.orbits.periodic_orbits import PeriodicOrbit
    from grazemap_core.orbits.simulated_orbits import SimulatedOrbit
    from grazemap_core.simulation.start import State
    from grazemap_core.simulation.trajectories import Trajectory

NOTHING_FOUND = "no motion with these stops was met by trajectories from rest and from random states"


def compute_orbit(request: PeriodicOrbitsRequest, report: Callable[[int, int], object]) -> Document:
    """Return the orbit, or why there is none; one that rests on a stop as the simulation has it. Raises CoreError."""
    from grazemap_core.errors import LinearisationError
    from grazemap_core.orbits.simulated_orbits import simulated_orbit

    oscillator = core_oscillator(request.oscillator)
    run = _settled(oscillator, request) if request.motion is None else None
    if run is not None and run.motion.kind == "periodic" and run.motion.sticking:
        try:
            found = simulated_orbit(oscillator, request.omega, request.clearance, run, request.max_period)
        except LinearisationError as error:
            return _no_orbit(request, str(error))
        return _simulated(found)
    orbit = _orbit(oscillator, request, run)
    return _no_orbit(request, orbit) if isinstance(orbit, str) else _document(orbit)


def compute_branch(request: OrbitBranchesRequest, report: Callable[[int, int], object]) -> Document:
    """Return the branch of the orbit; one without points, and the reason, where there is no orbit. Raises CoreError."""
    from grazemap_core.continuation.branch_switching import starts_beyond
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.continuation.pseudo_arclength import ENDS

    oscillator = core_oscillator(request.oscillator)
    report(0, 3)
    orbit = _orbit(oscillator, request)
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
        "omega": branch.omega,
        "clearance": branch.clearance,
        "restitution": branch.restitution,
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

    Of symmetric motions that is half of them: the others are their mirror images, half a period later.
    """
    if not symmetric:
        return stops, phases, velocities
    return (
        np.concatenate([stops, -stops]),
        np.hstack([phases, phases + np.pi * period]),
        np.hstack([velocities, -velocities]),
    )


def _orbit(
    oscillator: Oscillator, request: PeriodicOrbitsRequest, run: Trajectory | None = None
) -> PeriodicOrbit | str:
    """Return the orbit that is asked for, or why there is nothing to begin with; `run` if it has settled already."""
    from grazemap_core.orbits.periodic_orbits import periodic_orbit

    guess = _guess(oscillator, request, run)
    return guess if isinstance(guess, str) else periodic_orbit(oscillator, request.omega, request.clearance, guess)


def _guess(oscillator: Oscillator, request: PeriodicOrbitsRequest, run: Trajectory | None) -> ImpactSequence | str:
    from grazemap_core.errors import ParameterError
    from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
    from grazemap_core.orbits.search import sequence_of_stops

    motion = request.motion
    if motion is not None:
        if motion.phases is not None and motion.velocities is not None:
            return ImpactSequence.create(motion.period, motion.stops, motion.phases, motion.velocities)
        found = sequence_of_stops(oscillator, request.omega, request.clearance, motion.period, motion.stops)
        return NOTHING_FOUND if found is None else found
    run = run or _settled(oscillator, request)
    try:
        return impacts_of(run)
    except ParameterError as error:
        return str(error) + (f": {run.motion.reason}" if run.motion.reason else "")


def _settled(oscillator: Oscillator, request: PeriodicOrbitsRequest) -> Trajectory:
    """Follow the trajectory that the orbit is looked for with."""
    from grazemap_core.simulation.trajectories import trajectory

    initial = request.initial
    assert initial is not None  # filled in where both were left out
    return trajectory(
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


def _document(orbit: PeriodicOrbit) -> Document:
    whole = orbit.impacts.whole
    return {
        "omega": orbit.omega,
        "clearance": orbit.clearance,
        "converged": orbit.converged,
        "found_by": "equations",
        "reason": orbit.reason or None,
        "period": orbit.impacts.period,
        "stops": whole.stops,
        "phases": whole.phases,
        "times": whole.phases / orbit.omega,
        "velocities": whole.velocities,
        "sticking": _rests((), (), ()),
        "residual": orbit.residual,
        "kantorovich": orbit.kantorovich,
        "radius": orbit.radius,
        "certified": orbit.isolated,
        "multipliers": _pairs(orbit.multipliers),
        "stable": orbit.stable,
        "physical": orbit.physical,
        "admissible": orbit.admissible,
        "contacts": orbit.contacts,
        "excess": orbit.excess,
        "excess_phase": orbit.excess_phase,
        "excess_stop": orbit.excess_stop,
        "start": _state(orbit.start),
        "motion": motion_document(orbit.motion),
    }


def _simulated(orbit: SimulatedOrbit) -> Document:
    """Return the document of a motion with rests: it is not verified, and its reason says how it was found."""
    impacts, sticking = orbit.impacts, orbit.sticking
    return {
        "omega": orbit.omega,
        "clearance": orbit.clearance,
        "converged": True,
        "found_by": "simulation",
        "reason": orbit.motion.reason,
        "period": orbit.motion.period,
        "stops": impacts.stop.astype(np.int64),
        "phases": orbit.omega * impacts.time,
        "times": impacts.time,
        "velocities": impacts.velocity,
        "sticking": _rests(sticking.start, sticking.stop_time, sticking.stop),
        "residual": orbit.closing,
        **dict.fromkeys(("kantorovich", "radius", "excess", "excess_phase"), np.nan),
        "certified": orbit.isolated,
        "multipliers": _pairs(orbit.multipliers),
        "stable": orbit.stable,
        "physical": True,
        "admissible": orbit.admissible,
        "contacts": "none",
        "excess_stop": 0,
        "start": _state(orbit.start),
        "motion": motion_document(orbit.motion),
    }


def _rests(start: ArrayLike, stop_time: ArrayLike, stop: ArrayLike) -> Document:
    return {
        "start": np.asarray(start, dtype=np.float64),
        "stop_time": np.asarray(stop_time, dtype=np.float64),
        "stop": np.asarray(stop, dtype=np.int64),
    }


def _state(state: State) -> Document:
    return {"displacement": state.displacement, "velocity": state.velocity, "phase": state.phase}


def _no_orbit(request: PeriodicOrbitsRequest, reason: str) -> Document:
    """Return the document of an orbit that was not found: no impacts, numbers that are not."""
    from grazemap_core.simulation.motion import Motion

    count = request.oscillator.size
    nothing, nowhere = np.zeros(0), np.full(count, np.nan)
    return {
        "omega": request.omega,
        "clearance": request.clearance,
        "converged": False,
        "found_by": "equations",
        "reason": reason,
        "period": 0 if request.motion is None else request.motion.period,
        "stops": np.zeros(0, dtype=np.int64),
        **dict.fromkeys(("phases", "times", "velocities"), nothing),
        "sticking": _rests((), (), ()),
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
        **dict.fromkeys(("parameter", "omega", "clearance", "restitution", "excess", "residual"), nothing),
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


def _special(request: OrbitBranchesRequest, point: SpecialPoint, beyond: tuple[OrbitStart, ...]) -> dict[str, Any]:
    whole = point.impacts.whole
    return {
        "type": point.type,
        "parameter": getattr(point, request.vary),
        "clearance": point.clearance,
        "omega": point.omega,
        "restitution": point.restitution,
        "status": point.status,
        "admissible": point.admissible,
        "segment": point.segment,
        "stop": point.stop,
        "phase": point.phase,
        "impact": point.impact,
        "phases": whole.phases,
        "velocities": whole.velocities,
        "beyond": [
            {"admissible": start.admissible, "request": _request(request, start)}
            for start in beyond
            if _can_be_asked(start.impacts.whole)
        ],
    }


def _can_be_asked(impacts: ImpactSequence) -> bool:
    """Say whether a motion is within what requests may name: doubled ones may have too many impacts or periods."""
    return len(impacts.stops) <= MAX_IMPACTS and impacts.period <= LONGEST_PERIOD


def _request(request: OrbitBranchesRequest, start: OrbitStart) -> dict[str, Any]:
    """Return an orbit beyond a special point as the request of it: with a range, as that of its branch."""
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


def _pairs(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return complex numbers (...) as real and imaginary parts, (..., 2): JSON has no others."""
    return np.stack([values.real, values.imag], axis=-1)
