"""Initial states: validation, conversion to the arrays of the kernels, and back to physical states."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import field
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.forced import ForcedStructure, forced_structures
from grazemap_core.contact.kernels.cells import Forced, reference_at
from grazemap_core.contact.kernels.half_period import Contact, impact_at_stop
from grazemap_core.contact.kernels.runs import (
    ANCHOR,
    ANCHOR_GAP,
    ANCHOR_RATE,
    HELD,
    OK,
    Moment,
    Run,
    new_run,
    put_on_stop,
)
from grazemap_core.contact.kernels.sticking import held_motion, rest_after_impact, start_on_stop
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.contact.stops import Clearance, both_clearances, require_length, stops_of
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.errors import ParameterError, checked_omega
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass
from grazemap_core.simulation.tolerances import COORDINATE_ROUNDING, EVENTS, LENGTH_ROUNDING

OUTSIDE = 2
"""Returned in place of a stop: the contact is beyond a stop."""


@dataclass(frozen=True, eq=False)
class State:
    """A state of the oscillator."""

    displacement: Floats
    """(N,) Displacements."""
    velocity: Floats
    """(N,) Velocities."""
    phase: float = 0.0
    """Phase of the forcing, in radians."""


@dataclass(frozen=True, eq=False)
class ForcedOscillator:
    """An oscillator at one forcing frequency, between its stops."""

    structure: ForcedStructure
    """The structure under its forces."""
    clearance: Clearance
    """Clearances of the stops."""

    @property
    def oscillator(self) -> Oscillator:
        """The oscillator; the orders of its forces have no common divisor but 1."""
        return self.structure.oscillator

    @property
    def omega(self) -> float:
        """Angular frequency of the forces' own period, 2 pi/omega; a multiple of the frequency of the request."""
        return self.structure.omega

    @property
    def stops(self) -> Stops:
        """The stops, with gaps from the equilibrium.

        Raises
        ------
        ParameterError
            Both the gap of the nearer stop and the steady motion are 0: there is no unit of length (`Stops.unit`).
        """
        require_length(self._stops.unit)
        return self._stops

    def stops_from(self, state: State) -> Stops:
        """Return the stops of the trajectory from a state, which provides the unit of length if they have none.

        Raises
        ------
        ParameterError
            The state, too, is to rounding the equilibrium at rest: there is no unit of length.
        """
        stops = self._stops
        if stops.unit > self._unit_rounding:
            return stops
        unit = next((length for length in self._lengths(state) if length > 0.0), stops.unit)
        require_length(unit, "neither the forces nor the initial state move")
        return stops._replace(unit=unit)

    def _lengths(self, state: State) -> Iterator[float]:
        """Yield the lengths of a trajectory from a state; the first one that is not 0 is its unit.

        A contact at rest on its stop gives no length, but other masses may move it later: their lengths are last.
        """
        stops, contact = self._stops, self.oscillator.contact
        between = 0.5 * (stops.right + stops.left)
        yield between if math.isfinite(between) else 0.0
        yield beyond_rounding(*(contact * state.displacement), -self._nearer_stop)
        yield beyond_rounding(*(contact * state.velocity)) / self.omega
        size = float(np.max(np.abs(self.oscillator.jump)))
        pairs = zip(state.displacement, -self.equilibrium, strict=True)
        yield max(beyond_rounding(*pair) for pair in pairs) / size
        yield float(np.max(np.abs(state.velocity))) / (self.omega * size)

    @property
    def _nearer_stop(self) -> float:
        """The contact coordinate at the stop that is nearer to the equilibrium."""
        right, left = self.clearances
        return right if self._stops.right <= self._stops.left else -left

    @cached_property
    def _unit_rounding(self) -> float:
        """Round-off of the gap of the nearer stop, and of the steady motion of the contact."""
        displacements = np.abs(self.equilibrium) + np.sum(np.abs(self.structure.steady[:, 0, :-1]), axis=0)
        return LENGTH_ROUNDING * (abs(self._nearer_stop) + float(np.abs(self.oscillator.contact) @ displacements))

    @cached_property
    def _stops(self) -> Stops:
        """The stops; their unit of length may be 0."""
        bound = self.structure.kernels.free.steady_bound
        return stops_of(self.oscillator, self.clearance, self.structure.cells, bound)

    @cached_property
    def equilibrium(self) -> Floats:
        """The static equilibrium without stops, (N,), from which the kernels measure displacements."""
        return equilibrium(self.oscillator)

    @property
    def clearances(self) -> tuple[float, float]:
        """Clearances of the right and of the left stop from q = 0; infinite for an absent one."""
        return both_clearances(self.clearance)

    @cached_property
    def displacement_at_rest(self) -> Floats:
        """Displacements of the structure at rest, (N,): its equilibrium, or that on a preloaded stop."""
        for stop, clearance in zip((1, -1), self.clearances, strict=True):
            gap = gap_of(self._stops, stop)
            if gap < 0.0:
                moved = self.equilibrium + stop * gap * self.structure.models.constrained.profile
                return self.oscillator.with_contact(moved, stop * clearance)
        return self.equilibrium


