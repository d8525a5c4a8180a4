"""One request model per process, and the table of them.

A model is validated by the service, parsed by the worker and built by the client; its canonical text
(`canonical.py`) is what a job's id is made from. To add a process, add its model here and to PROCESSES.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from grazemap.wire.base import Listable, NonNegative, Positive, invalid
from grazemap.wire.basins import BasinsRequest
from grazemap.wire.diagrams import BifurcationDiagramsRequest
from grazemap.wire.orbits import BifurcationCurvesRequest, OrbitBranchesRequest, PeriodicOrbitsRequest
from grazemap.wire.process import Count, MaxPeriod, MaxPeriods, ProcessRequest
from grazemap.wire.ranges import Grid, Interval, Range, grid_points
from grazemap.wire.states import InitialState, InitialStates

Order = Annotated[int, Field(ge=1, le=200), Listable]
Multiple = Annotated[int, Field(ge=1, le=100), Listable]
# The end of a record has three roundings, and a given time its own; as the core's END_ROUNDING.
_END_ROUNDING = 1.0 + 4.0 * 2.220446049250313e-16
# Curves over a map: values of omega at least, and for each column of the map.
_CURVE_POINTS = 400
_CURVE_FINER = 2


class GrazingCurvesRequest(ProcessRequest):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19)).

    With `sequence` its result has xi_m of every point too, (33)-(40), whose signs say where an impact recurs.
    """

    omega: Grid
    """Forcing frequencies: a range, or an increasing list."""
    max_order: Order = 8
    """Up to how many half periods after the graze an impact that recurs is looked for."""
    sequence: bool = False
    """Whether the result has xi_m of every point, whose signs say where an impact recurs."""


class CodimensionTwoPointsRequest(ProcessRequest):
    """Every codimension-two point of the grazing curve over an interval of omega (equations (42), (45), (57), (58))."""

    omega: Interval
    """The interval of forcing frequencies."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The longest period of the motions that leave at a resonant point, in forcing periods."""


class DiscontinuityMappingsRequest(ProcessRequest):
    """What an impact does to motions that overshoot a grazing stop, equation (27), and the map made of it, (26).

    Mass 1 is taken straight beyond the stop by each overshoot, all else as in the graze. `order` says which mapping
    gives the mapped states and is iterated; `returns` is for how many half periods.
    """

    omega: Positive
    """Forcing frequency."""
    overshoot: Annotated[list[Positive], Field(min_length=1, max_length=1000, fail_fast=True), Listable]
    """How far mass 1 is taken beyond the stop, as displacements: one state for each."""
    stop: Literal["A", "C"] = "A"
    """The stop that is grazed: A at +clearance, C at -clearance."""
    order: Literal["leading", "exact"] = "exact"
    """The mapping that is applied and iterated: exact, or its leading term."""
    returns: Annotated[int, Field(ge=1, le=100), Listable] = 8
    """How many half periods the motion is followed for."""


class TrajectoriesRequest(ProcessRequest):
    """One trajectory or, for a list of initial states, one from each of them; every impact exact."""

    omega: Positive
    """Forcing frequency."""
    clearance: Positive
    """Distance of each stop from the middle."""
    initial: InitialStates = InitialState()
    """Where the trajectory starts: a state, or a list of 1 to 1000; what is left out of one is 0."""
    periods: Count
    """Forcing periods that are recorded."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 0
    """Forcing periods before the record."""
    samples_per_period: Annotated[int, Field(ge=1, le=100_000), Listable] = 200
    """Samples at equal parts of each forcing period; instead of times."""
    times: Annotated[list[NonNegative], Field(min_length=1, fail_fast=True), Listable] | None = None
    """Samples at these times within the record, increasing; instead of samples_per_period."""

    @model_validator(mode="after")
    def _initial_states_fit(self) -> TrajectoriesRequest:
        count, clearance = self.oscillator.size, self.clearance
        fitted: InitialState | list[InitialState]
        if isinstance(self.initial, InitialState):
            fitted = self.initial.fitted(count, clearance, ("initial",))
        else:
            fitted = [state.fitted(count, clearance, ("initial", str(k))) for k, state in enumerate(self.initial)]
        # the model is frozen for others; this is still its validation
        object.__setattr__(self, "initial", fitted)
        return self

    @model_validator(mode="after")
    def _times_fit(self) -> TrajectoriesRequest:
        if self.times is None:
            return self
        if "samples_per_period" in self.model_fields_set:
            raise invalid("times are given, and samples_per_period too", "one of them", "samples_per_period")
        # an integer may have thousands of digits, a float has not
        end = min(self.periods, 10**60) * (2.0 * math.pi / self.omega)
        for k, time in enumerate(self.times):
            if k > 0 and not time > self.times[k - 1]:
                raise invalid("the times must increase", "an increasing list of numbers >= 0", "times", str(k))
            if not time <= end * _END_ROUNDING:
                raise invalid(
                    "a time lies behind the end of the record", "at most periods * 2 pi/omega", "times", str(k)
                )
        return self

    @model_serializer(mode="wrap")
    def _one_way_to_sample(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the way of sampling that is not asked for: no question has both."""
        values: dict[str, Any] = handler(self)
        values.pop("times" if self.times is None else "samples_per_period", None)
        return values

    @property
    def states(self) -> list[InitialState]:
        """The initial states."""
        return [self.initial] if isinstance(self.initial, InitialState) else self.initial

    @property
    def samples(self) -> int:
        """How many samples each trajectory has."""
        return self.periods * self.samples_per_period if self.times is None else len(self.times)


