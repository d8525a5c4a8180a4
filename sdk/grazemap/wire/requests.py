"""The requests for curves and points of grazing, trajectories, and diagrams of maps with their borders."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from grazemap.constants import EPSILON
from grazemap.wire.base import (
    Count,
    Interval,
    Kind,
    LeftOut,
    Listable,
    NonEmpty,
    NonNegative,
    OptionalCount,
    Positive,
    PositiveInterval,
    PositiveRange,
    invalid,
)
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.orbits import MAX_CURVE_POINTS, BifurcationCurvesRequest
from grazemap.wire.planes import (
    SCALARS,
    Axis,
    Frequencies,
    FrequencyWindow,
    PlaneRequest,
    UnfoldingMapsRequest,
    WindowAxis,
    example_axis,
)
from grazemap.wire.process import Operation, PointRequest, ProcessRequest, ShortForms
from grazemap.wire.states import InitialState, InitialStates, MaxPeriod, MaxPeriods, Multiple, OtherStarts
from grazemap.wire.structure import ClearancePair, OtherClearance, StopName, varied_stop

Order = Annotated[int, Field(ge=1, le=200), Listable]
# Allows for the three roundings of a record's end and one of a given time; as the core's END_ROUNDING.
_END_ROUNDING = 1.0 + 4.0 * EPSILON
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
        "Compute clearance = A(omega), at which the steady motion touches the stops, with phase and first recurrence.",
        {
            "default oscillator": {"axis": {"vary": "omega", "values": {"start": 0.05, "stop": 1.2, "points": 200}}},
            "one mass in SI units": {
                "oscillator": {
                    "units": "SI",
                    "masses": [2.0],
                    "stiffnesses": [800.0],
                    "damping": 0.001,
                    "forcing": [12.0],
                    "restitution": 0.7,
                },
                "axis": {"vary": "omega", "values": [10.0, 15.0, 22.5, 30.0]},
                "max_order": 4,
            },
        },
        "Equations (16)-(19) for the curve, (33)-(40) for the recurrence.",
    )

    short = ShortForms(("axis",), {"omega": "Forcing frequencies: a range, or an increasing list."})

    axis: Frequencies
    """Forcing frequencies: a range, or an increasing list."""
    max_order: Order = 8
    """The maximum number of half periods after the graze in which a recurring impact is looked for."""
    sequence: bool = False
    """Whether the result has xi_m of every point, whose signs show where an impact recurs."""
    clearance: Annotated[OtherClearance | None, LeftOut] = None
    """The one stop that is fixed, {"left": 1.2}, or absent, {"left": null}; left out: both vary together."""

    @property
    def are_alike(self) -> bool:
        """Whether the two stops are grazed at once."""
        return self.clearance is None and self.oscillator.is_symmetric

    @model_validator(mode="after")
    def _sequence_is_of_equal_stops(self) -> GrazingCurvesRequest:
        if self.sequence and not self.are_alike:
            allowed = "false where a stop is fixed, or where there are a bias or even harmonics"
            raise invalid("sequence is of two equal stops", allowed, "sequence")
        return self


class CodimensionTwoPointsRequest(ProcessRequest):
    """Every codimension-two point of the grazing curve over an interval of omega (equations (42), (45), (57), (58))."""

    operation = Operation(
        "codimension-two-points",
        "submit_codimension_two_points",
        "Compute every codimension-two point of the grazing curve over an interval of omega.",
        {
            "default oscillator": {
                "axis": {"vary": "omega", "values": {"start": 0.25, "stop": 0.35}},
                "max_order": 4,
            }
        },
        "Equations (42), (45), (57), (58).",
    )

    short = ShortForms(("axis",), {"omega": "The interval of forcing frequencies."})

    axis: FrequencyWindow
    """The interval of forcing frequencies; it ends at most at 1e9 times its start."""
    max_order: Order = 8
    """The highest order of recurrence points, in half periods."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""
    clearance: Annotated[OtherClearance | None, LeftOut] = None
    """The one stop that is fixed, as of a grazing curve."""

    @model_validator(mode="after")
    def _can_be_searched(self) -> CodimensionTwoPointsRequest:
        _require_searchable(self.axis.values, "axis", "values", "stop")
        return self


