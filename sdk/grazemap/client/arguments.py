"""Arguments of methods become the fields of a request, which is validated before anything is sent.

A field takes further forms from Python, by its type: tuples for ranges, results for states and motions. The service
takes none of them. Whatever numpy reads as a list or a number is one for every field (`wire.base.plain`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Protocol, Union, get_args, get_origin, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from grazemap.results import PeriodicOrbit, State
from grazemap.units import Refused, Shown, in_si
from grazemap.wire import (
    BasinCoordinate,
    BifurcationCurvesRequest,
    ClearancePair,
    InitialState,
    Interval,
    OrbitMotion,
    Oscillator,
    ProblemError,
    ProcessRequest,
    Range,
    Statement,
    StateRange,
)
from grazemap.wire.base import Kind, is_range_or_list, plain
from grazemap.wire.observables import OutputRow
from grazemap.wire.planes import ALLOWED, AXES, Axis, WindowAxis, vary_of
from grazemap.wire.problems import parameter_error, refusal
from grazemap.wire.structure import is_of_sides

OscillatorLike = Oscillator | Mapping[str, Any] | None
StateLike = InitialState | State | Mapping[str, Any]
Values = tuple[float, float] | Sequence[float] | NDArray[np.float64] | Range | Mapping[str, Any]
"""(start, stop) together with a number of points, or the increasing values themselves as a list or an array."""
MotionLike = OrbitMotion | PeriodicOrbit | Mapping[str, Any] | tuple[int, Sequence[int]]
ClearanceLike = float | ClearancePair | Mapping[str, Any]
StatementLike = Statement | Mapping[str, Any]
AxisLike = Axis | Mapping[str, Any] | tuple[Any, ...]
WindowAxisLike = WindowAxis | Mapping[str, Any] | tuple[str, float, float]
OutputLike = OutputRow | Mapping[str, Any]
CoordinateLike = BasinCoordinate | Mapping[str, Any] | tuple[str, int, Any]
RangesLike = Sequence[float | tuple[float, float] | StateRange | Mapping[str, float]]

_MOTION = (
    "(period, stops), e.g. (1, [1, 1, -1, -1]) for a motion 1-2r-2l that hits the right stop twice and then the left; "
    "a mapping, which may also have phases and velocities; or an orbit that was found"
)
_AXIS = 'its name with (start, stop) or with a list, as ("restitution", 0.5, 0.9) or ("omega", [0.26, 0.28])'
_VALUES = "(start, stop) with a number of points, or an increasing list or array"


@runtime_checkable
class Provable(Protocol):
    """A part of a result that knows the statement which proves it, and its oscillator."""

    @property
    def oscillator(self) -> dict[str, Any] | None:
        """The oscillator of the request."""

    def statement(self) -> dict[str, Any]:
        """Return the statement of proofs."""


class Argument(NamedTuple):
    """The place of a value that is converted."""

    name: str
    """Leads to the value in the request."""
    points: Any = None
    """The number of values of a range, as another argument gives it."""
    keyword: str = ""
    """The name of that other argument."""
    fields: Mapping[str, Any] = {}
    """The fields of the request that were converted before."""
    is_usual: bool = False
    """Whether nobody gave that number: it is for (start, stop) only."""

    def below(self, name: str) -> Argument:
        """Return the place of a value in this one."""
        return self._replace(name=f"{self.name}/{name}")


Convert = Callable[[Argument, Any], Any]


class Form(NamedTuple):
    """How the values of a type of fields are given."""

    annotation: str
    """For the signature."""
    text: str
    """For the docstring."""
    convert: Convert = lambda _, value: plain(value)
    """Returns a value as the request takes it; may raise ParameterError."""
    more: str = ""
    """What the docstring says beside the description of the field."""
    counted: bool = False
    """Whether (start, stop) needs a number of points."""


def with_si_numbers(body: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the fields of a request with numbers for texts with a unit, as "9 Hz", and the units for its result.

    Raises ParameterError.
    """
    oscillator = body.get("oscillator")
    units = oscillator.get("units") if isinstance(oscillator, Mapping) else getattr(oscillator, "units", None)
    refused: list[Refused] = []
    shown = Shown()
    fields: dict[str, Any] = in_si(body, units or "nondimensional", refused, shown=shown)
    if refused:
        raise parameter_error([ProblemError(**entry._asdict()) for entry in refused])
    return fields, shown.units


