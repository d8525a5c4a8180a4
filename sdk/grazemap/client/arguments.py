"""Requests: the wire model of a request from the arguments of a client's method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap.client.conversion import (
    VALUES,
    as_coordinate,
    as_grid,
    as_interval,
    as_motion,
    as_shape,
    as_state,
    parameter_error,
    plain,
    validated,
)
from grazemap.results import PeriodicOrbit, State
from grazemap.wire import (
    BasinCoordinate,
    BasinsRequest,
    BifurcationCurvesRequest,
    BifurcationDiagramsRequest,
    CodimensionTwoPointsRequest,
    DiscontinuityMappingsRequest,
    GrazingCurvesRequest,
    InitialState,
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
"""An initial state, for example the `final` of another trajectory."""
Values = tuple[float, float] | Sequence[float] | NDArray[np.float64] | Range | Mapping[str, Any]
"""(start, stop) together with a number of points, or the increasing values themselves as a list or an array."""

MotionLike = OrbitMotion | PeriodicOrbit | Mapping[str, Any] | tuple[int, Sequence[int]]
"""A motion with impacts: (period, stops), the same and phases and velocities as a mapping or a wire model, or an orbit
that was found; a mapping or an orbit for curves in a window also has omega and clearance."""
CoordinateLike = BasinCoordinate | Mapping[str, Any] | tuple[str, int, Any]
"""An initial coordinate: ("displacement" or "velocity", mass, values), or the same as a mapping or a wire model."""


def grazing_curve(
    oscillator: OscillatorLike, omega: Values, points: int | None, max_order: int, sequence: bool = False
) -> GrazingCurvesRequest:
    """Return the request for a grazing curve. Raises ParameterError."""
    body = {"omega": as_grid("omega", omega, points, "points"), "max_order": max_order, "sequence": sequence}
    return request_of(GrazingCurvesRequest, oscillator, body)


def codimension_two_points(
    oscillator: OscillatorLike, omega: tuple[float, float], max_order: int, max_multiple: int
) -> CodimensionTwoPointsRequest:
    """Return the request for the codimension-two points of an interval. Raises ParameterError."""
    body = {"omega": as_interval("omega", omega), "max_order": max_order, "max_multiple": max_multiple}
    return request_of(CodimensionTwoPointsRequest, oscillator, body)


def discontinuity_mapping(
    oscillator: OscillatorLike,
    omega: float,
    overshoot: float | Sequence[float] | NDArray[np.float64],
    stop: str,
    order: str,
    returns: int,
) -> DiscontinuityMappingsRequest:
    """Return the request for a discontinuity mapping; one overshoot may be a number. Raises ParameterError."""
    sizes = plain(overshoot)
    body = {
        "omega": omega,
        "overshoot": [sizes] if isinstance(sizes, int | float) else sizes,
        "stop": stop,
        "order": order,
        "returns": returns,
    }
    return request_of(DiscontinuityMappingsRequest, oscillator, body)


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
    """Return the request for a trajectory, or for one from each of several states. Raises ParameterError."""
    body: dict[str, Any] = {
        "omega": omega,
        "clearance": clearance,
        "periods": periods,
        "transient_periods": transient_periods,
    }
    for name, value in (("samples_per_period", samples_per_period), ("times", times)):
        if value is not None:
            body[name] = plain(value)
    if initial is not None:
        several = isinstance(initial, Sequence) and not isinstance(initial, str | bytes)
        body["initial"] = [as_state(state) for state in plain(initial)] if several else as_state(initial)
    return request_of(TrajectoriesRequest, oscillator, body)


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
    """Return the request for an unfolding map; shape is (clearance points, omega points). Raises ParameterError."""
    body = {
        **_plane(omega, clearance, shape),
        "policy": policy,
        "max_periods": max_periods,
        "max_period": max_period,
        "initial_conditions": initial_conditions,
        "seed": seed,
        "adaptive": adaptive,
        "preview": preview,
    }
    return request_of(UnfoldingMapsRequest, oscillator, body)


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
    """Return the request for an unfolding diagram; shape as for an unfolding map. Raises ParameterError."""
    body = {
        **_plane(omega, clearance, shape),
        "max_periods": max_periods,
        "max_period": max_period,
        "max_order": max_order,
        "max_multiple": max_multiple,
        "borders": borders,
    }
    return request_of(UnfoldingDiagramsRequest, oscillator, body)


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
    """Return the request for a bifurcation diagram: one of omega and clearance is a number. Raises ParameterError."""
    given = {"omega": omega, "clearance": clearance}
    numbers = [name for name, value in given.items() if isinstance(plain(value), int | float)]
    if len(numbers) != 1:
        detail = "one of omega and clearance varies, and the other one is a number"
        raise parameter_error("/range", detail, f"one number, and for the other {VALUES}")
    fixed = numbers[0]
    vary = "clearance" if fixed == "omega" else "omega"
    body = {
        "vary": vary,
        "range": as_grid(vary, given[vary], points, "points"),
        fixed: plain(given[fixed]),
        "policy": policy,
        "periods": periods,
        "transient_periods": transient_periods,
        "max_period": max_period,
    }
    return request_of(BifurcationDiagramsRequest, oscillator, body)


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
    """Return the request for basins; shape is (vertical points, horizontal points). Raises ParameterError."""
    rows, columns = as_shape(shape, "(vertical points, horizontal points)")
    body: dict[str, Any] = {
        "omega": omega,
        "clearance": clearance,
        "horizontal": as_coordinate("horizontal", horizontal, columns),
        "vertical": as_coordinate("vertical", vertical, rows),
        "max_periods": max_periods,
        "max_period": max_period,
    }
    if initial is not None:
        body["initial"] = as_state(initial)
    return request_of(BasinsRequest, oscillator, body)


def periodic_orbit(
    oscillator: OscillatorLike,
    omega: float,
    clearance: float,
    motion: MotionLike | None,
    initial: StateLike | None,
    transient_periods: int,
    max_period: int,
) -> PeriodicOrbitsRequest:
    """Return the request for a periodic orbit. Raises ParameterError."""
    body = _orbit(omega, clearance, motion, initial, transient_periods, max_period)
    return request_of(PeriodicOrbitsRequest, oscillator, body)


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
    """Return the request for the branch of a periodic orbit. Raises ParameterError."""
    body = _orbit(omega, clearance, motion, initial, transient_periods, max_period)
    body |= {"vary": vary, "range": as_interval("range", range), "max_points": max_points}
    return request_of(OrbitBranchesRequest, oscillator, body)


def bifurcation_curves(
    oscillator: OscillatorLike,
    omega: tuple[float, float],
    clearance: tuple[float, float],
    max_multiple: int,
    points: int,
    motions: Sequence[MotionLike] | None = None,
) -> BifurcationCurvesRequest:
    """Return the request for the bifurcation curves of a window. Raises ParameterError."""
    body = {
        "omega": as_interval("omega", omega),
        "clearance": as_interval("clearance", clearance),
        "max_multiple": max_multiple,
        "points": points,
    }
    if motions is not None:
        several = isinstance(motions, Sequence) and not isinstance(motions, str | bytes)
        body["motions"] = (
            [as_motion(motion, f"/motions/{k}", in_window=True) for k, motion in enumerate(motions)]
            if several
            else motions
        )
    return request_of(BifurcationCurvesRequest, oscillator, body)


def _plane(omega: Values, clearance: Values, shape: tuple[int, int] | None) -> dict[str, Any]:
    rows, columns = as_shape(shape, "(clearance points, omega points)")
    return {
        "omega": as_grid("omega", omega, columns, "shape"),
        "clearance": as_grid("clearance", clearance, rows, "shape"),
    }


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
        body["motion"] = as_motion(motion, "/motion")
    if initial is not None:
        body["initial"] = as_state(initial)
    return body


def request_of(model: type[R], oscillator: OscillatorLike, body: dict[str, Any]) -> R:
    """Return the request with these fields, and the oscillator if one is given. Raises ParameterError."""
    if oscillator is not None:
        body["oscillator"] = plain(oscillator)
    request = validated(model.operation.process, body)
    assert isinstance(request, model)
    return request
