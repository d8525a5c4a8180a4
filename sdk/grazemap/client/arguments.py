"""From the keywords of the client's methods to the wire model of a question; nothing is sent from here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap.client.validation import parameter_error, validated
from grazemap.results import PeriodicOrbit, State
from grazemap.wire import (
    BasinCoordinate,
    BasinsRequest,
    BifurcationCurvesRequest,
    BifurcationDiagramsRequest,
    BranchInterval,
    CodimensionTwoPointsRequest,
    CoordinateRange,
    DiscontinuityMappingsRequest,
    GrazingCurvesRequest,
    InitialState,
    Interval,
    OrbitBranchesRequest,
    OrbitMotion,
    Oscillator,
    PeriodicOrbitsRequest,
    ProcessRequest,
    Range,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
    UnfoldingMapsRequest,
)

R = TypeVar("R", bound=ProcessRequest)
OscillatorLike = Oscillator | Mapping[str, Any] | None
StateLike = InitialState | State | Mapping[str, Any]
"""Where a trajectory starts: the end of another one among them."""
Values = tuple[float, float] | Sequence[float] | NDArray[np.float64] | Range | Mapping[str, Any]
"""(start, stop) together with a number of points, or the increasing values themselves as a list or an array."""

MotionLike = OrbitMotion | PeriodicOrbit | Mapping[str, Any] | tuple[int, Sequence[int]]
"""A motion with impacts: (period, stops), the same and phases and velocities as a mapping or a wire model, or an orbit
that was found; of curves in a window a mapping, or the orbit, says too where in it the motion is."""
CoordinateLike = BasinCoordinate | Mapping[str, Any] | tuple[str, int, Any]
"""An initial coordinate: ("displacement" or "velocity", mass, values), or the same as a mapping or a wire model."""

_MOTION = (
    "(period, stops), e.g. (1, [1, 1, -1, -1]) for a motion 1-2r-2l that strikes stop A twice and then stop C; "
    "a mapping with phases and velocities too; or an orbit that was found"
)
_VALUES = "(start, stop) with a number of points, or an increasing list or array"


def grazing_curve(
    oscillator: OscillatorLike, omega: Values, points: int | None, max_order: int, sequence: bool = False
) -> GrazingCurvesRequest:
    """Return the question for a grazing curve. Raises ParameterError."""
    body = {"omega": _grid("omega", omega, points, "points"), "max_order": max_order, "sequence": sequence}
    return _request(GrazingCurvesRequest, "grazing-curves", oscillator, body)


def codimension_two_points(
    oscillator: OscillatorLike, omega: tuple[float, float], max_order: int, max_multiple: int
) -> CodimensionTwoPointsRequest:
    """Return the question for the codimension-two points of an interval. Raises ParameterError."""
    body = {"omega": _interval("omega", omega), "max_order": max_order, "max_multiple": max_multiple}
    return _request(CodimensionTwoPointsRequest, "codimension-two-points", oscillator, body)


def discontinuity_mapping(
    oscillator: OscillatorLike,
    omega: float,
    overshoot: float | Sequence[float] | NDArray[np.float64],
    stop: str,
    order: str,
    returns: int,
) -> DiscontinuityMappingsRequest:
    """Return the question for a discontinuity mapping; one overshoot may be a number. Raises ParameterError."""
    sizes = _plain(overshoot)
    body = {
        "omega": omega,
        "overshoot": [sizes] if isinstance(sizes, int | float) else sizes,
        "stop": stop,
        "order": order,
        "returns": returns,
    }
    return _request(DiscontinuityMappingsRequest, "discontinuity-mappings", oscillator, body)


def trajectory(
    oscillator: OscillatorLike,
    omega: float,
    clearance: float,
    initial: StateLike | Sequence[StateLike] | None,
    periods: int,
    transient_periods: int,
    samples_per_period: int | None,
    times: Sequence[float] | NDArray[np.float64] | None = None,
) -> TrajectoriesRequest:
    """Return the question for a trajectory, or for one from each of several states. Raises ParameterError."""
    body: dict[str, Any] = {
        "omega": omega,
        "clearance": clearance,
        "periods": periods,
        "transient_periods": transient_periods,
    }
    for name, value in (("samples_per_period", samples_per_period), ("times", times)):
        if value is not None:
            body[name] = _plain(value)
    if initial is not None:
        several = isinstance(initial, Sequence) and not isinstance(initial, str | bytes)
        body["initial"] = [_state(state) for state in _plain(initial)] if several else _state(initial)
    return _request(TrajectoriesRequest, "trajectories", oscillator, body)


def unfolding_map(
    oscillator: OscillatorLike,
    omega: Values,
    clearance: Values,
    shape: tuple[int, int] | None,
    policy: str,
    max_periods: int,
    max_period: int,
    initial_conditions: int = 16,
    seed: int = 0,
    adaptive: bool = False,
    preview: bool = False,
) -> UnfoldingMapsRequest:
    """Return the question for an unfolding map; shape is (clearance points, omega points). Raises ParameterError."""
    rows, columns = _shape(shape, "(clearance points, omega points)")
    body = {
        "omega": _grid("omega", omega, columns, "shape"),
        "clearance": _grid("clearance", clearance, rows, "shape"),
        "policy": policy,
        "max_periods": max_periods,
        "max_period": max_period,
        "initial_conditions": initial_conditions,
        "seed": seed,
        "adaptive": adaptive,
        "preview": preview,
    }
    return _request(UnfoldingMapsRequest, "unfolding-maps", oscillator, body)


def unfolding_diagram(
    oscillator: OscillatorLike,
    omega: Values,
    clearance: Values,
    shape: tuple[int, int] | None,
    max_periods: int,
    max_period: int,
    max_order: int,
    max_multiple: int,
    borders: bool,
) -> UnfoldingDiagramsRequest:
    """Return the question for an unfolding diagram; shape as of an unfolding map. Raises ParameterError."""
    rows, columns = _shape(shape, "(clearance points, omega points)")
    body = {
        "omega": _grid("omega", omega, columns, "shape"),
        "clearance": _grid("clearance", clearance, rows, "shape"),
        "max_periods": max_periods,
        "max_period": max_period,
        "max_order": max_order,
        "max_multiple": max_multiple,
        "borders": borders,
    }
    return _request(UnfoldingDiagramsRequest, "unfolding-diagrams", oscillator, body)


def bifurcation_diagram(
    oscillator: OscillatorLike,
    omega: Any,
    clearance: Any,
    points: int | None,
    policy: str,
    periods: int,
    transient_periods: int,
    max_period: int,
) -> BifurcationDiagramsRequest:
    """Return the question for a bifurcation diagram: one of omega and clearance is a number. Raises ParameterError."""
    given = {"omega": omega, "clearance": clearance}
    numbers = [name for name, value in given.items() if isinstance(_plain(value), int | float)]
    if len(numbers) != 1:
        detail = "one of omega and clearance varies, and the other one is a number"
        raise parameter_error("/range", detail, f"one number, and for the other {_VALUES}")
    fixed = numbers[0]
    vary = "clearance" if fixed == "omega" else "omega"
    body = {
        "vary": vary,
        "range": _grid(vary, given[vary], points, "points"),
        fixed: _plain(given[fixed]),
        "policy": policy,
        "periods": periods,
        "transient_periods": transient_periods,
        "max_period": max_period,
    }
    return _request(BifurcationDiagramsRequest, "bifurcation-diagrams", oscillator, body)


def basins(
    oscillator: OscillatorLike,
    omega: float,
    clearance: float,
    horizontal: CoordinateLike,
    vertical: CoordinateLike,
    shape: tuple[int, int] | None,
    initial: StateLike | None,
    max_periods: int,
    max_period: int,
) -> BasinsRequest:
    """Return the question for a basin picture; shape is (vertical points, horizontal points). Raises ParameterError."""
    rows, columns = _shape(shape, "(vertical points, horizontal points)")
    body: dict[str, Any] = {
        "omega": omega,
        "clearance": clearance,
        "horizontal": _coordinate("horizontal", horizontal, columns),
        "vertical": _coordinate("vertical", vertical, rows),
        "max_periods": max_periods,
        "max_period": max_period,
    }
    if initial is not None:
        body["initial"] = _state(initial)
    return _request(BasinsRequest, "basins", oscillator, body)


def periodic_orbit(
    oscillator: OscillatorLike,
    omega: float,
    clearance: float,
    motion: MotionLike | None,
    initial: StateLike | None,
    transient_periods: int,
    max_period: int,
) -> PeriodicOrbitsRequest:
    """Return the question for a periodic orbit. Raises ParameterError."""
    body = _orbit(omega, clearance, motion, initial, transient_periods, max_period)
    return _request(PeriodicOrbitsRequest, "periodic-orbits", oscillator, body)


def orbit_branch(
    oscillator: OscillatorLike,
    omega: float,
    clearance: float,
    motion: MotionLike | None,
    initial: StateLike | None,
    transient_periods: int,
    max_period: int,
    vary: str,
    range: tuple[float, float],
    max_points: int,
) -> OrbitBranchesRequest:
    """Return the question for the branch of a periodic orbit. Raises ParameterError."""
    body = _orbit(omega, clearance, motion, initial, transient_periods, max_period)
    body |= {"vary": vary, "range": _interval("range", range), "max_points": max_points}
    return _request(OrbitBranchesRequest, "orbit-branches", oscillator, body)


def bifurcation_curves(
    oscillator: OscillatorLike,
    omega: tuple[float, float],
    clearance: tuple[float, float],
    max_multiple: int,
    points: int,
    motions: Sequence[MotionLike] | None = None,
) -> BifurcationCurvesRequest:
    """Return the question for the bifurcation curves of a window. Raises ParameterError."""
    body = {
        "omega": _interval("omega", omega),
        "clearance": _interval("clearance", clearance),
        "max_multiple": max_multiple,
        "points": points,
    }
    if motions is not None:
        several = isinstance(motions, Sequence) and not isinstance(motions, str | bytes)
        body["motions"] = (
            [_motion(motion, f"/motions/{k}", in_window=True) for k, motion in enumerate(motions)]
            if several
            else motions
        )
    return _request(BifurcationCurvesRequest, "bifurcation-curves", oscillator, body)


def _orbit(
    omega: float, clearance: float, motion: Any, initial: Any, transient_periods: int, max_period: int
) -> dict[str, Any]:
    body = {
        "omega": omega,
        "clearance": clearance,
        "transient_periods": transient_periods,
        "max_period": max_period,
    }
    if motion is not None:
        body["motion"] = _motion(motion, "/motion")
    if initial is not None:
        body["initial"] = _state(initial)
    return body


def _motion(motion: Any, at: str, in_window: bool = False) -> Any:
    """Return a motion as the models take it; those in a window say where in it they are, if that is known."""
    if isinstance(motion, tuple | list) and len(motion) == 2:
        return {"period": motion[0], "stops": _plain(motion[1])}
    if isinstance(motion, PeriodicOrbit):
        if not motion.converged:
            raise parameter_error(at, f"this orbit was not found: {motion.reason or 'no reason given'}", _MOTION)
        named = {"period": motion.period, **{name: getattr(motion, name) for name in ("stops", "phases", "velocities")}}
        return named | ({"omega": motion.omega, "clearance": motion.clearance} if in_window else {})
    if isinstance(motion, OrbitMotion):
        return motion.model_dump(exclude_none=True)
    if not isinstance(motion, Mapping):
        raise parameter_error(at, "this is not a motion; its name alone does not tell the order of its stops", _MOTION)
    return dict(motion)


def _shape(shape: Any, meaning: str) -> tuple[Any, Any]:
    try:
        rows, columns = shape if shape is not None else (None, None)
    except (TypeError, ValueError):
        raise parameter_error("/shape", "shape is not two numbers", meaning) from None
    return rows, columns


def _coordinate(name: str, coordinate: Any, points: int | None) -> Any:
    if isinstance(coordinate, tuple | list) and len(coordinate) == 3:
        quantity, mass, values = coordinate
        return {"quantity": quantity, "mass": mass, "values": _grid(f"{name}/values", values, points, "shape")}
    if isinstance(coordinate, Mapping) and "values" in coordinate:
        return {**coordinate, "values": _grid(f"{name}/values", coordinate["values"], points, "shape")}
    return coordinate


def _state(state: Any) -> Any:
    if isinstance(state, State):
        return {"displacement": state.displacement, "velocity": state.velocity, "phase": state.phase}
    return _plain(state)


def _request(model: type[R], process: str, oscillator: OscillatorLike, body: dict[str, Any]) -> R:
    if oscillator is not None:
        body["oscillator"] = _plain(oscillator)
    request = validated(process, body)
    if not isinstance(request, model):
        raise TypeError(f"{process} is not asked with a {model.__name__}")
    return request


def _grid(name: str, values: Any, points: int | None, keyword: str) -> Any:
    """Return a range or the values as they are; the model judges them. A tuple of two numbers is (start, stop)."""
    if isinstance(values, tuple) and len(values) == 2:
        if points is None:
            raise parameter_error(f"/{name}", f"{name} has a start and a stop, and {keyword} is missing", _VALUES)
        return {"start": values[0], "stop": values[1], "points": points}
    values = _plain(values)
    count = _count(values)
    if points is not None and count is not None and points != count:
        detail = f"{name} has {count} values, and {keyword} asks for another number"
        raise parameter_error(f"/{name}", detail, _VALUES)
    return values


def _interval(name: str, values: Any) -> Any:
    if isinstance(values, Interval | BranchInterval):
        return values.model_dump()
    values = _plain(values)
    if isinstance(values, dict):
        return values
    if not isinstance(values, list) or len(values) != 2:
        raise parameter_error(f"/{name}", f"{name} is not an interval", "(start, stop) with stop > start > 0")
    return {"start": values[0], "stop": values[1]}


def _plain(value: Any) -> Any:
    """Return mappings as dicts, sequences and whatever numpy reads as lists; the rest is the model's to refuse."""
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str | bytes) else value


def _count(values: Any) -> int | None:
    """Return how many values a range or a list has, None for what is neither."""
    if isinstance(values, Range | CoordinateRange):
        return values.points
    if isinstance(values, dict):
        points = values.get("points")
        return points if isinstance(points, int) else None
    return len(values) if isinstance(values, list) else None