def as_grid(argument: Argument, values: Any) -> Any:
    """Return a range, or the values as a list; a tuple of two numbers is (start, stop).

    Raises ParameterError where the number of points is missing or differs from the number of values; the wire models
    check all else.
    """
    name, points, keyword = argument.name.replace("/", "."), argument.points, argument.keyword
    at = f"/{argument.name}"
    if isinstance(values, tuple) and len(values) == 3 and isinstance(values[2], Integral):
        detail = f"{name} is a tuple of three numbers, and the last one would be a value"
        raise refusal(at, detail, f"({values[0]}, {values[1]}) with {keyword}, or a list of values")
    if isinstance(values, tuple) and len(values) == 2:
        if points is None:
            raise refusal(at, f"{name} has a start and a stop, and {keyword} is missing", _VALUES)
        return {"start": values[0], "stop": values[1], "points": points}
    values = values.model_dump() if isinstance(values, Range) else plain(values)
    count = _count(values)
    if points is not None and count is not None and points != count and not argument.is_usual:
        raise refusal(at, f"{name} has {count} values, and {keyword} gives another number", _VALUES)
    return values


def _count(values: Any) -> int | None:
    """Return how many values a range or a list has, None for anything else."""
    if isinstance(values, list):
        return len(values)
    points = values.get("points") if isinstance(values, dict) else getattr(values, "points", None)
    return points if isinstance(points, int) else None


def as_interval(argument: Argument, values: Any) -> Any:
    """Return an interval as the models take it. Raises ParameterError."""
    if isinstance(values, Interval):
        return values.model_dump()
    values = plain(values)
    if isinstance(values, dict):
        return values
    if not isinstance(values, list) or len(values) != 2:
        detail = f"{argument.name.replace('/', '.')} is not an interval"
        raise refusal(f"/{argument.name}", detail, "(start, stop) with stop > start")
    return {"start": values[0], "stop": values[1]}


def _as_frequencies(argument: Argument, omega: Any) -> Any:
    """Return forcing frequencies that vary as the models take them, or the one frequency. Raises ParameterError."""
    if not is_range_or_list(plain(omega)):
        return plain(omega)
    return as_grid(argument, omega) if argument.keyword else as_interval(argument, omega)


def _as_clearance(argument: Argument, clearance: Any) -> Any:
    """Return clearances of both stops, or of each; those that vary as the models take them. Raises ParameterError."""
    if not is_of_sides(clearance):
        return _as_frequencies(argument, clearance)
    if isinstance(clearance, ClearancePair):
        return clearance
    return {name: _as_frequencies(argument.below(name), value) for name, value in clearance.items()}


def _as_axis(argument: Argument, axis: Any) -> Any:
    """Return a parameter and its values as the models take them. Raises ParameterError."""
    if isinstance(axis, Axis):
        axis = axis.model_dump()
    if isinstance(axis, Mapping):
        return {**axis, "values": as_grid(argument.below("values"), axis["values"])} if "values" in axis else axis
    if not (isinstance(axis, tuple | list) and len(axis) in (2, 3) and isinstance(axis[0], str)):
        raise refusal(f"/{argument.name}", f"{argument.name} is not a parameter with its values", _AXIS)
    values = tuple(axis[1:]) if len(axis) == 3 else axis[1]
    return {"vary": axis[0], "values": as_grid(argument.below("values"), values)}


def _as_window_axis(argument: Argument, axis: Any) -> Any:
    """Return a parameter and its interval as the models take them. Raises ParameterError."""
    if isinstance(axis, Mapping | WindowAxis):
        return axis
    if not (isinstance(axis, tuple | list) and len(axis) == 3 and isinstance(axis[0], str)):
        allowed = 'its name with start and stop, as ("restitution", 0.5, 0.9)'
        raise refusal(f"/{argument.name}", f"{argument.name} is not a parameter with its interval", allowed)
    return {"vary": axis[0], "values": as_interval(argument.below("values"), axis[1:])}


def _as_coordinate(argument: Argument, coordinate: Any) -> Any:
    """Return an initial coordinate as the models take it. Raises ParameterError."""
    if isinstance(coordinate, tuple | list) and len(coordinate) == 3:
        coordinate = dict(zip(("quantity", "mass", "values"), coordinate, strict=True))
    if isinstance(coordinate, Mapping) and "values" in coordinate:
        return {**coordinate, "values": as_grid(argument.below("values"), coordinate["values"])}
    return coordinate


def _as_ranges(_: Argument, ranges: Any) -> Any:
    """Return ranges of initial coordinates as the models take them: of (start, stop), or of one value."""
    ranges = plain(ranges)
    return list(map(_as_range, ranges)) if isinstance(ranges, list) else ranges


