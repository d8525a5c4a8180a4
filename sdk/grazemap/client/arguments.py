"""Converts the arguments of methods to the fields of a request, and validates it before anything is sent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial, wraps
from inspect import iscoroutinefunction, signature
from typing import Any, ParamSpec, Required, TypedDict, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from grazemap.errors import ParameterError
from grazemap.results import PeriodicOrbit, State
from grazemap.wire import (
    PROCESSES,
    BasinCoordinate,
    ClearancePair,
    InitialState,
    Interval,
    OrbitMotion,
    Oscillator,
    OtherClearance,
    Problem,
    ProblemError,
    ProcessRequest,
    Range,
    SignedInterval,
    Statement,
    StateRange,
    parse_request,
)
from grazemap.wire.base import plain
from grazemap.wire.error_details import errors_of
from grazemap.wire.error_texts import suggestion
from grazemap.wire.observables import OutputRow
from grazemap.wire.planes import Axis, WindowAxis

P = ParamSpec("P")
R = TypeVar("R")

OscillatorLike = Oscillator | Mapping[str, Any] | None
StateLike = InitialState | State | Mapping[str, Any]
"""An initial state, for example the `final` of another trajectory."""
Values = tuple[float, float] | Sequence[float] | NDArray[np.float64] | Range | Mapping[str, Any]
"""(start, stop) together with a number of points, or the increasing values themselves as a list or an array."""
MotionLike = OrbitMotion | PeriodicOrbit | Mapping[str, Any] | tuple[int, Sequence[int]]
"""A motion with impacts: (period, stops); a mapping or a wire model, which may have phases and velocities; or an orbit
that was found. For curves in a window, a mapping may also have omega and clearance."""
ClearanceLike = float | ClearancePair | Mapping[str, Any]
"""The clearance of both stops, or of each: right and left, None for an absent one."""
FixedStopLike = OtherClearance | Mapping[str, Any]
"""The clearance of the one stop that is fixed, right or left; None for an absent one."""
StatementLike = Statement | Mapping[str, Any]
"""A statement to be proven; its motion, initial state and range as those of other methods."""
AxisLike = Axis | Mapping[str, Any] | tuple[Any, ...]
"""A parameter that varies, with its values: ("restitution", 0.5, 0.9), or ("restitution", [0.5, 0.7, 0.9])."""
WindowAxisLike = WindowAxis | Mapping[str, Any] | tuple[str, float, float]
"""A parameter that varies, with its interval: ("restitution", 0.5, 0.9)."""
OutputLike = OutputRow | Mapping[str, Any]
"""An output: a row on displacements, one on velocities, or both, and its unit."""
CoordinateLike = BasinCoordinate | Mapping[str, Any] | tuple[str, int, Any]
"""An initial coordinate: ("displacement" or "velocity", mass, values), or the same as a mapping or a wire model."""

RangesLike = Sequence[float | tuple[float, float] | StateRange | Mapping[str, float]]
"""The ranges of the initial coordinates of every mass: (start, stop), or one value."""


class PathOptions(TypedDict, total=False):
    """The keywords of `trajectory` that are the same for one initial state and for several."""

    omega: Required[float]
    clearance: Required[ClearanceLike]
    periods: Required[int]
    transient_periods: int
    samples_per_period: int | None
    times: Sequence[float] | NDArray[np.float64] | None
    observables: Sequence[str]
    outputs: Mapping[str, OutputLike] | None
    progress: bool


# The title and the detail of the service's problem.
_INVALID_REQUEST = Problem(
    type="urn:grazemap:problem:invalid-request",
    title="Invalid request",
    status=422,
    detail="Values are missing, unknown or out of range; the errors name each of them.",
)
_MOTION = (
    "(period, stops), e.g. (1, [1, 1, -1, -1]) for a motion 1-2r-2l that strikes stop A twice and then stop C; "
    "a mapping, which may also have phases and velocities; or an orbit that was found"
)
_AXIS = 'its name with (start, stop) or with a list, as ("restitution", 0.5, 0.9) or ("omega", [0.26, 0.28])'
_VALUES = "(start, stop) with a number of points, or an increasing list or array"


def naming_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Return a method that names its arguments in the TypeError of a keyword that is none of them."""
    known = [name for name in signature(function).parameters if name != "self"]

    def check(keywords: Mapping[str, Any]) -> None:
        for name in keywords:
            if name not in known:
                near = suggestion(name, known)
                raise TypeError(f"{function.__name__}() has no argument {name}{near} (allowed: {', '.join(known)})")

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        check(kwargs)
        return function(*args, **kwargs)

    @wraps(function)
    async def awaited(*args: P.args, **kwargs: P.kwargs) -> Any:
        check(kwargs)
        return await cast(Any, function)(*args, **kwargs)

    return cast(Callable[P, R], awaited) if iscoroutinefunction(function) else called