@dataclass(eq=False)
class Started:
    """A trajectory in progress. One that starts on a stop and moves into it begins just after this impact."""

    forced: Forced
    """The structure under its forces from the initial phase on, for the kernels."""
    steady: Complexes
    """(H, 2, N + 1) As `ForcedStructure.steady`, the initial phase included."""
    stops: Stops
    """From `ForcedOscillator.stops_from`."""
    run: Run = field(repr=False)
    """The run, whose record contains the impact at the start, if there is one. Kernels change it in place."""
    began: Run = field(repr=False)
    """The run at the start of its half period, which is repeated where the record of events was too short."""
    status: int
    """OK, or the status with which the trajectory ends."""
    halves: int
    """Number of half periods completed."""


def forced_oscillator(oscillator: Oscillator, omega: float, clearance: Clearance) -> ForcedOscillator:
    """Return an oscillator with a forcing frequency > 0 and the clearance of its stops, at its own period.

    One number > 0 is the clearance of both stops. Of a pair, one may be None for an absent stop, or negative if the sum
    is positive.

    Raises
    ------
    ParameterError
        A number is out of range.
    ConditioningError
        The modal model is ill-conditioned.
    """
    oscillator, times = oscillator.at_own_period
    values = checked_omega([times * omega])
    if not isinstance(clearance, tuple) and not clearance > 0.0:
        raise ParameterError("clearance", "of both stops must be greater than 0")
    (structure,) = forced_structures(trajectory_models(oscillator), values)
    forced = ForcedOscillator(structure, clearance)
    _ = forced._stops  # checks them
    return forced


def initial_state(
    forced: ForcedOscillator, displacement: Floats | None, velocity: Floats | None, phase: float, where: str = ""
) -> State:
    """Return a validated state; None stands for `ForcedOscillator.displacement_at_rest`, and for velocities of 0.

    `where` is put before the name of the parameter in an error.

    Raises
    ------
    ParameterError
        A number is not finite, there is not one per mass, the contact is outside the stops, or neither the
        forces nor the state ever move it.
    """
    if not math.isfinite(phase):
        raise ParameterError(f"{where}phase", "must be finite")
    count = forced.oscillator.size
    if displacement is None:
        displacement = forced.displacement_at_rest
    x = _one_per_mass(f"{where}displacement", displacement, count)
    v = _one_per_mass(f"{where}velocity", np.zeros(count) if velocity is None else velocity, count)
    if touched_stop(forced.oscillator, forced.clearances, x) == OUTSIDE:
        raise ParameterError(f"{where}displacement", "the contact starts outside the stops")
    state = State(x, v, phase)
    forced.stops_from(state)  # checks that it has a length
    return state


def touched_stop(oscillator: Oscillator, clearances: tuple[float, float], displacement: Floats) -> int:
    """Return the stop on which the contact is, 0 between the stops, or OUTSIDE.

    If the contact coordinate is a sum of several displacements, the round-off of this sum is allowed for.
    """
    place, rounding = _contact_coordinate(oscillator, displacement)
    for stop, clearance in zip((1, -1), clearances, strict=True):
        if abs(stop * place - clearance) <= rounding:
            return stop
        if stop * place > clearance:
            return OUTSIDE
    return 0


def _contact_coordinate(oscillator: Oscillator, values: Floats) -> tuple[float, float]:
    """Return the contact coordinate of displacements, or its velocity, and the round-off of several terms."""
    terms = oscillator.contact * values
    rounding = COORDINATE_ROUNDING * float(np.sum(np.abs(terms))) if np.count_nonzero(oscillator.contact) > 1 else 0.0
    return math.fsum(terms), rounding