class DiscontinuityMappingsRequest(ProcessRequest):
    """The discontinuity mapping (27) of states that overshoot a grazing stop, and the resulting Poincare map (26).

    In each state the contact lies beyond the stop by one overshoot, and all else is as in the graze. `order` selects
    the mapping that gives the mapped states and is iterated over `returns`: half periods of the forces where the steady
    motion grazes both stops at once, else whole ones.
    """

    operation = Operation(
        "discontinuity-mappings",
        "submit_discontinuity_mappings",
        "Compute the discontinuity mapping at a grazing point, its error, and the returns of the motion below grazing.",
        {
            "default oscillator": {"omega": 0.29, "overshoot": [1e-06, 1e-05, 0.0001, 0.001], "returns": 4},
            "the other stop farther away": {
                "omega": 0.29,
                "overshoot": [1e-06, 1e-05, 0.0001],
                "clearance": {"left": 3.0},
                "returns": 4,
            },
        },
        "Equations (26), (27), (31), (32), (46); xi (33)-(40), (45), (57), (58).",
    )

    omega: Positive
    """Forcing frequency."""
    overshoot: Annotated[list[Positive], Field(min_length=1, max_length=1000, fail_fast=True), Listable, Kind("sizes")]
    """Displacements of the contact beyond the stop: one state for each."""
    stop: StopName = "right"
    """The stop that is grazed: right, at +clearance, or left, at -clearance."""
    order: Literal["leading", "exact"] = "exact"
    """The mapping that is applied and iterated: exact, or its leading term."""
    returns: Annotated[int, Field(ge=1, le=100), Listable] = 8
    """Number of half periods over which the map is iterated; of whole periods where the stops are not alike."""
    clearance: Annotated[OtherClearance | None, LeftOut] = None
    """The stop that is not grazed, fixed or absent, as of a grazing curve; left out: the stops have one clearance."""

    @property
    def are_alike(self) -> bool:
        """Whether the two stops are grazed at once."""
        return self.clearance is None and self.oscillator.is_symmetric

    @model_validator(mode="after")
    def _other_stop_is_fixed(self) -> DiscontinuityMappingsRequest:
        if self.clearance is not None and (varied_stop(self.clearance)[0] > 0) != (self.stop == "right"):
            other = "left" if self.stop == "right" else "right"
            detail = f"clearance fixes the {self.stop} stop, which is grazed"
            raise invalid(detail, f'"stop": "{other}", or the clearance of the {other} stop', "clearance")
        return self


