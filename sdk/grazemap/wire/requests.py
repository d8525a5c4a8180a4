"""The requests for curves and points of grazing, trajectories and maps."""

from __future__ import annotations

import math
from collections.abc import Collection
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from grazemap.wire.base import Grid, Interval, Listable, NonNegative, Positive, Range, grid_points, invalid
from grazemap.wire.orbits import MAX_CURVE_POINTS, BifurcationCurvesRequest
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.process import (
    Count,
    GrazedOscillator,
    InitialState,
    InitialStates,
    MaxPeriod,
    MaxPeriods,
    Operation,
    PointRequest,
    ProcessRequest,
)
from grazemap.wire.structure import OtherClearance

Order = Annotated[int, Field(ge=1, le=200), Listable]
Multiple = Annotated[int, Field(ge=1, le=100), Listable]
# Allows for the three roundings of a record's end and one of a given time; as the core's END_ROUNDING.
_END_ROUNDING = 1.0 + 4.0 * 2.220446049250313e-16
# Largest omega.stop/omega.start of a search for codimension-two points; the core's MAX_FREQUENCY_RATIO.
_FREQUENCY_RATIO = 1e9
# For curves over a map: the minimum number of values of omega, and their number for each column of the map.
_CURVE_POINTS = 400
_CURVE_FINER = 2


class GrazingCurvesRequest(ProcessRequest):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19)).

    With `sequence` the result also has xi_m of every point, (33)-(40), whose signs show where an impact recurs.
    """

    operation = Operation(
        "grazing-curves",
        "submit_grazing_curve",
        "Grazing curve",
        "Compute clearance = A(omega), with phase and first recurrence.",
        {
            "default oscillator": {"omega": {"start": 0.05, "stop": 1.2, "points": 200}},
            "one mass in SI units": {
                "oscillator": {
                    "units": "SI",
                    "masses": [2.0],
                    "stiffnesses": [800.0],
                    "damping": 0.001,
                    "forcing": [12.0],
                    "restitution": 0.7,
                },
                "omega": [10.0, 15.0, 22.5, 30.0],
                "max_order": 4,
            },
        },
    )

    oscillator: GrazedOscillator = Oscillator()
    """The oscillator; fields that are left out are those of the paper's example."""
    omega: Grid
    """Forcing frequencies: a range, or an increasing list."""
    max_order: Order = 8
    """The maximum number of half periods after the graze in which a recurring impact is looked for."""
    sequence: bool = False
    """Whether the result has xi_m of every point, whose signs show where an impact recurs."""
    clearance: OtherClearance | None = None
    """The one stop that is fixed, {"left": 1.2}, or absent, {"left": null}; left out: both vary together."""

    def unused(self) -> Collection[str]:
        """Return "clearance" where both stops vary: the text of such a question is as before one could be fixed."""
        return ("clearance",) if self.clearance is None else ()

    @property
    def are_alike(self) -> bool:
        """Whether the two stops are at equal gaps from the equilibrium, so that both are grazed at once."""
        return self.clearance is None and not any(self.oscillator.bias or ())

    @model_validator(mode="after")
    def _sequence_is_of_equal_stops(self) -> GrazingCurvesRequest:
        if self.sequence and not self.are_alike:
            raise invalid("sequence is of two equal stops", "false where a stop is fixed or a bias given", "sequence")
        return self


