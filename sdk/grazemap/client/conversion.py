"""Conversion of what callers pass into the fields of a request, and its check before anything is sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import ValidationError

from grazemap.errors import ParameterError
from grazemap.results import PeriodicOrbit, State
from grazemap.wire import (
    PROCESSES,
    BranchInterval,
    CoordinateRange,
    Interval,
    OrbitMotion,
    Problem,
    ProblemError,
    ProcessRequest,
    Range,
    parse_request,
)
from grazemap.wire.error_details import errors_of

# The service's own words for the same problem.
INVALID_REQUEST = Problem(
    type="urn:grazemap:problem:invalid-request",
    title="Invalid request",
    status=422,
    detail="Values are missing, unknown or out of range; see errors.",
)
_MOTION = (
    "(period, stops), e.g. (1, [1, 1, -1, -1]) for a motion 1-2r-2l that strikes stop A twice and then stop C; "
    "a mapping with phases and velocities too; or an orbit that was found"
)
VALUES = "(start, stop) with a number of points, or an increasing list or array"


def validated(process: str, body: Mapping[str, Any] | ProcessRequest) -> ProcessRequest:
    """Return the request of a process as its wire model.

    Raises
    ------
    ParameterError
        There is no such process, or a value is not allowed.
    """
    if not isinstance(process, str) or process not in PROCESSES:
        raise parameter_error("", "there is no such process", ", ".join(PROCESSES))
    model = PROCESSES[process]
    if isinstance(body, ProcessRequest):
        if not isinstance(body, model):
            raise parameter_error("", "the request belongs to another process", model.__name__)
        return body
    if not isinstance(body, Mapping):
        raise parameter_error("", "the request is not an object", "a mapping, as the HTTP interface takes it")
    try:
        return parse_request(process, dict(body))
    except ValidationError as error:
        details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
        errors = errors_of(details, model, naming=True)
        raise ParameterError(INVALID_REQUEST.model_copy(update={"errors": errors})) from None


def parameter_error(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one wrong argument."""
    error = ProblemError(pointer=pointer, detail=detail, allowed=allowed)
    return ParameterError(INVALID_REQUEST.model_copy(update={"errors": [error]}))


def as_motion(motion: Any, at: str, in_window: bool = False) -> Any:
    """Return a motion as the models take it; one in a window with its omega and clearance, if they are known.

    Raises ParameterError for an orbit that was not found, and for what is no motion.
    """
    if isinstance(motion, tuple | list) and len(motion) == 2:
        return {"period": motion[0], "stops": plain(motion[1])}
    if isinstance(motion, PeriodicOrbit):
        if not motion.converged:
            raise parameter_error(at, f"this orbit was not found: {motion.reason or 'no reason given'}", _MOTION)
        named = {"period": motion.period, **{name: getattr(motion, name) for name in ("stops", "phases", "velocities")}}
        return named | ({"omega": motion.omega, "clearance": motion.clearance} if in_window else {})
    if isinstance(motion, OrbitMotion):
        return motion.model_dump(exclude_none=True)
    if not isinstance(motion, Mapping):
        raise parameter_error(at, "this is not a motion; its name alone does not give the order of its stops", _MOTION)
    return dict(motion)


def as_shape(shape: Any, meaning: str) -> tuple[Any, Any]:
    """Return the numbers of rows and columns, None for both where no shape is given. Raises ParameterError."""
    try:
        rows, columns = shape if shape is not None else (None, None)
    except (TypeError, ValueError):
        raise parameter_error("/shape", "shape is not two numbers", meaning) from None
    return rows, columns


def as_coordinate(name: str, coordinate: Any, points: int | None) -> Any:
    """Return an initial coordinate as the models take it. Raises ParameterError."""
    if isinstance(coordinate, tuple | list) and len(coordinate) == 3:
        quantity, mass, values = coordinate
        return {"quantity": quantity, "mass": mass, "values": as_grid(f"{name}/values", values, points, "shape")}
    if isinstance(coordinate, Mapping) and "values" in coordinate:
        return {**coordinate, "values": as_grid(f"{name}/values", coordinate["values"], points, "shape")}
    return coordinate


def as_state(state: Any) -> Any:
    """Return an initial state as the models take it."""
    if isinstance(state, State):
        return {"displacement": state.displacement, "velocity": state.velocity, "phase": state.phase}
    return plain(state)


def as_grid(name: str, values: Any, points: int | None, keyword: str) -> Any:
    """Return a range, or the values as a list; a tuple of two numbers is (start, stop).

    Raises ParameterError where the number of points is missing, or is not that of the values; all else the models
    check. `keyword` is the argument that gives the number of points.
    """
    if isinstance(values, tuple) and len(values) == 2:
        if points is None:
            raise parameter_error(f"/{name}", f"{name} has a start and a stop, and {keyword} is missing", VALUES)
        return {"start": values[0], "stop": values[1], "points": points}
    values = plain(values)
    count = _count(values)
    if points is not None and count is not None and points != count:
        detail = f"{name} has {count} values, and {keyword} asks for another number"
        raise parameter_error(f"/{name}", detail, VALUES)
    return values


def as_interval(name: str, values: Any) -> Any:
    """Return an interval as the models take it. Raises ParameterError."""
    if isinstance(values, Interval | BranchInterval):
        return values.model_dump()
    values = plain(values)
    if isinstance(values, dict):
        return values
    if not isinstance(values, list) or len(values) != 2:
        raise parameter_error(f"/{name}", f"{name} is not an interval", "(start, stop) with stop > start > 0")
    return {"start": values[0], "stop": values[1]}


def plain(value: Any) -> Any:
    """Return mappings as dicts, sequences and whatever numpy reads as lists, and the rest as it is."""
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str | bytes) else value


def _count(values: Any) -> int | None:
    """Return how many values a range or a list has, None for anything else."""
    if isinstance(values, Range | CoordinateRange):
        return values.points
    if isinstance(values, dict):
        points = values.get("points")
        return points if isinstance(points, int) else None
    return len(values) if isinstance(values, list) else None
