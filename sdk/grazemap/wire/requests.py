"""One request model per process, and the table of them.

The client builds a model, the service validates it and the worker parses it; a job's id is made from its canonical
text (`process.canonical`). To add a process, add its model here and to PROCESSES.
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
# Curves over a map: the minimum number of values of omega, and the number for each column of the map.
_CURVE_POINTS = 400
_CURVE_FINER = 2


class GrazingCurvesRequest(ProcessRequest):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19)).

    With `sequence` its result has xi_m of every point too, (33)-(40), whose signs say where an impact recurs.
    """

    omega: Grid
    """Forcing frequencies: a range, or an increasing list."""
    max_order: Order = 8
    """The maximum number of half periods after the graze in which a recurring impact is looked for."""
    sequence: bool = False
    """Whether the result has xi_m of every point, whose signs say where an impact recurs."""


class CodimensionTwoPointsRequest(ProcessRequest):
    """Every codimension-two point of the grazing curve over an interval of omega (equations (42), (45), (57), (58))."""

    omega: Interval
    """The interval of forcing frequencies."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""


class DiscontinuityMappingsRequest(ProcessRequest):
    """The discontinuity mapping (27) of states that overshoot a grazing stop, and the Poincare map made of it, (26).

    In each state mass 1 lies beyond the stop by one overshoot, and all else is as in the graze. `order` selects the
    mapping that gives the mapped states and is iterated, over `returns` half periods.
    """

    omega: Positive
    """Forcing frequency."""
    overshoot: Annotated[list[Positive], Field(min_length=1, max_length=1000, fail_fast=True), Listable]
    """Displacements of mass 1 beyond the stop: one state for each."""
    stop: Literal["A", "C"] = "A"
    """The stop that is grazed: A at +clearance, C at -clearance."""
    order: Literal["leading", "exact"] = "exact"
    """The mapping that is applied and iterated: exact, or its leading term."""
    returns: Annotated[int, Field(ge=1, le=100), Listable] = 8
    """Number of half periods over which the map is iterated."""


class TrajectoriesRequest(ProcessRequest):
    """One trajectory or, for a list of initial states, one from each of them; every impact exact."""

    omega: Positive
    """Forcing frequency."""
    clearance: Positive
    """Distance of each stop from the middle."""
    initial: InitialStates = InitialState()
    """The initial state, or a list of 1 to 1000; what is left out of one is 0."""
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
            raise invalid("both times and samples_per_period are given", "one of them", "samples_per_period")
        # an integer may be too large for a float
        end = min(self.periods, 10**60) * (2.0 * math.pi / self.omega)
        for k, time in enumerate(self.times):
            if k > 0 and not time > self.times[k - 1]:
                raise invalid("the times must increase", "an increasing list of numbers >= 0", "times", str(k))
            if not time <= end * _END_ROUNDING:
                raise invalid(
                    "a time lies after the end of the record", "at most periods * 2 pi/omega", "times", str(k)
                )
        return self

    @model_serializer(mode="wrap")
    def _one_kind_of_samples(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out times or samples_per_period: no request has both."""
        values: dict[str, Any] = handler(self)
        values.pop("times" if self.times is None else "samples_per_period", None)
        return values

    @property
    def states(self) -> list[InitialState]:
        """The initial states."""
        return [self.initial] if isinstance(self.initial, InitialState) else self.initial

    @property
    def samples(self) -> int:
        """Number of samples of each trajectory."""
        return self.periods * self.samples_per_period if self.times is None else len(self.times)


class UnfoldingMapsRequest(ProcessRequest):
    """The motion that each point of a rectangle of (omega, clearance) settles to.

    Trajectories start at rest; or, in a sweep, at the final state of the clearance below or above; or, in an ensemble,
    at random states, and the map has the motion that most of them settle to.

    An adaptive map is computed where neighbours differ and inferred between those that agree. A preview names periodic
    motions only, and takes less time.
    """

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    policy: Literal["rest", "sweep-up", "sweep-down", "ensemble"] = "rest"
    """Where trajectories start: at rest, at the final state of a neighbour, or at several random states."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled is unresolved."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""
    # Of the policy "ensemble" only; accepted with any policy, but then not part of the request.
    initial_conditions: Annotated[int, Field(ge=1, le=1000), Listable] = 16
    """Random states at each point, for the policy ensemble; ignored with another policy."""
    seed: Annotated[int, Field(ge=0, le=2**53), Listable] = 0
    """Seed of the random states, for the policy ensemble; ignored with another policy."""
    adaptive: bool = False
    """Whether points are inferred where all neighbours agree, and computed elsewhere only; not for a sweep."""
    preview: bool = False
    """Whether motions are classified by their returns alone: faster, not verified, no multipliers, no chaos."""

    @model_validator(mode="after")
    def _no_adaptive_sweep(self) -> UnfoldingMapsRequest:
        if self.adaptive and self.policy.startswith("sweep"):
            raise invalid(
                "a sweep cannot be adaptive: each point starts from its neighbour", "rest or ensemble", "policy"
            )
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
    """An unfolding map from rest, with the curves and points that are drawn over it.

    These are the grazing curve, its codimension-two points, the bifurcation curves in closed form and, with `borders`,
    the curves that explain the borders of the map's regions.
    """

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled is unresolved."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""
    borders: Annotated[bool, Listable] = False
    """Whether every border of the map's regions is explained; this takes a few times as long, or many times."""

    @cached_property
    def unfolding_map(self) -> UnfoldingMapsRequest:
        """The request for the map alone."""
        names = ("oscillator", "omega", "clearance", "max_periods", "max_period")
        return UnfoldingMapsRequest(**{name: getattr(self, name) for name in names})

    @cached_property
    def grazing_curve(self) -> GrazingCurvesRequest:
        """The request for the curve alone, finer than the map."""
        window, points = _window(self.omega), max(_CURVE_POINTS, _CURVE_FINER * grid_points(self.omega))
        values = Range(start=window.start, stop=window.stop, points=points)
        return GrazingCurvesRequest(oscillator=self.oscillator, omega=values, max_order=self.max_order)

    @cached_property
    def codimension_two_points(self) -> CodimensionTwoPointsRequest:
        """The request for the points alone."""
        names = ("oscillator", "max_order", "max_multiple")
        values = {name: getattr(self, name) for name in names}
        return CodimensionTwoPointsRequest(omega=_window(self.omega), **values)

    @cached_property
    def bifurcation_curves(self) -> BifurcationCurvesRequest:
        """The request for the curves in closed form alone."""
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
