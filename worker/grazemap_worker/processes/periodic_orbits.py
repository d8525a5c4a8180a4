"""The process periodic-orbits: an orbit near requested impacts, or near the motion to which a trajectory settles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import PeriodicOrbitsRequest
from grazemap.wire.orbits import OrbitRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import period_cost, period_cost_at_point, setup_seconds
from grazemap_worker.planning.limits import Count, RequestLimits
from grazemap_worker.processes import other_starts
from grazemap_worker.processes.conversion import core_clearance, core_oscillator, empty_record, empty_value, fields
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.trajectories import motion_document

if TYPE_CHECKING:
    from grazemap_core.model.oscillator import Oscillator
    from grazemap_core.orbits.periodic_orbits import PeriodicOrbit
    from grazemap_core.orbits.simulated_orbits import SimulatedOrbit
    from grazemap_core.simulation.trajectories import Trajectory


def expected_periods(request: OrbitRequest) -> float:
    """Return the expected number of simulated forcing periods until there is an initial guess of the orbit."""
    if request.motion is None:
        return float(request.transient_periods + _recorded_periods(request))
    return rates.SEARCH_PERIODS if request.motion.phases is None else 0.0


def _recorded_periods(request: OrbitRequest) -> int:
    """Return the number of forcing periods, after the transient ones, in which the motion is looked for."""
    return 2 * request.max_period


def expected_seconds(request: OrbitRequest) -> float:
    """Return the expected processor time of finding the orbit."""
    periods = expected_periods(request)
    seconds = periods * period_cost(request.oscillator, request.omega, request.clearance) / rates.PERIODS_PER_SECOND
    if request.observed:
        seconds += rates.OBSERVED_ORBIT_SECONDS
    return seconds + setup_seconds(request.oscillator)


def counts(request: OrbitRequest, limits: RequestLimits) -> list[Count]:
    """Return the count of the transient periods; there are none if the motion is given."""
    if request.motion is not None:
        return []
    return [Count("/transient_periods", "periods", request.transient_periods, limits.tile_periods)]


NOTHING_FOUND = (
    "no motion with these stops was met by trajectories from rest and from random states. "
    "Remedy: give its phases and velocities too, or another frequency or clearance."
)
NOT_PERIODIC = (
    "the trajectory did not close within {} forcing periods: the motion may be chaotic or quasi-periodic, or "
    "has not settled. Remedy: give the orbit as motion, (period, stops), more transient_periods or a larger max_period."
)
_OTHER_START = "Remedy: give the motion as (period, stops), another initial state, or a smaller clearance."


def compute(request: PeriodicOrbitsRequest, report: Report) -> ClassDocument:
    """Return the orbit, or the reason why there is none. Raises CoreError.

    An orbit on which the contact rests is taken from the simulation.
    """
    from grazemap_core.errors import LinearisationError
    from grazemap_core.orbits.simulated_orbits import simulated_orbit

    oscillator = core_oscillator(request.oscillator)
    run = _settled(oscillator, request) if request.motion is None else None
    if run is not None and run.motion.kind == "periodic" and run.motion.sticking:
        try:
            clearance = core_clearance(request.clearance)
            simulated = simulated_orbit(oscillator, request.omega, clearance, run, request.max_period)
        except LinearisationError as error:
            return _no_orbit(request, str(error), _further(request, str(error)))
        return _simulated(simulated, _further(request, simulated))
    orbit = orbit_asked_for(oscillator, request, run)
    further = _further(request, orbit)
    return _no_orbit(request, orbit, further) if isinstance(orbit, str) else _document(orbit, further)


def _further(request: PeriodicOrbitsRequest, orbit: PeriodicOrbit | SimulatedOrbit | str) -> Document:
    """Return the fields of observables and outputs of an orbit, and of other starts than that of its trajectory.

    Observables are NaN if there is no orbit or it is not admissible.
    """
    from grazemap_core.orbits.orbit_observables import of_orbit

    others: Document = {}
    if request.initial is not None:
        others = other_starts.at_point(request, request.other_starts, request.initial, request.max_period)
    wanted = core_observables(request)
    if wanted is None:
        return others
    figures = wanted.nothing
    if not isinstance(orbit, str):
        figures = of_orbit(core_oscillator(request.oscillator), orbit, wanted)
    return observed_document(request, figures) | others


def orbit_asked_for(
    oscillator: Oscillator, request: OrbitRequest, run: Trajectory | None = None
) -> PeriodicOrbit | str:
    """Return the requested orbit, or the reason why there is no initial guess of it.

    `run` is the settled trajectory, if it is known already.
    """
    from grazemap_core import codes
    from grazemap_core.errors import ParameterError
    from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
    from grazemap_core.orbits.periodic_orbits import periodic_orbit
    from grazemap_core.orbits.search import sequence_of_stops
    from grazemap_core.simulation.motion import REASONS

    motion, clearance = request.motion, core_clearance(request.clearance)
    if motion is None:
        run = run or _settled(oscillator, request)
        try:
            guess = impacts_of(run)
        except ParameterError as error:
            if run.motion.reason == REASONS[codes.NOT_CLOSED]:
                return NOT_PERIODIC.format(request.max_period)
            return run.motion.reason or f"the trajectory {error.message}. {_OTHER_START}"
    elif motion.phases is not None and motion.velocities is not None:
        guess = ImpactSequence.create(motion.period, motion.stops, motion.phases, motion.velocities)
    else:
        sequence = sequence_of_stops(oscillator, request.omega, clearance, motion.period, motion.stops)
        if sequence is None:
            return NOTHING_FOUND
        guess = sequence
    return periodic_orbit(oscillator, request.omega, clearance, guess)


def _settled(oscillator: Oscillator, request: OrbitRequest) -> Trajectory:
    """Return the trajectory from `initial`; its settled motion is the initial guess of the orbit."""
    from grazemap_core.simulation.trajectories import trajectory

    initial = request.initial
    assert initial is not None  # the model sets it if both were left out
    return trajectory(
        oscillator,
        request.omega,
        core_clearance(request.clearance),
        None if initial.displacement is None else np.array(initial.displacement),
        np.array(initial.velocity),
        initial.phase,
        periods=_recorded_periods(request),
        transient_periods=request.transient_periods,
        samples_per_period=1,
        max_period=request.max_period,
    )


def _document(orbit: PeriodicOrbit, further: Document) -> ClassDocument:
    whole = orbit.impacts.whole
    return document_of(
        results.PeriodicOrbit,
        orbit,
        **clearances(orbit.clearance),
        found_by="equations",
        reason=orbit.reason or None,
        period=orbit.impacts.period,
        **fields(whole, "stops", "phases", "velocities"),
        times=whole.phases / orbit.omega,
        sticking=empty_value(results.PeriodicOrbit.schema["sticking"]),
        motion=motion_document(orbit.motion),
        **further,
    )


def _simulated(orbit: SimulatedOrbit, further: Document) -> ClassDocument:
    """Return the document of an orbit on which the contact rests. It is from the simulation, and is not verified."""
    impacts, sticking = orbit.impacts, orbit.sticking
    return document_of(
        results.PeriodicOrbit,
        orbit,
        **clearances(orbit.clearance),
        converged=True,
        found_by="simulation",
        reason=orbit.motion.reason,
        period=orbit.motion.period,
        stops=impacts.stop.astype(np.int64),
        phases=orbit.omega * impacts.time,
        times=impacts.time,
        velocities=impacts.velocity,
        sticking=document_of(results.Sticking, sticking, stop=sticking.stop.astype(np.int64)),
        residual=orbit.closing,
        **dict.fromkeys(("kantorovich", "radius", "excess", "excess_phase"), np.nan),
        physical=True,
        contacts="none",
        excess_stop=0,
        motion=motion_document(orbit.motion),
        **further,
    )


def clearances(clearance: float | tuple[float | None, float | None]) -> Document:
    """Return the fields of the clearance: a single one for both stops or, if they differ, NaN and one for each stop."""
    if not isinstance(clearance, tuple):
        return {"clearance": clearance}
    right, left = (np.nan if gap is None else gap for gap in clearance)
    if right == left:
        return {"clearance": right}
    return {"clearance": np.nan, "clearance_right": right, "clearance_left": left}


def _no_orbit(request: PeriodicOrbitsRequest, reason: str, further: Document) -> ClassDocument:
    """Return the document of an orbit that was not found: it has no impacts, and its unknown numbers are NaN."""
    from grazemap_core.simulation.motion import Motion

    count = request.oscillator.size
    unknown = np.full(count, np.nan)
    empty = empty_record(
        results.PeriodicOrbit.schema,
        omega=request.omega,
        **clearances(core_clearance(request.clearance)),
        found_by="equations",
        reason=reason,
        period=0 if request.motion is None else request.motion.period,
        multipliers=np.full((2 * count, 2), np.nan),
        contacts="not searched",
        start={"displacement": unknown, "velocity": unknown, "phase": 0.0},
        motion=motion_document(Motion(kind="unresolved", reason=reason)),
    )
    return document_of(results.PeriodicOrbit, **empty, **further)


PROCESS = Process(
    whole=compute,
    periods=expected_periods,
    seconds=lambda request: expected_seconds(request) + other_starts.seconds_at_point(request, request.other_starts),
    counts=counts,
    longest_period_cost=period_cost_at_point,
    kernels="orbits",
    runs_lanes=lambda request: bool(request.other_starts),
    notes=other_starts.notes,
)