def validated(process: str, body: Mapping[str, Any] | ProcessRequest) -> ProcessRequest:
    """Return the request of a process as its wire model.

    Raises
    ------
    ParameterError
        There is no such process, or a value is not allowed.
    """
    if not isinstance(process, str) or process not in PROCESSES:
        near = suggestion(process, PROCESSES) if isinstance(process, str) else ""
        raise _parameter_error("", f"there is no such process{near}", ", ".join(PROCESSES))
    model = PROCESSES[process]
    if isinstance(body, ProcessRequest):
        if not isinstance(body, model) or body.operation is not model.operation:
            raise _parameter_error("", "the request belongs to another process", model.__name__)
        return body
    if not isinstance(body, Mapping):
        raise _parameter_error("", "the request is not an object", "a mapping, as the HTTP interface takes it")
    try:
        return parse_request(process, dict(body))
    except ValidationError as error:
        details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
        raise parameter_error(errors_of(details, model, naming=True)) from None


def validated_each(process: Any, requests: Iterable[Any]) -> list[ProcessRequest]:
    """Return the requests of `Client.map` as their wire models.

    Raises ParameterError, whose pointers begin with the place of the request, as those of a batch do.
    """
    named = isinstance(process, str)
    found = []
    for index, one in enumerate(requests if named else process):
        try:
            if named:
                found.append(validated(process, one))
            elif isinstance(one, ProcessRequest):
                found.append(validated(one.operation.process, one))
            elif isinstance(one, tuple) and len(one) == 2:
                found.append(validated(*one))
            else:
                raise _parameter_error("", "this is no request", "a wire model, or a pair (process, request)")
        except ParameterError as error:
            place = f"/requests/{index}/request"
            below = [each.model_copy(update={"pointer": place + each.pointer}) for each in error.problem.errors]
            raise parameter_error(below) from None
    return found


def parameter_error(errors: Sequence[ProblemError]) -> ParameterError:
    """Return the exception for errors in a request that was not sent."""
    return ParameterError(_INVALID_REQUEST.model_copy(update={"errors": errors}))


def _parameter_error(pointer: str, detail: str, allowed: str) -> ParameterError:
    return parameter_error([ProblemError(pointer=pointer, detail=detail, allowed=allowed)])


def plane(omega: Any, clearance: Any, horizontal: Any, vertical: Any, shape: Any) -> dict[str, Any]:
    """Return the axes of a map, or its ranges; shape is (vertical points, horizontal points). Raises ParameterError."""
    rows, columns = _shape(shape, "(vertical points, horizontal points)")
    clearance = _as_clearance(clearance)
    if horizontal is None and vertical is None:
        return {
            "omega": as_grid("omega", omega, columns, "shape"),
            "clearance": _of_stops(clearance, partial(as_grid, points=rows, keyword="shape")),
        }
    return {
        "omega": plain(omega),
        "clearance": plain(clearance),
        "horizontal": as_axis("horizontal", horizontal, columns, "shape"),
        "vertical": as_axis("vertical", vertical, rows, "shape"),
    }


def as_axis(name: str, axis: Any, points: int | None, keyword: str) -> Any:
    """Return a parameter and its values as the models take them. Raises ParameterError."""
    if axis is None or isinstance(axis, Mapping | Axis):
        return axis
    if not (isinstance(axis, tuple | list) and len(axis) in (2, 3) and isinstance(axis[0], str)):
        raise _parameter_error(f"/{name}", f"{name} is not a parameter with its values", _AXIS)
    values = tuple(axis[1:]) if len(axis) == 3 else axis[1]
    return {"vary": axis[0], "values": as_grid(f"{name}/values", values, points, keyword)}


def _as_clearance(clearance: Any) -> Any:
    """Return the clearances of each stop as a dict, and any other clearance as it is."""
    return dict(clearance) if isinstance(clearance, ClearancePair) else clearance


def _of_stops(clearance: Any, converted: Callable[[str, Any], Any]) -> Any:
    """Return the clearance of both stops, or those of each, converted."""
    if not _is_pair(clearance):
        return converted("clearance", clearance)
    return {name: converted(f"clearance/{name}", value) for name, value in clearance.items()}


def rectangle(horizontal: Any, vertical: Any, shape: Any) -> dict[str, Any]:
    """Return the coordinates of basins; shape is (vertical points, horizontal points). Raises ParameterError."""
    rows, columns = _shape(shape, "(vertical points, horizontal points)")
    return {
        "horizontal": _as_coordinate("horizontal", horizontal, columns),
        "vertical": _as_coordinate("vertical", vertical, rows),
    }