class TrajectoriesRequest(PointRequest, ObservedRequest):
    """One trajectory or, for a list of initial states, one from each of them, with every impact."""

    operation = Operation(
        "trajectories",
        "submit_trajectory",
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
            "between two masses, one stop": {
                "oscillator": {"contact": [1, 2]},
                "omega": 0.29,
                "clearance": {"right": 0.8, "left": None},
                "periods": 10,
            },
            "from rest, and what other starts lead to": {
                "oscillator": {"masses": [1.0], "stiffnesses": [1.0], "damping": 0.04, "forcing": [1.0]},
                "omega": 1.5,
                "clearance": {"right": 1.0, "left": None},
                "periods": 20,
                "transient_periods": 100,
                "other_starts": 64,
            },
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
    transient_periods: OptionalCount = 0
    """Forcing periods before the record."""
    samples_per_period: Annotated[int, Field(ge=1, le=100_000), Listable] = 200
    """Number of equally spaced samples in each forcing period; instead of times."""
    times: Annotated[NonEmpty[NonNegative] | None, LeftOut] = None
    """Times of the samples within the record, increasing; instead of samples_per_period."""
    other_starts: Annotated[OtherStarts, LeftOut] = 0

    @model_validator(mode="after")
    def _one_start_is_compared(self) -> TrajectoriesRequest:
        if self.other_starts and not isinstance(self.initial, InitialState):
            raise invalid("other_starts are compared with one initial state", "0, or one state", "other_starts")
        return self

    @model_validator(mode="after")
    def _initial_states_fit(self) -> TrajectoriesRequest:
        oscillator, clearance = self.oscillator, self.clearance
        fitted: InitialState | list[InitialState]
        if isinstance(self.initial, InitialState):
            fitted = self.initial.fitted(oscillator, clearance, ("initial",))
        else:
            fitted = [state.fitted(oscillator, clearance, ("initial", str(k))) for k, state in enumerate(self.initial)]
        self._replace("initial", fitted)
        return self

    @model_validator(mode="after")
    def _times_fit(self) -> TrajectoriesRequest:
        if self.times is None:
            return self
        if "samples_per_period" in self.model_fields_set:
            raise invalid("both times and samples_per_period are given", "one of them", "samples_per_period")
        # an integer may be too large for a float
        end = min(self.periods, 10**60) * self.oscillator.forcing_period(self.omega)
        for k, time in enumerate(self.times):
            if k > 0 and not time > self.times[k - 1]:
                raise invalid("the times must increase", "an increasing list of numbers >= 0", "times", str(k))
            if not time <= end * _END_ROUNDING:
                raise invalid(
                    "a time lies after the end of the record", "at most periods T, T = 2 pi/(p omega)", "times", str(k)
                )
        return self

    def unused(self) -> Collection[str]:
        """Return the name of the field of the other kind of samples."""
        return () if self.times is None else ("samples_per_period",)

    @property
    def states(self) -> list[InitialState]:
        """The initial states."""
        return [self.initial] if isinstance(self.initial, InitialState) else self.initial

    @property
    def samples(self) -> int:
        """Number of samples of each trajectory, without the one at its end."""
        return self.periods * self.samples_per_period if self.times is None else len(self.times)


class UnfoldingDiagramsRequest(PlaneRequest):
    """An unfolding map from rest, with the curves and points that are drawn over it.

    These are the grazing curve, its codimension-two points over omega and clearance, the bifurcation curves of motions
    with one impact over omega and a parameter of the stops or the forces and, with `borders`, the curves that explain
    the borders of the map's regions.
    """

    operation = Operation(
        "unfolding-diagrams",
        "submit_unfolding_diagram",
        "Compute an unfolding map, the curves and points over it, and an explanation of every border of its regions.",
        {
            "coarse diagram near the paper's codimension-two point": {
                "horizontal": example_axis("omega", 0.275, 0.29),
                "vertical": example_axis("clearance", 1.8, 2.0),
                "max_periods": 400,
            },
            "one stop": {
                "horizontal": example_axis("omega", 0.275, 0.29),
                "vertical": example_axis("clearance_right", 1.8, 2.0),
                "clearance": {"left": None},
                "max_periods": 400,
            },
            "over frequency and force": {
                "horizontal": example_axis("omega", 0.275, 0.29),
                "vertical": example_axis("forcing", 0.9, 1.1),
                "clearance": 1.9,
                "max_periods": 400,
            },
        },
    )

    horizontal: Axis
    """The parameter of the map's columns and its values; the last frequency is at most 1e9 times the first."""
    vertical: Axis
    """The parameter of the map's rows and its values."""
    max_periods: MaxPeriods = 1000
    max_period: MaxPeriod = 32
    max_order: Order = 8
    """The highest order of recurrence points, in half periods; not used with axes."""
    max_multiple: Multiple = 4
    """The maximum period of the motions that bifurcate at a resonant point, in forcing periods."""
    borders: Annotated[bool, Listable] = False
    """Whether every border of the map's regions is explained; this may take many times as long."""

    @model_validator(mode="after")
    def _can_be_searched(self) -> UnfoldingDiagramsRequest:
        if self.is_usual:
            values = self.horizontal.values
            last = str(len(values) - 1) if isinstance(values, list) else "stop"
            _require_searchable(self._window, "horizontal", "values", last)
        return self

    @property
    def is_usual(self) -> bool:
        """Whether the diagram is over omega and a clearance, and so has the grazing curve and its points."""
        return self.plane.fields == ("omega", "clearance")

    @cached_property
    def unfolding_map(self) -> UnfoldingMapsRequest:
        """The request for the map alone."""
        return UnfoldingMapsRequest(**self._fields(*PlaneRequest.model_fields, "max_periods", "max_period"))

    @cached_property
    def grazing_curve(self) -> GrazingCurvesRequest:
        """The request for the curve alone, finer than the map; of diagrams over omega and clearance."""
        values = PositiveRange(**self._window.model_dump(), points=self._curve_points)
        fields = self._fields("oscillator", "max_order")
        return GrazingCurvesRequest(axis=Frequencies(values=values), clearance=self._other_stop, **fields)

    @cached_property
    def codimension_two_points(self) -> CodimensionTwoPointsRequest:
        """The request for the points alone; of diagrams over omega and clearance."""
        fields = self._fields("oscillator", "max_order", "max_multiple")
        window = FrequencyWindow(values=self._window)
        return CodimensionTwoPointsRequest(axis=window, clearance=self._other_stop, **fields)

    @cached_property
    def bifurcation_curves(self) -> BifurcationCurvesRequest | None:
        """The request for the curves of motions with one impact alone; None in planes without any."""
        across, up = (_window_axis(axis) for axis in (self.plane.horizontal, self.plane.vertical))
        names = {across.vary, up.vary} - {"omega"}
        if len(names) != 1 or not names.issubset(SCALARS):
            return None
        return BifurcationCurvesRequest(
            horizontal=across,
            vertical=up,
            points=self._curve_points,
            **self._fields("oscillator", "omega", "clearance", "max_multiple"),
        )

    def unused(self) -> Collection[str]:
        """Return the names of the fields of points and curves where there are none."""
        if self.is_usual:
            return ()
        return ("max_order",) if self.bifurcation_curves is not None else ("max_order", "max_multiple")

    def _fields(self, *names: str) -> dict[str, Any]:
        return {name: getattr(self, name) for name in names}

    @property
    def _other_stop(self) -> ClearancePair | None:
        return self.clearance if isinstance(self.clearance, ClearancePair) else None

    @property
    def _window(self) -> PositiveInterval:
        start, stop = self.plane.horizontal.ends
        return PositiveInterval(start=start, stop=stop)

    @property
    def _curve_points(self) -> int:
        rows, columns = self.plane.shape
        values = rows if self.plane.vertical.vary == "omega" else columns
        return min(max(_CURVE_POINTS, _CURVE_FINER * values), MAX_CURVE_POINTS)


def _window_axis(axis: Axis | WindowAxis) -> WindowAxis:
    start, stop = axis.ends
    return WindowAxis(vary=axis.vary, values=Interval(start=start, stop=stop))


def _require_searchable(omega: Interval, *at: str) -> None:
    """Refuse an interval that is too wide for a search for codimension-two points; `at` is the field of its end."""
    if omega.stop > _FREQUENCY_RATIO * omega.start:
        raise invalid("omega ends too far from where it starts", f"at most {_FREQUENCY_RATIO:g} times its start", *at)
