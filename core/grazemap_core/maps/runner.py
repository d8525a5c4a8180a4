"""Runs of many trajectories until their motions can be named; common to maps, basins and borders."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from typing import Any, Final

import numpy as np

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.codes import HIDDEN_BY_ROUNDING, RESOLVED
from grazemap_core.contact.forced import ForcedStructure
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.runs import new_run
from grazemap_core.contact.stops import STOPS_UNIT, Clearance, both_clearances, stops_table, unit_of_stops
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.classification import classify_lane
from grazemap_core.maps.kernels.first_pass import PITCH
from grazemap_core.maps.kernels.lane_errors import LaneErrors
from grazemap_core.maps.kernels.lane_scheduler import settle_column
from grazemap_core.maps.kernels.lane_state import (
    ENDED_EARLY,
    Column,
    ColumnStarts,
    ColumnTask,
    TrajectoryResults,
    final_states,
    lane_records,
    return_search,
)
from grazemap_core.maps.kernels.lane_tables import (
    LANES,
    OF_GROUP,
    SHARED_TABLES,
    LaneModel,
    LaneModels,
    SeparateModels,
    TablesPerLane,
    lane_tables,
    separate_tables,
)
from grazemap_core.maps.kernels.lane_tangents import RECORDED_IMPACTS, lane_tangents
from grazemap_core.maps.kernels.lanes import lanes
from grazemap_core.maps.kernels.second_pass import WIDTH as SECOND_PASS
from grazemap_core.maps.kernels.tangent_batches import BATCH as CHANGES
from grazemap_core.maps.map_observables import figures_of_column
from grazemap_core.maps.map_settings import (
    AboutMiddle,
    AtRest,
    BetweenStops,
    Conditions,
    FromState,
    RunSettings,
    Start,
)
from grazemap_core.maps.tolerances import GROWTH_SHARE, GROWTH_SKIPPED, LAST_RUNNERS, MOST_GROWTH_PERIODS
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.harmonic_response import hidden_by_rounding, reference_response
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit.compiled import PART_COMPILER, compile_for
from grazemap_core.orbits.kernels.verification import ImpulseBlocks, verification_scratch
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.period_detection import stroboscopic_history
from grazemap_core.simulation.start import OUTSIDE, ForcedOscillator, State, touched_stop


class SeparateRuns(NamedTuple):
    """Trajectories from rest of one structure, each at a frequency of its own."""

    runner: Runner
    """The structure and the settings."""
    forced: Sequence[ForcedStructure]
    """k of them: the structure at these frequencies."""
    conditions: Conditions
    """The conditions of the trajectories."""


class RunEnd(NamedTuple):
    """How and where the last trajectory of a sweep ended, in the arrays of the kernels."""

    ended: int
    """ENDED_EARLY, MOVES or RESTS."""
    state: Floats
    """(N, 2) The state at the end."""
    square: float
    """Square of its error, as of `LaneErrors`."""
    sensitive: int
    """1 if a decision may be wrong, as of `LaneErrors`."""


class Runner:
    """Settings and scratch for runs of one oscillator."""

    def __init__(self, oscillator: Oscillator, settings: RunSettings, before: Runner | None = None) -> None:
        """Allocate lanes, histories and tangents; nothing is run.

        With `before` those of that runner are used, so that a sweep goes on with its errors. Its settings may differ in
        `max_periods` only, and its oscillator has the same size. Neither runner is to be run while the other one is:
        runners that share scratch belong to one thread.
        """
        size, harmonics = oscillator.size, len(oscillator.forces)
        self._models = trajectory_models(oscillator)
        free = self._models.free
        self._blocks = impulse_blocks(free, settings.early)
        self._settings = settings
        self._equilibrium = equilibrium(oscillator)
        direction = np.concatenate([self._models.constrained.profile, np.zeros(size)])
        self._aside = np.ascontiguousarray((free.to_modal @ direction).reshape(size, 2))
        growth_periods = min(math.ceil(GROWTH_SHARE * settings.max_periods), MOST_GROWTH_PERIODS)
        self._growth_halves = 2 * growth_periods if settings.linearised else 0
        self._size = size
        self._scratch: dict[str, Any]
        if before is None or len(before.oscillator.forces) != harmonics:
            events = RECORDED_IMPACTS if settings.linearised or settings.early else 0
            self._scratch = {
                "group": lanes(size, events),
                "history": stroboscopic_history(size, settings.max_period, LANES),
                "tangents": lane_tangents(size, harmonics, self._growth_halves),
                "records": lane_records(),
                "returns": return_search(),
                "run": new_run(size, harmonics, events),
                "verification": verification_scratch(size, harmonics),
                "final_state": np.zeros((size, 2)),
            }
        else:
            self._scratch = before._scratch
            if before._growth_halves != self._growth_halves:
                tangents = lane_tangents(size, harmonics, self._growth_halves)._replace(errors=before.errors)
                self._scratch = {**self._scratch, "tangents": tangents}
        self._separate: list[TablesPerLane] = [] if before is None else before._separate  # one, where they were needed
        self._steady: dict[float, Complexes] = {}
        self._last_models: tuple[float, float, LaneModels] | None = None
        self._ended = ENDED_EARLY  # no trajectory was run

    @property
    def oscillator(self) -> Oscillator:
        """The oscillator."""
        return self._models.oscillator

    @property
    def errors(self) -> LaneErrors:
        """The errors of the lanes: those with which the trajectories of a sweep are handed on."""
        errors: LaneErrors = self._scratch["tangents"].errors
        return errors

    def at(self, omega: float, among: Floats | None = None) -> ForcedStructure:
        """Return the structure at a forcing frequency.

        Its steady motion at all frequencies `among` (m,) is computed at once, and kept.
        """
        if omega not in self._steady:
            frequencies = np.array([omega]) if among is None else among
            steady = reference_response(self.oscillator, self._models.free, frequencies)
            self._steady = dict(zip(frequencies.tolist(), steady, strict=True))
        # a new one each time: the arrays of all of them, which the kernels take, would fill the memory
        return ForcedStructure(self._models, omega, self._steady[omega])

    def run(
        self,
        forced: ForcedStructure,
        conditions: Conditions | Floats,
        start: Start,
        phase: float = 0.0,
        inherits: bool = False,
        goes_on: bool = False,
    ) -> tuple[Integers, Floats]:
        """Run one trajectory for each of the conditions and each initial state.

        Parameters
        ----------
        forced : ForcedStructure
            From `at`, or of an equal oscillator.
        conditions : Conditions, or (n,) or (n, 2)
            The latter are clearances as `Conditions.of` takes them.
        start : Start
            The s states in which trajectories begin.
        phase : float
            Phase of the forcing at the start.
        inherits : bool
            Whether a single trajectory, or the first one of a sweep, begins with the error that the previous single one
            had at its end.
        goes_on : bool
            Whether the first trajectory of a sweep follows the last one of the previous run, of the same structure at
            the same frequency; if that ended early, it begins at `start`.

        Returns
        -------
        codes, figures : (n, s, CODES) and (n, s, FIGURES), with further columns for what is observed
        """
        if not isinstance(conditions, Conditions):
            conditions = Conditions.of(self._models.oscillator, conditions)
        models = self._models_at(forced, phase)
        starts = self._begin(forced, models.shared.forced.free, conditions, start, phase)
        column = self._column(models, starts, inherits, goes_on)
        self._ended = settle_column(self._size, column, SHARED_TABLES, classify_lane.address(column))
        figures, observed = column.results.figures, self._settings.observed
        if observed is not None:
            more = figures_of_column(observed, forced, models.shared.forced, starts.stops, column.results)
            figures = np.concatenate([figures, more], axis=1)
        bound = models.shared.forced.free.steady_bound
        return _named(column.results.codes, figures, starts.stops, conditions.forcing, bound)

    def compile_classification(self) -> None:
        """Compile, or load, the kernel that names motions, for all numbers of masses; nothing is run."""
        classify_lane.compile(self._example()[0])

    def compile_lockstep(self, separate: bool = False) -> None:
        """Compile, or load, the kernel that carries lanes, with all that goes before it; no trajectory is run.

        The kernel is for any number of masses: for lanes that share their tables, or for lanes `separate`.
        """
        column, model = self._example()
        tables = self._separate_tables(model.forced.free.cells) if separate else SHARED_TABLES
        if separate:
            SeparateModels([model])
        compile_for(settle_column, self._size, column, tables, classify_lane.address(column))

    def _example(self) -> tuple[Column, LaneModel]:
        """Return what the kernels take, and the model of its trajectories."""
        conditions = Conditions.of(self._models.oscillator, np.ones(1))
        forced = self.at(1.0)
        models = self._models_at(forced, 0.0)
        starts = self._begin(forced, models.shared.forced.free, conditions, AtRest(), 0.0)
        return self._column(models, starts), models.shared

    def _begin(
        self, forced: ForcedStructure, problem: CellProblem, conditions: Conditions, start: Start, phase: float
    ) -> ColumnStarts:
        """Return where the trajectories of `run` begin."""
        gaps = self._gaps(conditions)
        count = len(gaps)
        stops = stops_table(self._models.oscillator, gaps, conditions.restitution, problem.cells, problem.steady_bound)
        scaled = start.scaled if isinstance(start, BetweenStops | AboutMiddle) else np.zeros((1, *self._shape))
        offset, on_stop = np.zeros(count), np.zeros(count * len(scaled), dtype=np.int64)
        if isinstance(start, AtRest):
            state = np.zeros(self._shape)
            offset, on_stop = _preload(gaps)
        elif isinstance(start, FromState):
            state, on_stop[0] = self._impact_at_start(conditions, start.state)
            state = self._from_equilibrium(conditions, state)
        elif isinstance(start, BetweenStops):
            state = self._from_equilibrium(conditions, start.origin)
        else:
            state = self._from_equilibrium(conditions, np.zeros(self._shape))
            offset = middle_of_stops(conditions, stops[:, STOPS_UNIT])
        return ColumnStarts(
            stops=stops,
            base=np.repeat(forced.free_state(state[0], state[1], phase)[None], count, axis=0),
            directions=_in_blocks(self._models.free, scaled),
            offset=offset,
            aside=np.repeat(self._aside[None], count, axis=0),
            on_stop=on_stop,
        )

    @property
    def _shape(self) -> tuple[int, int]:
        """Shape of a state."""
        return 2, self._size

    def _models_at(self, forced: ForcedStructure, phase: float) -> LaneModels:
        """Return the structure at a frequency and a phase, shared by all lanes; that of the last run is kept."""
        if self._last_models is None or self._last_models[:2] != (forced.omega, phase):
            self._last_models = forced.omega, phase, shared_model(self._model(forced, phase))
        return self._last_models[2]

    def _model(self, forced: ForcedStructure, phase: float) -> LaneModel:
        """Return the structure at a frequency and a phase for the kernels."""
        kernels = forced.at_phase(phase)
        return LaneModel(kernels, lane_tables(kernels), self._blocks)

    def _column(
        self, models: LaneModels, starts: ColumnStarts, inherits: bool = False, goes_on: bool = False
    ) -> Column:
        """Return what the kernels take."""
        count, settings = len(starts.on_stop), self._settings
        results = TrajectoryResults(
            codes=np.empty((count, lane_state.CODES), dtype=np.int64),
            figures=np.empty((count, lane_state.FIGURES)),
            final=final_states(count if settings.observed is not None else 0, self._size),
        )
        of_column = ColumnTask(
            starts=starts,
            max_periods=settings.max_periods,
            max_period=settings.max_period,
            early=settings.early,
            follow=settings.follow,
            growth_halves=self._growth_halves,
            growth_skipped=2 * (self._growth_halves // GROWTH_SKIPPED),
            inherits=inherits,
            ended=self._ended if goes_on else ENDED_EARLY,
        )
        return Column(models, of_column, results, **self._scratch)

    def final_state(self, forced: ForcedStructure, conditions: Conditions, phase: float = 0.0) -> Floats | None:
        """Return displacements and velocities (2, N) at the end of the last run, at the phase at which it began.

        None if the settings have not `follow`, if nothing was run, or for a trajectory that ended early, after which a
        sweep starts at rest. The arguments are those of the last trajectory.
        """
        if self._ended == ENDED_EARLY:
            return None
        moved = self._models.free.from_modal @ self._scratch["final_state"].ravel() + forced.reference_state(phase)
        state = conditions.forcing[-1] * moved.reshape(self._shape)
        state[0] += conditions.bias[-1] * self._equilibrium
        return np.asarray(state)

    @property
    def end(self) -> RunEnd:
        """The end of the last run, from which another one may go on later; the settings have `follow`."""
        errors = self.errors
        return RunEnd(
            self._ended, self._scratch["final_state"].copy(), float(errors.square[0]), int(errors.sensitive[0])
        )

    def return_to(self, end: RunEnd) -> None:
        """Take an earlier end of a run as that of the last one."""
        self._ended, self._scratch["final_state"][:] = end.ended, end.state
        self.errors.square[0], self.errors.sensitive[0] = end.square, end.sensitive

    def within(self, conditions: Conditions, state: Floats, rests: bool) -> FromState:
        """Return a start from a state (2, N), with the contact moved onto the stop that it is beyond.

        `rests`: it has no velocity there. This is what kernels do in a sweep, `put_between_stops`.
        """
        right, left = conditions.clearance[0].tolist()
        place, velocity = self.oscillator.between(state[0], (right, left)), state[1]
        if rests and touched_stop(self.oscillator, (right, left), place) != 0:
            velocity = self.oscillator.with_contact(velocity, 0.0)
        return FromState(np.stack([place, velocity]))

    def random_states(self, forced: ForcedStructure, clearance: Clearance, start: AboutMiddle) -> Floats:
        """Return the states (s, 2, N) of `AboutMiddle`."""
        unit = self.unit(forced, clearance)
        conditions = Conditions.of(self.oscillator, np.array([both_clearances(clearance)]))
        states = unit * start.scaled
        states[:, 0] += middle_of_stops(conditions, np.array([unit]))[0] * self._models.constrained.profile
        return np.asarray(states)

    def _separate_tables(self, cells: int) -> TablesPerLane:
        """Return scratch for lanes that have their own tables, with so many cells in a period or fewer."""
        size, known = self._size, self._separate
        if not known or len(known[0].tables[OF_GROUP].steady_table) < 2 * (cells + 1):
            batches = [separate_tables(size, pitch, 1) for pitch in (PITCH, SECOND_PASS, CHANGES)]
            known[:] = [TablesPerLane(1 + len(batches), (separate_tables(size, LANES, cells), *batches))]
        return known[0]

    def unit(self, forced: ForcedStructure, clearance: Clearance) -> float:
        """Return the unit of the stops in which initial states are given, `Stops.unit`."""
        conditions = Conditions.of(self._models.oscillator, np.array([both_clearances(clearance)]))
        right, left = self._gaps(conditions)[0].tolist()
        return float(unit_of_stops(right, left, forced.kernels.free.steady_bound))

    def _gaps(self, conditions: Conditions) -> Floats:
        """Return the gaps of the stops from the equilibrium, (k, 2), over the factors of the forces."""
        place = float(self._models.oscillator.contact @ self._equilibrium) * conditions.bias[:, None]
        return np.asarray((conditions.clearance - place * np.array([1.0, -1.0])) / conditions.forcing[:, None])

    def _from_equilibrium(self, conditions: Conditions, state: Floats) -> Floats:
        """Return a state (2, N) from the equilibrium, over the factor of the forces."""
        scaled = state / conditions.forcing[0]
        scaled[0] -= conditions.bias[0] / conditions.forcing[0] * self._equilibrium
        return np.asarray(scaled)

    def _impact_at_start(self, conditions: Conditions, state: Floats) -> tuple[Floats, int]:
        """Return a state (2, N) after the impact with which a trajectory may begin there, and the stop it is on."""
        oscillator = self._models.oscillator
        right, left = conditions.clearance[0].tolist()
        stop = touched_stop(oscillator, (right, left), state[0])
        if stop == OUTSIDE:
            stop = 0
        velocity = math.fsum(oscillator.contact * state[1])
        if stop * velocity > 0.0:
            restitution = float(conditions.restitution[0, 0 if stop > 0 else 1])
            state = np.stack([state[0], oscillator.with_contact(state[1], -restitution * velocity)])
        return state, stop

    def run_from(
        self, forced: ForcedOscillator, start: State, inherits: bool = False
    ) -> tuple[Integers, Floats, State | None]:
        """Run one trajectory from a state, and return its codes (CODES,), its figures (FIGURES,) and its end.

        The end is that of `final_state`, with the contact between the stops. `inherits` as in `run`.
        """
        begin = FromState(np.stack([start.displacement, start.velocity]))
        conditions = Conditions.of(self.oscillator, np.array([forced.clearances]))
        codes, figures = self.run(forced.structure, conditions, begin, start.phase, inherits)
        end = self.final_state(forced.structure, conditions, start.phase)
        if end is not None:
            end = self.within(conditions, end, self._ended == lane_state.RESTS).state
        return codes[0, 0], figures[0, 0], None if end is None else State(end[0], end[1], start.phase)


class Runners:
    """Runners with the same settings, which share their scratch; the last ones are kept."""

    def __init__(self, settings: RunSettings) -> None:
        """Take the settings of all runners."""
        self._settings = settings
        self._kept: dict[Hashable, Runner] = {}

    def of(self, oscillator: Oscillator) -> Runner:
        """Return the runner of an oscillator, the same one for the same object."""
        return self.keyed(oscillator, lambda: oscillator)

    def keyed(self, key: Hashable, oscillator: Callable[[], Oscillator]) -> Runner:
        """Return the runner that has this key; if there is none, that of an oscillator, which then has it."""
        if key not in self._kept:
            before = next(reversed(self._kept.values()), None)
            while len(self._kept) >= LAST_RUNNERS:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = Runner(oscillator(), self._settings, before)
        return self._kept[key]


CAN_SEPARATE: Final = PART_COMPILER is not None
"""Whether lanes may have tables of their own; else trajectories that share none run one after the other."""


def run_separate(structures: Sequence[SeparateRuns]) -> tuple[Integers, Floats]:
    """Run trajectories side by side, each of which has tables of its own.

    The runners have the same settings, without initial states, sweeps and observables, and share their scratch.

    Returns
    -------
    codes, figures : (n, 1, CODES) and (n, 1, FIGURES)
    """
    models, bases, rest = [], [], np.zeros(structures[0].runner.oscillator.size)
    for runner, at_frequencies, _ in structures:
        models += [runner._model(forced, 0.0) for forced in at_frequencies]
        bases += [forced.free_state(rest, rest, 0.0) for forced in at_frequencies]
    aside, gaps, offset, on_stop = (np.concatenate(parts) for parts in zip(*map(_rest_of, structures), strict=True))
    restitution, forcing = (
        np.concatenate([getattr(runs.conditions, name) for runs in structures]) for name in ("restitution", "forcing")
    )
    cells = np.array([model.forced.free.cells for model in models])
    amplitude = np.array([model.forced.free.steady_bound for model in models])
    first = structures[0].runner
    codes = np.empty((len(models), 1, lane_state.CODES), dtype=np.int64)
    figures = np.empty((len(models), 1, lane_state.FIGURES))
    for number in np.unique(cells).tolist():
        which = np.flatnonzero(cells == number)
        stops = stops_table(first.oscillator, gaps[which], restitution[which], number, amplitude[which])
        separate = SeparateModels([models[i] for i in which.tolist()])
        base = np.stack([bases[i] for i in which.tolist()])
        nothing = np.zeros((1, *base.shape[1:]))
        starts = ColumnStarts(stops, base, nothing, offset[which], aside[which], on_stop[which])
        column = first._column(separate.models, starts)
        settle_column(first._size, column, first._separate_tables(number), classify_lane.address(column))
        codes[which], figures[which] = _named(
            column.results.codes, column.results.figures, stops, forcing[which], amplitude[which]
        )
    return codes, figures


def _rest_of(runs: SeparateRuns) -> tuple[Floats, Floats, Floats, Integers]:
    """Return `aside`, the gaps, `offset` and `on_stop` of trajectories from rest."""
    gaps = runs.runner._gaps(runs.conditions)
    return np.repeat(runs.runner._aside[None], len(gaps), axis=0), gaps, *_preload(gaps)


def _named(
    codes: Integers, figures: Floats, stops: Floats, forcing: Floats, steady_bound: float | Floats
) -> tuple[Integers, Floats]:
    """Return the results of trajectories, (n, s, ..), in the unit of the oscillator.

    `forcing` (n,) are the factors of their forces, `steady_bound` bounds their steady motions.
    """
    codes = codes.reshape(len(stops), -1, codes.shape[1])
    figures = figures.reshape(len(stops), -1, figures.shape[1])
    figures[:, :, lane_state.LEAST_VELOCITY] *= forcing[:, None]
    hidden = hidden_by_rounding(steady_bound, stops[:, STOPS_UNIT])
    if np.any(hidden):
        codes[hidden, :, : lane_state.HALVES_RUN], figures[hidden] = 0, np.nan
        codes[hidden, :, lane_state.REASON], codes[hidden, :, lane_state.SETTLED_AFTER] = HIDDEN_BY_ROUNDING, -1
        codes[hidden, :, lane_state.UNVERIFIED], codes[hidden, :, lane_state.SENSITIVE] = RESOLVED, 0
    return codes, figures


def shared_model(model: LaneModel) -> LaneModels:
    """Return a model that all trajectories share, as kernels take it."""
    return LaneModels(model, np.zeros(LANES, dtype=np.int64), np.zeros(0, dtype=np.int64))


def _preload(gaps: Floats) -> tuple[Floats, Integers]:
    """Return `offset` and `on_stop` of `ColumnStarts`: trajectories from rest begin held by a preloaded stop."""
    preloaded = gaps < 0.0
    offset = np.where(preloaded[:, 0], gaps[:, 0], np.where(preloaded[:, 1], -gaps[:, 1], 0.0))
    return offset, preloaded[:, 0].astype(np.int64) - preloaded[:, 1]


def middle_of_stops(conditions: Conditions, unit: Floats) -> Floats:
    """Return the middle of the range of the contact coordinate of `AboutMiddle`, (k,), for stops of a unit (k,)."""
    right, left = (conditions.clearance / conditions.forcing[:, None]).T
    with np.errstate(invalid="ignore"):
        both = 0.5 * (right - left)
    single = np.minimum(right - unit, 0.0) + np.maximum(unit - left, 0.0)
    return np.asarray(np.where(np.isfinite(both), both, single))


def impulse_blocks(model: ModalModel, wanted: bool) -> ImpulseBlocks:
    """Return the blocks as verification takes them; `wanted`: motions are to be verified.

    The response of the contact to an impulse on it is 0 for blocks that it does not see.
    """
    response, unit_impulse = impulse_response(model), np.zeros((len(model.decay), 2))
    unit_impulse[response.seen] = np.stack([response.value, response.slope], axis=1)
    verifiable = wanted and not bool(np.any(model.undamped))
    return ImpulseBlocks(np.sqrt(model.frequency_squared), unit_impulse, verifiable)


def _in_blocks(model: ModalModel, states: Floats) -> Floats:
    """Return physical states (s, 2, N) in block coordinates, (s, N, 2)."""
    count, _, size = states.shape
    flat = states.reshape(count, 2 * size)
    result = np.zeros((count, 2 * size))
    # term by term: the roundings of a product of matrices depend on the number of states
    for c in np.flatnonzero(np.any(flat, axis=0)).tolist():
        result += flat[:, c : c + 1] * model.to_modal[:, c]
    return result.reshape(count, size, 2)