def _as_range(span: Any) -> Any:
    span = plain(span)
    if isinstance(span, int | float | str):  # a number, also with a unit
        return {"start": span, "stop": span}
    return {"start": span[0], "stop": span[1]} if isinstance(span, list) and len(span) == 2 else span


def _as_sizes(_: Argument, sizes: Any) -> Any:
    """Return numbers as a list, also a single one."""
    sizes = plain(sizes)
    return [sizes] if isinstance(sizes, int | float | str) else sizes


def _as_states(argument: Argument, states: Any) -> Any:
    """Return an initial state, or a sequence of them, as the models take it."""
    if isinstance(states, State):
        return {"displacement": states.displacement, "velocity": states.velocity, "phase": states.phase}
    states = plain(states)
    return [_as_states(argument, state) for state in states] if isinstance(states, list) else states


def _as_motion(argument: Argument, motion: Any, window: Mapping[str, str] | None = None) -> Any:
    """Return a motion as the models take it; in a window, with its place there if it is known.

    `window` has the parameters of the window's axes, by the names of these. Raises ParameterError for an orbit that was
    not found, or whose place is not known, and for a value that is not a motion.
    """
    at = f"/{argument.name}"
    if isinstance(motion, tuple | list) and len(motion) == 2:
        return {"period": motion[0], "stops": plain(motion[1])}
    if isinstance(motion, PeriodicOrbit):
        if not motion.converged:
            raise refusal(at, f"this orbit was not found: {motion.reason or 'no reason given'}", _MOTION)
        named = {"period": motion.period, **{name: getattr(motion, name) for name in ("stops", "phases", "velocities")}}
        if window is None:
            return named
        place = {axis: _value_at(motion, vary) for axis, vary in window.items()}
        if None in place.values():
            detail = "an orbit does not say where it is in this window"
            allowed = "a mapping with its period, stops, phases, velocities, horizontal and vertical"
            raise refusal(at, detail, allowed)
        return named | place
    if isinstance(motion, OrbitMotion):
        return motion.model_dump(exclude_none=True)
    if not isinstance(motion, Mapping):
        raise refusal(at, "this is not a motion; its name alone does not give the order of its stops", _MOTION)
    return dict(motion)


def _value_at(orbit: PeriodicOrbit, name: str) -> float | None:
    """Return the value of a parameter at an orbit, of its frequency or a clearance; None of others."""
    value: float | None = getattr(orbit, name, None)
    return orbit.clearance if value is None and name.startswith("clearance") else value


def _as_motions(argument: Argument, motions: Any) -> Any:
    """Return the motions of a window as the models take them. Raises ParameterError."""
    if not isinstance(motions, Sequence) or isinstance(motions, str | bytes):
        return motions
    try:
        body, _ = BifurcationCurvesRequest.long_form(dict(argument.fields))
    except PydanticCustomError:  # the validation of the request says what is wrong
        body = {}
    varied = {axis: vary_of(body.get(axis)) for axis in AXES}
    window = {axis: vary for axis, vary in varied.items() if vary is not None}
    return [_as_motion(argument.below(str(k)), motion, window) for k, motion in enumerate(motions)]


def as_statement(argument: Argument, statement: Any) -> Any:
    """Return a statement as the models take it. Raises ParameterError."""
    if not isinstance(statement, Mapping):
        return statement
    converted = dict(statement)
    for name, convert in (("motion", _as_motion), ("range", as_interval), ("initial", _as_states)):
        if converted.get(name) is not None:
            converted[name] = convert(argument.below(name), converted[name])
    return converted