def _one_per_mass(name: str, values: Floats, count: int) -> Floats:
    array = np.array(values, dtype=np.float64)
    if array.shape != (count,) or not np.all(np.isfinite(array)):
        raise ParameterError(name, "must be a list of finite numbers, one per mass")
    return array


def beyond_rounding(*terms: float) -> float:
    """Return the size of a sum, 0 if it is the round-off of its terms."""
    size = abs(math.fsum(terms))
    return size if size > LENGTH_ROUNDING * math.fsum(map(abs, terms)) else 0.0


def start(forced: ForcedOscillator, state: State) -> Started:
    """Return the trajectory that starts from a state of `initial_state`.

    If the contact starts on a stop, moving into it is an impact; at rest it stays there if it is accelerated toward the
    stop. If the velocity of the contact is a sum of several velocities, the round-off of this sum counts as rest.
    """
    structure, kernels = forced.structure, forced.structure.at_phase(state.phase)
    run = new_run(forced.oscillator.size, len(structure.orders), EVENTS)
    run.u[:] = structure.free_state(state.displacement - forced.equilibrium, state.velocity, state.phase)
    steady = structure.steady * np.exp(1j * structure.orders * state.phase)[:, None, None]
    status, stop = OK, touched_stop(forced.oscillator, forced.clearances, state.displacement)
    stops = forced.stops_from(state)
    if stop != 0:
        velocity, rounding = _contact_coordinate(forced.oscillator, state.velocity)
        if abs(velocity) <= rounding:
            velocity = 0.0
        status = _start_on_stop(kernels, stops, run, stop, velocity)
    began = new_run(forced.oscillator.size, len(structure.orders))
    return Started(kernels, steady, stops, run, began, status, 0)


def _start_on_stop(forced: Forced, stops: Stops, run: Run, stop: int, velocity: float) -> int:
    """Start on a stop: at rest, with an impact if the contact moves into the stop, or moving away. Returns a status."""
    if velocity == 0.0:
        return start_on_stop(forced, stops, run, stop)
    if velocity * stop > 0.0:
        touch = Contact(stop, velocity, reference_at(forced.free, 0, 0.0)[2], 0, 0.0)
        if impact_at_stop(forced.free, stops, run, touch):
            return int(rest_after_impact(forced, stops, run, Moment(0, 0.0, 0)))
        return OK
    put_on_stop(run.cursor, run.near, stop, abs(velocity))
    return OK


def longer_record(run: Run, most: int = sys.maxsize) -> Run:
    """Return a run with the same events and room for four times as many, but for at most `most`."""
    rows, columns = run.events.shape
    events = np.zeros((min(4 * rows, most), columns))
    events[:rows] = run.events
    return run._replace(events=events)


def state_at(forced: ForcedOscillator, stops: Stops, run: Run, phase: float) -> State:
    """Return the current state of a run as an initial state at this forcing phase.

    While the contact rests, or makes the summed impacts before that, it is exactly on its stop. Near a stop that it has
    left, its gap and speed are those of the run. Round-off never places it beyond a stop. The scratch of `run.held` is
    overwritten.
    """
    structure, count, rest = forced.structure, forced.oscillator.size, run.held
    anchor, resting = int(run.cursor[ANCHOR]), int(run.cursor[HELD])
    right, left = forced.clearances
    if resting != 0:
        angles = structure.orders * phase
        rest.turn[:, 0], rest.turn[:, 1] = np.cos(angles), np.sin(angles)
        held_motion(structure.kernels.held, rest, resting * gap_of(stops, resting))
        x = forced.oscillator.with_contact(rest.physical[:count] + forced.equilibrium, right if resting > 0 else -left)
        return State(x, rest.physical[count:].copy(), phase)
    physical = np.asarray(structure.kernels.held.from_free @ run.u.ravel()) + structure.reference_state(phase)
    x, v = physical[:count] + forced.equilibrium, physical[count:]
    if anchor != 0:
        gap, rate = run.near[ANCHOR_GAP], run.near[ANCHOR_RATE]
        x, v = (
            forced.oscillator.with_contact(x, right - gap if anchor > 0 else gap - left),
            forced.oscillator.with_contact(v, -anchor * rate),
        )
    return State(forced.oscillator.between(x, (right, left)), v, phase)


def wrapped(phase: float) -> float:
    """Return a phase modulo 2 pi, in [-pi, pi]; a phase in this range is returned unchanged."""
    return phase if abs(phase) <= math.pi else math.atan2(math.sin(phase), math.cos(phase))