class CodimensionTwoPointsRequest(ProcessRequest):
    """Every codimension-two point of the grazing curve over an interval of omega (equations (42), (45), (57), (58))."""

    operation = Operation(
        "codimension-two-points",
        "submit_codimension_two_points",
        "Codimension-two points",
        "Compute every codimension-two point of the grazing curve over an interval of omega.",
        {"default oscillator": {"omega": {"start": 0.25, "stop": 0.35}, "max_order": 4}},
    )

    oscillator: GrazedOscillator = Oscillator()
    """The oscillator; fields that are left out are those of the paper's example."""
    omega: Interval
    """The interval of forcing frequencies; it ends at most at 1e9 times its start."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""
    clearance: OtherClearance | None = None
    """The one stop that is fixed, as of a grazing curve."""

    def unused(self) -> Collection[str]:
        """Return "clearance" where both stops vary: the text of such a question is as before one could be fixed."""
        return ("clearance",) if self.clearance is None else ()

    @model_validator(mode="after")
    def _can_be_searched(self) -> CodimensionTwoPointsRequest:
        _require_searchable(self.omega, "omega", "stop")
        return self


class DiscontinuityMappingsRequest(ProcessRequest):
    """The discontinuity mapping (27) of states that overshoot a grazing stop, and the resulting Poincare map (26).

    In each state mass 1 lies beyond the stop by one overshoot, and all else is as in the graze. `order` selects the
    mapping that gives the mapped states and is iterated, over `returns` half periods.
    """

    operation = Operation(
        "discontinuity-mappings",
        "submit_discontinuity_mappings",
        "Discontinuity mapping at a graze",
        "Compute the discontinuity mapping at a grazing point, its error, and the returns of the motion below grazing.",
        {"default oscillator": {"omega": 0.29, "overshoot": [1e-06, 1e-05, 0.0001, 0.001], "returns": 4}},
    )

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


class TrajectoriesRequest(PointRequest):
    """One trajectory or, for a list of initial states, one from each of them, with every impact."""

    operation = Operation(
        "trajectories",
        "submit_trajectory",
        "Trajectories",
        "Compute a trajectory from each initial state: its impacts, its final state, the motion that it settles to.",
        {
            "from rest": {"omega": 0.29, "clearance": 1.6, "periods": 20, "samples_per_period": 50},
            "from an initial state": {
                "omega": 0.29,
                "clearance": 1.6,
                "initial": {"displacement": [0.1, 0.0, 0.0], "velocity": [0.0, 0.2, 0.0], "phase": 0.5},
                "periods": 10,
                "transient_periods": 100,
            },
            "at given times": {"omega": 0.29, "clearance": 1.6, "periods": 1, "times": [0.0, 0.5, 1.25, 20.0]},
            "from many states": {
                "omega": 0.29,
                "clearance": 1.6,
                "initial": [{}, {"phase": 1.0}, {"displacement": [1.6, 0.0, 0.0]}],
                "periods": 10,
            },
        },
    )

    initial: InitialStates = InitialState()
    """The initial state, or a list of 1 to 1000; values that are left out are 0."""
    periods: Count
    """Forcing periods that are recorded."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 0
    """Forcing periods before the record."""
    samples_per_period: Annotated[int, Field(ge=1, le=100_000), Listable] = 200
    """Number of equally spaced samples in each forcing period; instead of times."""
    times: Annotated[list[NonNegative], Field(min_length=1, fail_fast=True), Listable] | None = None
    """Times of the samples within the record, increasing; instead of samples_per_period."""

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

    def unused(self) -> Collection[str]:
        """Return the name of the field of the other kind of samples."""
        return ("times",) if self.times is None else ("samples_per_period",)

    @property
    def states(self) -> list[InitialState]:
        """The initial states."""
        return [self.initial] if isinstance(self.initial, InitialState) else self.initial

    @property
    def samples(self) -> int:
        """Number of samples of each trajectory."""
        return self.periods * self.samples_per_period if self.times is None else len(self.times)


def _example(points: int) -> dict[str, Any]:
    omega = {"start": 0.26, "stop": 0.3, "points": points}
    return {"omega": omega, "clearance": {"start": 1.3, "stop": 2.0, "points": points}, "max_periods": 200}