_ONE_STOP = (
    '``{"right": (start, stop), "left": None}`` is of one stop; a number in place of None is the clearance of the '
    "other one. With axes the clearances are numbers, unless they vary."
)
_AXES = f"The parameter is {ALLOWED}."
_GRID = "(start, stop) or increasing list or array"
_FORMS = {
    **{name: Form(name, name) for name in ("int", "float", "bool", "str")},
    "Literal": Form("str", "str"),
    "list[float]": Form("Sequence[float] | NDArray[np.float64]", "list or array"),
    "list[Literal]": Form("Sequence[str]", "sequence of str"),
    "dict[OutputRow]": Form(
        "Mapping[str, OutputLike]",
        "mapping",
        more='For example ``{"spring": {"displacement": [..], "unit": "N"}}``, or with ``velocity``.',
    ),
    "Oscillator": Form("OscillatorLike", "Oscillator or mapping"),
    "grid": Form("Values", _GRID, as_grid, counted=True),
    "frequencies": Form("Values", "(start, stop), or list or array", as_grid, counted=True),
    "Interval": Form("tuple[float, float]", "(start, stop)", as_interval),
    "clearance": Form("ClearanceLike", "float, or mapping with right and left"),
    "clearance of the other stop": Form("ClearanceLike", "mapping with right or left"),
    "Axis": Form(
        "AxisLike", "(str, start, stop) or (str, list or array) or mapping", _as_axis, more=_AXES, counted=True
    ),
    "WindowAxis": Form("WindowAxisLike", "(str, start, stop) or mapping", _as_window_axis, more=_AXES),
    "BasinCoordinate": Form(
        "CoordinateLike",
        "(str, int, values) or mapping",
        _as_coordinate,
        more='"displacement" or "velocity", the mass (1 to N), and (start, stop) or an increasing list or array. The '
        "contact must start between the stops.",
        counted=True,
    ),
    "InitialState": Form("StateLike", "State, InitialState or mapping", _as_states),
    "states": Form(
        "StateLike | Sequence[StateLike]",
        "State, InitialState or mapping, or a sequence of them",
        _as_states,
        more="For example the `final` of another trajectory; left out: at rest.",
    ),
    "state ranges": Form("RangesLike", "sequence of (float, float) or float", _as_ranges),
    "sizes": Form("float | Sequence[float] | NDArray[np.float64]", "float, or list or array", _as_sizes),
    "OrbitMotion": Form(
        "MotionLike",
        "(period, stops), mapping or PeriodicOrbit",
        _as_motion,
        more="Forcing periods, and +1 (right) or -1 (left) for every impact in order. A mapping or an orbit may have "
        "phases and velocities, the initial guess of Newton's method.",
    ),
    "list[CurveMotion]": Form(
        "Sequence[MotionLike]",
        "sequence of (period, stops), mappings or PeriodicOrbits",
        _as_motions,
        more="A mapping may have omega and clearance (that which varies) of an orbit in the window, or its horizontal "
        "and vertical values, and phases and velocities.",
    ),
    "Statement": Form(
        "StatementLike",
        "Statement or mapping",
        as_statement,
        more="``kind`` and its numbers. A motion, an initial state and a range are written as for the other methods.",
    ),
}
_OTHER = Form("Mapping[str, Any]", "mapping")


def short_forms(request: type[ProcessRequest]) -> dict[str, Form]:
    """Return how the arguments of a request are given that stand for its axes, by their names."""
    if request.short is None:
        return {}
    axis: Any = request.model_fields[request.short.axes[0]].annotation
    counted = issubclass(axis, Axis)
    type_, text = ("Values", _GRID) if counted else ("tuple[float, float]", "(start, stop)")
    values = as_grid if counted else as_interval
    forms = {
        "omega": Form(f"{type_} | float", f"{text}; float", _as_frequencies, counted=counted),
        "clearance": Form(
            f"{type_} | ClearanceLike", f"{text}; float or mapping", _as_clearance, _ONE_STOP, counted=counted
        ),
        "vary": Form("str", "str", more=_AXES),
        "range": Form(type_, text, values, counted=counted),
    }
    if request.short.vary is None and len(request.short.axes) == 1:
        forms["omega"] = Form(type_, text, values, counted=counted)
    return {name: forms[name] for name in request.short.fields}


def form_of(field: FieldInfo) -> Form:
    """Return how the values of a field are given."""
    return _FORMS.get(_kind(field.annotation, field.metadata), _OTHER)


def choices_of(annotation: Any) -> tuple[Any, ...]:
    """Return the values of a type of which there are a few."""
    while get_origin(annotation) in (Annotated, list):
        annotation = get_args(annotation)[0]
    return get_args(annotation) if get_origin(annotation) is Literal else ()


def _kind(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """Return the name of a type: that of its `Kind`, or else of its class, without that of None."""
    named = next((item.name for item in metadata if isinstance(item, Kind)), "")
    origin, inner = get_origin(annotation), [part for part in get_args(annotation) if part is not NoneType]
    if named or origin is None:
        return named or getattr(annotation, "__name__", "")
    if origin is Annotated:
        return _kind(inner[0], inner[1:])
    if origin in (Union, UnionType):
        return _kind(inner[0]) if len(inner) == 1 else ""
    return "Literal" if origin is Literal else f"{origin.__name__}[{_kind(inner[-1])}]"
