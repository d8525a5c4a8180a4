"""The process trajectories: samples, impacts, intervals of sticking, motion and end of one or more trajectories."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import InitialState, TrajectoriesRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import Points, observed_seconds, period_cost, period_cost_at_point, setup_seconds
from grazemap_worker.planning.limits import BYTES_PER_NUMBER, MAX_RESULT_BYTES, Count, RequestLimits
from grazemap_worker.processes import other_starts
from grazemap_worker.processes.conversion import core_clearance, core_oscillator, label, reporting_progress
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.simulation.motion import Motion
    from grazemap_core.simulation.start import State
    from grazemap_core.simulation.trajectories import Trajectory


def _periods(request: TrajectoriesRequest) -> float:
    return float(len(request.states) * (request.transient_periods + request.periods))


def _seconds(request: TrajectoriesRequest) -> float:
    seconds = (
        _periods(request) * period_cost(request.oscillator, request.omega, request.clearance) / rates.PERIODS_PER_SECOND
    )
    size = request.oscillator.size
    sample = size * (rates.SAMPLE_MASS_SECONDS + rates.SAMPLE_SQUARE_SECONDS * size)
    seconds += setup_seconds(request.oscillator) + len(request.states) * request.samples * sample
    points = Points.create([(request.omega, request.clearance)])
    seconds += other_starts.seconds_at_point(request, request.other_starts)
    return seconds + len(request.states) * observed_seconds(request, request.oscillator, points, request.periods)


def _counts(request: TrajectoriesRequest, limits: RequestLimits) -> list[Count]:
    states, periods = len(request.states), request.periods + request.transient_periods
    samples = states * request.samples
    sampled = "/samples_per_period" if request.times is None else "/times"
    if states * periods > limits.tile_periods >= periods:
        return [Count("/initial", "periods", states * periods, limits.tile_periods)]
    # a sample has the time, and displacement and velocity of every mass
    sample_bytes = BYTES_PER_NUMBER * (1 + 2 * request.oscillator.size)
    return [
        Count("/periods", "periods", states * periods, limits.tile_periods),
        Count(sampled, "samples", samples, limits.points),
        Count(sampled, "bytes", samples * sample_bytes, limits.result_bytes),
    ]


# The default of unfolding maps, so that trajectories and maps give a motion the same label.
MAX_PERIOD = 32
NOT_VERIFIED = (
    "a trajectory is simulated, and no orbit is solved for. Remedy: solve for the orbit (periodic-orbits), which is "
    "verified where that can be decided."
)
# Number of progress reports while a list of trajectories is computed.
REPORTS = 20


def compute(request: TrajectoriesRequest, report: Report) -> ClassDocument:
    """Return a trajectory or, for a list of initial states, a list of trajectories. Raises CoreError."""
    from grazemap_core.simulation.start import forced_oscillator
    from grazemap_core.simulation.trajectories import trajectories

    oscillator, clearance = core_oscillator(request.oscillator), core_clearance(request.clearance)
    rest: NDArray[np.float64] | None = None
    if any(state.displacement is None for state in request.states):
        rest = forced_oscillator(oscillator, request.omega, clearance).displacement_at_rest
    computed = trajectories(
        oscillator,
        request.omega,
        clearance,
        [_state(state, rest) for state in request.states],
        request.periods,
        request.transient_periods,
        request.samples_per_period,
        MAX_PERIOD,
        None if request.times is None else np.array(request.times),
        MAX_RESULT_BYTES,
    )
    observed = _observed(request)
    if isinstance(request.initial, InitialState):
        trajectory = next(computed)
        others = other_starts.at_point(request, request.other_starts, request.initial, MAX_PERIOD)
        return _document(trajectory, observed(trajectory) | others)
    documents = [
        _document(trajectory, observed(trajectory))
        for trajectory in reporting_progress(computed, len(request.states), report, REPORTS)
    ]
    return document_of(results.Trajectories, trajectories=documents)


def _observed(request: TrajectoriesRequest) -> Callable[[Trajectory], Document]:
    """Return a function that returns the fields of observables and outputs of a trajectory."""
    from grazemap_core.simulation.observables import of_record
    from grazemap_core.simulation.start import forced_oscillator

    wanted = core_observables(request)
    if wanted is None:
        return lambda trajectory: {}
    oscillator, clearance = core_oscillator(request.oscillator), core_clearance(request.clearance)
    models = forced_oscillator(oscillator, request.omega, clearance).structure.models
    return lambda trajectory: observed_document(request, of_record(trajectory.record, models, wanted, request.periods))


def _state(state: InitialState, rest: NDArray[np.float64] | None) -> State:
    from grazemap_core.simulation.start import State

    # the model sets a displacement that was left out, unless the rest position is not 0
    displacement = rest if state.displacement is None else np.array(state.displacement)
    assert displacement is not None
    return State(displacement, np.array(state.velocity), state.phase)


def _document(trajectory: Trajectory, observed: Document) -> ClassDocument:
    return document_of(
        results.Trajectory, trajectory, motion=motion_document(_explained(trajectory.motion)), **observed
    )


def _explained(motion: Motion) -> Motion:
    """Return the motion that a trajectory settles to, with the reason why a periodic one is not verified."""
    from grazemap_core import codes
    from grazemap_core.simulation.motion import REASONS

    if motion.kind != "periodic":
        return motion
    return replace(motion, reason=REASONS[codes.STICKS] if motion.sticking else NOT_VERIFIED)


def motion_document(motion: Motion) -> Document:
    """Return the document of a motion of the core, with its label; unknown values are None."""
    return document_of(results.Motion, **vars(motion), label=label(motion))


PROCESS = Process(
    whole=compute,
    periods=_periods,
    seconds=_seconds,
    counts=_counts,
    longest_period_cost=period_cost_at_point,
    kernels="trajectories",
    runs_lanes=lambda request: bool(request.other_starts),
    notes=other_starts.notes,
)