class UnfoldingMapsRequest(ProcessRequest):
    """The motion that each point of a rectangle of (omega, clearance) settles to.

    Trajectories start at rest; where the one of the clearance below or above has ended (a sweep follows a motion for as
    long as it lasts); or, of an ensemble, at random states, and the motion that most of them lead to counts.

    An adaptive map is computed where neighbours differ and inferred between those that agree. A preview has the names
    of periodic motions alone, sooner.
    """

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    policy: Literal["rest", "sweep-up", "sweep-down", "ensemble"] = "rest"
    """Where trajectories start: at rest, where a neighbour's has ended, or at several random states."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled is given up."""
    max_period: MaxPeriod = 32
    """The longest period looked for, in forcing periods."""
    # Of the policy "ensemble" only; accepted with any policy, but then not part of the question.
    initial_conditions: Annotated[int, Field(ge=1, le=1000), Listable] = 16
    """Random states at each point; of the policy ensemble only, counts for nothing with another."""
    seed: Annotated[int, Field(ge=0, le=2**53), Listable] = 0
    """What those are drawn from; of the policy ensemble only, counts for nothing with another."""
    adaptive: bool = False
    """Whether points are inferred where all neighbours agree, and computed elsewhere only; not of a sweep."""
    preview: bool = False
    """Whether motions are told by their returns alone, sooner: no proofs, no multipliers and exponents, no chaos."""

    @model_validator(mode="after")
    def _neighbours_are_free(self) -> UnfoldingMapsRequest:
        if self.adaptive and self.policy.startswith("sweep"):
            raise invalid("a sweep follows its neighbours: every point is computed", "rest or ensemble", "policy")
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_not_asked(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields: dict[str, Any] = dump(self)
        if self.policy != "ensemble":
            for name in ("initial_conditions", "seed"):
                fields.pop(name, None)
        for name in ("adaptive", "preview"):
            if not fields.get(name):
                fields.pop(name, None)
        return fields


class UnfoldingDiagramsRequest(ProcessRequest):
    """An unfolding map, from rest, with all that is drawn over it.

    The grazing curve, its codimension-two points, the bifurcation curves in closed form and, with `borders`, the curves
    that explain the borders of the map's regions.
    """

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled is given up."""
    max_period: MaxPeriod = 32
    """The longest period looked for, in forcing periods."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The longest period of the motions that leave at a resonant point, in forcing periods."""
    borders: Annotated[bool, Listable] = False
    """Whether every border of the map's regions is explained; takes a few times as long, or many times."""

    @cached_property
    def unfolding_map(self) -> UnfoldingMapsRequest:
        """The question for the map alone."""
        names = ("oscillator", "omega", "clearance", "max_periods", "max_period")
        return UnfoldingMapsRequest(**{name: getattr(self, name) for name in names})

    @cached_property
    def grazing_curve(self) -> GrazingCurvesRequest:
        """The question for the curve alone, finer than the map."""
        window, points = _window(self.omega), max(_CURVE_POINTS, _CURVE_FINER * grid_points(self.omega))
        values = Range(start=window.start, stop=window.stop, points=points)
        return GrazingCurvesRequest(oscillator=self.oscillator, omega=values, max_order=self.max_order)

    @cached_property
    def codimension_two_points(self) -> CodimensionTwoPointsRequest:
        """The question for the points alone."""
        names = ("oscillator", "max_order", "max_multiple")
        values = {name: getattr(self, name) for name in names}
        return CodimensionTwoPointsRequest(omega=_window(self.omega), **values)

    @cached_property
    def bifurcation_curves(self) -> BifurcationCurvesRequest:
        """The question for the curves in closed form alone."""
        return BifurcationCurvesRequest(
            oscillator=self.oscillator,
            omega=_window(self.omega),
            clearance=_window(self.clearance),
            max_multiple=self.max_multiple,
            points=max(_CURVE_POINTS, _CURVE_FINER * grid_points(self.omega)),
        )


def _window(grid: Range | list[float]) -> Interval:
    start, stop = (grid.start, grid.stop) if isinstance(grid, Range) else (grid[0], grid[-1])
    return Interval(start=start, stop=stop)


PROCESSES: dict[str, type[ProcessRequest]] = {
    "grazing-curves": GrazingCurvesRequest,
    "codimension-two-points": CodimensionTwoPointsRequest,
    "discontinuity-mappings": DiscontinuityMappingsRequest,
    "trajectories": TrajectoriesRequest,
    "bifurcation-diagrams": BifurcationDiagramsRequest,
    "unfolding-maps": UnfoldingMapsRequest,
    "unfolding-diagrams": UnfoldingDiagramsRequest,
    "basins": BasinsRequest,
    "periodic-orbits": PeriodicOrbitsRequest,
    "orbit-branches": OrbitBranchesRequest,
    "bifurcation-curves": BifurcationCurvesRequest,
}


def parse_request(process: str, body: dict[str, Any]) -> ProcessRequest:
    """Validate a request body. KeyError: no such process; pydantic.ValidationError: bad values."""
    return PROCESSES[process].model_validate(body)
