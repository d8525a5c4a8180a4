"""Converts the arguments of methods to the fields of a request, and validates it before anything is sent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
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
    BranchInterval,
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
    Statement,
    parse_request,
)
from grazemap.wire.base import plain
from grazemap.wire.error_details import errors_of
from grazemap.wire.error_texts import suggestion

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
CoordinateLike = BasinCoordinate | Mapping[str, Any] | tuple[str, int, Any]
"""An initial coordinate: ("displacement" or "velocity", mass, values), or the same as a mapping or a wire model."""


class PathOptions(TypedDict, total=False):
    """The keywords of `trajectory` that are the same for one initial state and for several."""

    omega: Required[float]
    clearance: Required[float]
    periods: Required[int]
    transient_periods: int
    samples_per_period: int | None
    times: Sequence[float] | NDArray[np.float64] | None
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


def plane(omega: Any, clearance: Any, shape: Any) -> dict[str, Any]:
    """Return the ranges of a map; shape is (clearance points, omega points). Raises ParameterError."""
    rows, columns = _shape(shape, "(clearance points, omega points)")
    return {
        "omega": as_grid("omega", omega, columns, "shape"),
        "clearance": as_grid("clearance", clearance, rows, "shape"),
    }


def rectangle(horizontal: Any, vertical: Any, shape: Any) -> dict[str, Any]:
    """Return the coordinates of basins; shape is (vertical points, horizontal points). Raises ParameterError."""
    rows, columns = _shape(shape, "(vertical points, horizontal points)")
    return {
        "horizontal": _as_coordinate("horizontal", horizontal, columns),
        "vertical": _as_coordinate("vertical", vertical, rows),
    }


def one_varies(omega: Any, clearance: Any, points: int | None) -> dict[str, Any]:
    """Return the name and the range of the parameter that varies, and the value of the other. Raises ParameterError."""
    given = {"omega": omega, "clearance": clearance}
    numbers = [name for name, value in given.items() if isinstance(plain(value), int | float)]
    if len(numbers) != 1:
        detail = "one of omega and clearance varies, and the other one is a number"
        raise _parameter_error("/range", detail, f"one number, and for the other {_VALUES}")
    fixed = numbers[0]
    vary = "clearance" if fixed == "omega" else "omega"
    return {fixed: plain(given[fixed]), "vary": vary, vary: None, "range": as_grid(vary, given[vary], points, "points")}


def as_grid(name: str, values: Any, points: int | None, keyword: str) -> Any:
    """Return a range, or the values as a list; a tuple of two numbers is (start, stop).

    Raises ParameterError where the number of points is missing or differs from the number of values; the wire models
    check all else. `keyword` is the name of the argument that gives the number of points.
    """
    if isinstance(values, tuple) and len(values) == 3 and isinstance(values[2], int):
        detail = f"{name} is a tuple of three numbers, and the last one would be a value"
        raise _parameter_error(f"/{name}", detail, f"({values[0]}, {values[1]}) with {keyword}, or a list of values")
    if isinstance(values, tuple) and len(values) == 2:
        if points is None:
            raise _parameter_error(f"/{name}", f"{name} has a start and a stop, and {keyword} is missing", _VALUES)
        return {"start": values[0], "stop": values[1], "points": points}
    values = plain(values)
    count = _count(values)
    if points is not None and count is not None and points != count:
        detail = f"{name} has {count} values, and {keyword} gives another number"
        raise _parameter_error(f"/{name}", detail, _VALUES)
    return values


def as_interval(name: str, values: Any) -> Any:
    """Return an interval as the models take it. Raises ParameterError."""
    if isinstance(values, Interval | BranchInterval):
        return values.model_dump()
    values = plain(values)
    if isinstance(values, dict):
        return values
    if not isinstance(values, list) or len(values) != 2:
        raise _parameter_error(f"/{name}", f"{name} is not an interval", "(start, stop) with stop > start > 0")
    return {"start": values[0], "stop": values[1]}


def as_states(states: Any) -> Any:
    """Return an initial state, or a sequence of them, as the models take it."""
    if isinstance(states, State):
        return {"displacement": states.displacement, "velocity": states.velocity, "phase": states.phase}
    states = plain(states)
    return [as_states(state) for state in states] if isinstance(states, list) else states


def start(motion: Any, initial: Any) -> dict[str, Any]:
    """Return the start of the search for an orbit: a motion or an initial state. Raises ParameterError."""
    return {"motion": None if motion is None else as_motion(motion), "initial": as_states(initial)}


def as_motion(motion: Any, at: str = "/motion", in_window: bool = False) -> Any:
    """Return a motion as the models take it; in a window, with its omega and clearance if they are known.

    Raises ParameterError for an orbit that was not found, and for a value that is not a motion.
    """
    if isinstance(motion, tuple | list) and len(motion) == 2:
        return {"period": motion[0], "stops": plain(motion[1])}
    if isinstance(motion, PeriodicOrbit):
        if not motion.converged:
            raise _parameter_error(at, f"this orbit was not found: {motion.reason or 'no reason given'}", _MOTION)
        named = {"period": motion.period, **{name: getattr(motion, name) for name in ("stops", "phases", "velocities")}}
        return named | ({"omega": motion.omega, "clearance": motion.clearance} if in_window else {})
    if isinstance(motion, OrbitMotion):
        return motion.model_dump(exclude_none=True)
    if not isinstance(motion, Mapping):
        raise _parameter_error(at, "this is not a motion; its name alone does not give the order of its stops", _MOTION)
    return dict(motion)


def as_motions(motions: Any) -> Any:
    """Return the motions of a window as the models take them. Raises ParameterError."""
    if not isinstance(motions, Sequence) or isinstance(motions, str | bytes):
        return motions
    return [as_motion(motion, f"/motions/{k}", in_window=True) for k, motion in enumerate(motions)]


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