def one_varies(omega: Any, clearance: Any, vary: str | None, values: Any, points: int | None) -> dict[str, Any]:
    """Return the name and the range of the parameter that varies, and the others' values. Raises ParameterError."""
    given = {"omega": omega, "clearance": clearance}
    if vary is not None:
        return {name: plain(value) for name, value in given.items()} | {
            "vary": vary,
            "range": as_grid("range", values, points, "points"),
        }
    numbers = [name for name, value in given.items() if isinstance(plain(value), int | float) or _is_pair(value)]
    if len(numbers) != 1 or None in given.values():
        detail = "one of omega and clearance varies, and the other one is a number"
        raise _parameter_error("/range", detail, f"one number, and for the other {_VALUES}; or vary and range")
    fixed = numbers[0]
    varied = "clearance" if fixed == "omega" else "omega"
    grid = as_grid(varied, given[varied], points, "points")
    return {fixed: plain(given[fixed]), "vary": varied, varied: None, "range": grid}


def _is_pair(value: Any) -> bool:
    """Whether a value is the clearances of each stop."""
    return isinstance(value, ClearancePair) or (isinstance(value, Mapping) and bool({"right", "left"} & value.keys()))


def as_grid(name: str, values: Any, points: int | None, keyword: str) -> Any:
    """Return a range, or the values as a list; a tuple of two numbers is (start, stop).

    Raises ParameterError where the number of points is missing or differs from the number of values; the wire models
    check all else. `name` leads to the values in the request, and `keyword` is the argument that gives the number of
    points.
    """
    said = name.replace("/", ".")
    if isinstance(values, tuple) and len(values) == 3 and isinstance(values[2], int):
        detail = f"{said} is a tuple of three numbers, and the last one would be a value"
        raise _parameter_error(f"/{name}", detail, f"({values[0]}, {values[1]}) with {keyword}, or a list of values")
    if isinstance(values, tuple) and len(values) == 2:
        if points is None:
            raise _parameter_error(f"/{name}", f"{said} has a start and a stop, and {keyword} is missing", _VALUES)
        return {"start": values[0], "stop": values[1], "points": points}
    values = plain(values)
    count = _count(values)
    if points is not None and count is not None and points != count:
        detail = f"{said} has {count} values, and {keyword} gives another number"
        raise _parameter_error(f"/{name}", detail, _VALUES)
    return values


def as_interval(name: str, values: Any) -> Any:
    """Return an interval as the models take it. Raises ParameterError."""
    if isinstance(values, Interval | SignedInterval):
        return values.model_dump()
    values = plain(values)
    if isinstance(values, dict):
        return values
    if not isinstance(values, list) or len(values) != 2:
        detail = f"{name.replace('/', '.')} is not an interval"
        raise _parameter_error(f"/{name}", detail, "(start, stop) with stop > start")
    return {"start": values[0], "stop": values[1]}


def window(omega: Any, clearance: Any, horizontal: Any, vertical: Any) -> dict[str, Any]:
    """Return the intervals of a window, of both clearances or of that of one stop, or its axes. Raises ParameterError.

    With axes omega and clearance are numbers.
    """
    clearance = _as_clearance(clearance)
    if horizontal is not None or vertical is not None:
        axes = {
            "horizontal": _as_window_axis("horizontal", horizontal),
            "vertical": _as_window_axis("vertical", vertical),
        }
        return {"omega": plain(omega), "clearance": plain(clearance), **axes}
    return {"omega": _interval_or_number("omega", omega), "clearance": _of_stops(clearance, _interval_or_number)}


def _interval_or_number(name: str, values: Any) -> Any:
    """Return an interval as `as_interval` does, and what does not vary as it is."""
    fixed = values is None or isinstance(plain(values), int | float)
    return values if fixed else as_interval(name, values)


def _as_window_axis(name: str, axis: Any) -> Any:
    """Return a parameter and its interval as the models take them. Raises ParameterError."""
    if axis is None or isinstance(axis, Mapping | WindowAxis):
        return axis
    if not (isinstance(axis, tuple | list) and len(axis) == 3 and isinstance(axis[0], str)):
        allowed = 'its name with start and stop, as ("restitution", 0.5, 0.9)'
        raise _parameter_error(f"/{name}", f"{name} is not a parameter with its interval", allowed)
    return {"vary": axis[0], "values": as_interval(f"{name}/values", axis[1:])}


def as_ranges(ranges: Any) -> Any:
    """Return ranges of initial coordinates as the models take them: of (start, stop), or of one value."""
    ranges = plain(ranges)
    return list(map(_as_range, ranges)) if isinstance(ranges, list) else ranges


def _as_range(one: Any) -> Any:
    if isinstance(one, StateRange):
        return one.model_dump()
    one = plain(one)
    if isinstance(one, int | float):
        return {"start": one, "stop": one}
    return {"start": one[0], "stop": one[1]} if isinstance(one, list) and len(one) == 2 else one