class UnfoldingMapsRequest(ProcessRequest):
    """The motion that each point of a rectangle of (omega, clearance) settles to.

    Trajectories start at rest; in a sweep, at the final state for the next smaller or larger clearance; in an ensemble,
    at random states, and the map has the motion that most of them settle to.

    An adaptive map is computed where neighbours differ and inferred where they agree. A preview takes less time; it
    classifies periodic motions only.
    """

    operation = Operation(
        "unfolding-maps",
        "submit_unfolding_map",
        "Unfolding map",
        "Compute the motion that each point of a grid settles to; its tiles can be fetched before the map is complete.",
        {
            "coarse map of the default oscillator": _example(16),
            "map computed where neighbours differ": {**_example(32), "adaptive": True},
            "names of motions, soon": {**_example(32), "preview": True},
        },
    )

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    policy: Literal["rest", "sweep-up", "sweep-down", "ensemble"] = "rest"
    """Where trajectories start: at rest, at the final state of a neighbour, or at several random states."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled ends; its motion may be chaotic."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""
    # Of the policy "ensemble" only; accepted with any policy, but then not part of the request.
    initial_conditions: Annotated[int, Field(ge=1, le=1000), Listable] = 16
    """Random states at each point, for the policy ensemble; ignored with another policy."""
    seed: Annotated[int, Field(ge=0, le=2**53), Listable] = 0
    """Seed of the random states, for the policy ensemble; ignored with another policy."""
    adaptive: bool = False
    """Whether points are inferred where all neighbours agree, and computed only elsewhere; not for a sweep."""
    preview: bool = False
    """Whether only periodic motions are identified: faster, without multipliers, exponents and chaos."""
    resolve_sensitive: bool = False
    """Whether the motions of sensitive points are decided in more digits, which takes seconds a point."""

    @model_validator(mode="after")
    def _resolves_computed_points_from_exact_states(self) -> UnfoldingMapsRequest:
        if self.resolve_sensitive and self.policy.startswith("sweep"):
            raise invalid("a sweep starts at rounded states", "false for a sweep", "resolve_sensitive")
        if self.resolve_sensitive and self.adaptive:
            raise invalid("an adaptive map is not resolved", "false for an adaptive map", "resolve_sensitive")
        return self

    @model_validator(mode="after")
    def _no_adaptive_sweep(self) -> UnfoldingMapsRequest:
        if self.adaptive and self.policy.startswith("sweep"):
            raise invalid(
                "a sweep cannot be adaptive: each point starts from its neighbour", "rest or ensemble", "policy"
            )
        return self

    def unused(self) -> Collection[str]:
        """Return the names of the fields of ensembles for other policies, and of options that are false."""
        random = () if self.policy == "ensemble" else ("initial_conditions", "seed")
        return (*random, *(name for name in ("adaptive", "preview", "resolve_sensitive") if not getattr(self, name)))


class UnfoldingDiagramsRequest(ProcessRequest):
    """An unfolding map from rest, with the curves and points that are drawn over it.

    These are the grazing curve, its codimension-two points, the bifurcation curves in closed form and, with `borders`,
    the curves that explain the borders of the map's regions.
    """

    operation = Operation(
        "unfolding-diagrams",
        "submit_unfolding_diagram",
        "Unfolding diagram",
        "Compute an unfolding map, the curves and points over it, and an explanation of every border of its regions.",
        {
            "coarse diagram near the paper's codimension-two point": {
                "omega": {"start": 0.275, "stop": 0.29, "points": 16},
                "clearance": {"start": 1.8, "stop": 2.0, "points": 16},
                "max_periods": 400,
            }
        },
    )

    omega: Grid
    """Forcing frequencies, the map's columns: a range, or an increasing list; the last at most 1e9 times the first."""
    clearance: Grid
    """Clearances, the map's rows: a range, or an increasing list."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled ends; its motion may be chaotic."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""
    borders: Annotated[bool, Listable] = False
    """Whether every border of the map's regions is explained; this may take many times as long."""

    @model_validator(mode="after")
    def _can_be_searched(self) -> UnfoldingDiagramsRequest:
        last = "stop" if isinstance(self.omega, Range) else str(len(self.omega) - 1)
        _require_searchable(_window(self.omega), "omega", last)
        return self

    @cached_property
    def unfolding_map(self) -> UnfoldingMapsRequest:
        """The request for the map alone."""
        names = ("oscillator", "omega", "clearance", "max_periods", "max_period")
        return UnfoldingMapsRequest(**{name: getattr(self, name) for name in names})

    @cached_property
    def grazing_curve(self) -> GrazingCurvesRequest:
        """The request for the curve alone, finer than the map."""
        values = Range(**_window(self.omega).model_dump(), points=self._curve_points)
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
            points=self._curve_points,
        )

    @property
    def _curve_points(self) -> int:
        return min(max(_CURVE_POINTS, _CURVE_FINER * grid_points(self.omega)), MAX_CURVE_POINTS)


def _require_searchable(omega: Interval, *at: str) -> None:
    """Refuse an interval that is too wide for a search for codimension-two points; `at` is the field of its end."""
    if omega.stop > _FREQUENCY_RATIO * omega.start:
        raise invalid("omega ends too far from where it starts", f"at most {_FREQUENCY_RATIO:g} times its start", *at)


def _window(grid: Range | list[float]) -> Interval:
    start, stop = (grid.start, grid.stop) if isinstance(grid, Range) else (grid[0], grid[-1])
    return Interval(start=start, stop=stop)