def as_states(states: Any) -> Any:
    """Return an initial state, or a sequence of them, as the models take it."""
    if isinstance(states, State):
        return {"displacement": states.displacement, "velocity": states.velocity, "phase": states.phase}
    states = plain(states)
    return [as_states(state) for state in states] if isinstance(states, list) else states


def start(motion: Any, initial: Any) -> dict[str, Any]:
    """Return the start of the search for an orbit: a motion or an initial state. Raises ParameterError."""
    return {"motion": None if motion is None else as_motion(motion), "initial": as_states(initial)}


def as_motion(motion: Any, at: str = "/motion", in_window: Mapping[str, str] | None = None) -> Any:
    """Return a motion as the models take it; in a window, with its place there if it is known.

    `in_window` has the attributes of an orbit by the fields of its place. Raises ParameterError for an orbit that was
    not found, or whose place is not known, and for a value that is not a motion.
    """
    if isinstance(motion, tuple | list) and len(motion) == 2:
        return {"period": motion[0], "stops": plain(motion[1])}
    if isinstance(motion, PeriodicOrbit):
        if not motion.converged:
            raise _parameter_error(at, f"this orbit was not found: {motion.reason or 'no reason given'}", _MOTION)
        named = {"period": motion.period, **{name: getattr(motion, name) for name in ("stops", "phases", "velocities")}}
        if in_window is None:
            return named
        place = {field: _value_at(motion, name) for field, name in in_window.items()}
        if None in place.values():
            detail = "an orbit does not say where it is in this window"
            allowed = "a mapping with its period, stops, phases, velocities, horizontal and vertical"
            raise _parameter_error(at, detail, allowed)
        return named | place
    if isinstance(motion, OrbitMotion):
        return motion.model_dump(exclude_none=True)
    if not isinstance(motion, Mapping):
        raise _parameter_error(at, "this is not a motion; its name alone does not give the order of its stops", _MOTION)
    return dict(motion)


def _value_at(orbit: PeriodicOrbit, name: str) -> float | None:
    """Return the value of a parameter at an orbit, of its frequency or a clearance; None of others."""
    found: float | None = getattr(orbit, name, None)
    return orbit.clearance if found is None and name.startswith("clearance") else found


def as_motions(motions: Any, window: Mapping[str, Any]) -> Any:
    """Return the motions of a window, which are its fields, as the models take them. Raises ParameterError."""
    if not isinstance(motions, Sequence) or isinstance(motions, str | bytes):
        return motions
    place = {"omega": "omega", "clearance": "clearance"}
    if window.get("horizontal") is not None or window.get("vertical") is not None:
        given = {name: _vary(window[name]) for name in ("horizontal", "vertical")}
        place = {name: vary for name, vary in given.items() if vary is not None}
    elif isinstance(window["clearance"], Mapping):
        for name in ("right", "left"):
            if isinstance(window["clearance"].get(name), dict):
                place["clearance"] = f"clearance_{name}"
    return [as_motion(motion, f"/motions/{k}", place) for k, motion in enumerate(motions)]


def _vary(axis: Any) -> str | None:
    vary = axis.get("vary") if isinstance(axis, Mapping) else getattr(axis, "vary", None)
    return vary if isinstance(vary, str) else None


def as_statement(statement: Any) -> Any:
    """Return a statement as the models take it. Raises ParameterError."""
    if not isinstance(statement, Mapping):
        return statement
    found = dict(statement)
    if found.get("motion") is not None:
        found["motion"] = as_motion(found["motion"], "/statement/motion")
    if found.get("range") is not None:
        found["range"] = as_interval("statement/range", found["range"])
    if "initial" in found:
        found["initial"] = as_states(found["initial"])
    return found


def _shape(shape: Any, meaning: str) -> tuple[Any, Any]:
    """Return the numbers of rows and columns, both None without a shape. Raises ParameterError."""
    try:
        rows, columns = shape if shape is not None else (None, None)
    except (TypeError, ValueError):
        raise _parameter_error("/shape", "shape is not two numbers", meaning) from None
    return rows, columns


def _as_coordinate(name: str, coordinate: Any, points: int | None) -> Any:
    """Return an initial coordinate as the models take it. Raises ParameterError."""
    if isinstance(coordinate, tuple | list) and len(coordinate) == 3:
        coordinate = dict(zip(("quantity", "mass", "values"), coordinate, strict=True))
    if isinstance(coordinate, Mapping) and "values" in coordinate:
        return {**coordinate, "values": as_grid(f"{name}/values", coordinate["values"], points, "shape")}
    return coordinate


def _count(values: Any) -> int | None:
    """Return how many values a range or a list has, None for anything else."""
    if isinstance(values, list):
        return len(values)
    points = values.get("points") if isinstance(values, dict) else getattr(values, "points", None)
    return points if isinstance(points, int) else None
