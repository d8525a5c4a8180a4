"""What varies in maps, diagrams and branches: one or two parameters of the motion, of the stops or of the structure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from grazemap.described import described
from grazemap.wire.base import (
    CoordinateGrid,
    CoordinateRange,
    Interval,
    Range,
    Request,
    SignedInterval,
    grid_points,
    invalid,
)
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.structure import (
    Base,
    ClearanceGrid,
    ClearancePair,
    ClearanceWindow,
    FixedStops,
    Forcing,
    Matrices,
    ModalDamping,
    RayleighDamping,
    RestitutionPair,
    restitutions,
)

_OF_ONE = ("omega", "bias", "forcing", "damping")
_OF_STOPS = tuple(f"{name}{side}" for name in ("clearance", "restitution") for side in ("", "_right", "_left"))
SCALARS = (*_OF_STOPS, "bias", "forcing")
"""The parameters that are neither the frequency nor one of the structure."""
_OF_LISTS = ("masses", "stiffnesses", "dampings")
_INDEXED = re.compile(rf"({'|'.join(_OF_LISTS)})\[([1-9][0-9]*)\]")
_PATTERN = rf"^({'|'.join((*_OF_ONE, *_OF_STOPS))}|({'|'.join(_OF_LISTS)})\[[1-9][0-9]*\])$"
ALLOWED = f"one of {', '.join((*_OF_ONE, *_OF_STOPS))}, masses[i], stiffnesses[i], dampings[i], with i from 1"
_POSITIVE = ("omega", "clearance", "forcing", "masses", "stiffnesses")
_NOT_NEGATIVE = ("damping", "dampings")


def _known(name: str) -> str:
    if re.match(_PATTERN, name) is None:
        raise invalid("there is no such parameter", ALLOWED)
    return name


_OF_SIDES = (ClearanceGrid, ClearanceWindow, FixedStops)
_GRID = "a range or an increasing list"
_ONE_STOP = 'left out, or the other stop alone: {"left": 1.2}'
Varied = Annotated[str, AfterValidator(_known), Field(json_schema_extra={"pattern": _PATTERN})]
"""The name of a parameter that varies."""


class _Varying(Request):
    vary: Varied
    """omega, clearance or restitution (_right, _left: of one stop); a factor bias, forcing, damping; masses[i], .."""


class Axis(_Varying):
    """A parameter that varies, and its values."""

    values: CoordinateGrid
    """Its values: a range, or an increasing list."""

    def require_domain(self, *at: str) -> None:
        """Refuse values that are out of the domain of the parameter; `at` is the place of the axis in the request."""
        for end in self.ends:
            require_domain(self.vary, end, *at)

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last value."""
        values = self.values
        return (values.start, values.stop) if isinstance(values, Range | CoordinateRange) else (values[0], values[-1])


class WindowAxis(_Varying):
    """A parameter that varies, and the interval of its values."""

    values: SignedInterval
    """The interval of its values."""

    @property
    def axis(self) -> Axis:
        """The parameter with the two ends."""
        return Axis.model_construct(vary=self.vary, values=[self.values.start, self.values.stop])


def require_domain(name: str, value: float, *at: str) -> None:
    """Refuse a value that is out of the domain of a parameter; `at` is its place."""
    kind = name.partition("[")[0]
    if kind.startswith("restitution") and not 0.0 <= value <= 1.0:
        raise invalid(f"{name} is between 0 and 1", "0 to 1", *at)
    if kind in _POSITIVE and not value > 0.0:
        raise invalid(f"{name} is greater than 0", "numbers > 0", *at)
    if kind in _NOT_NEGATIVE and not value >= 0.0:
        raise invalid(f"{name} is at least 0", "numbers >= 0", *at)


@described
@dataclass(frozen=True)
class PlanePoint:
    """A point of a plane or of a line."""

    oscillator: Oscillator
    """The oscillator, with the values of the point."""
    omega: float
    """The forcing frequency."""
    clearance: ClearancePair
    """The clearances of the stops."""


@described
@dataclass(frozen=True)
class Parameters:
    """The values of all parameters but those that vary."""

    oscillator: Oscillator
    """The oscillator."""
    omega: float | None
    """None: it varies."""
    right: float | None
    """Clearance of the right stop; None where it varies, and for an absent stop."""
    left: float | None
    """Clearance of the left stop, likewise."""

    def at(self, values: Mapping[str, float]) -> PlanePoint:
        """Return the point at which parameters have these values."""
        return PlanePoint(self.oscillator_at(values), *self.place(values))

    def oscillator_at(self, values: Mapping[str, float]) -> Oscillator:
        """Return the oscillator with these values of its parameters."""
        oscillator = self.oscillator
        for name, value in values.items():
            if not is_place(name):
                oscillator = with_parameter(oscillator, name, value)
        return oscillator

    def place(self, values: Mapping[str, float]) -> tuple[float, ClearancePair]:
        """Return the frequency and the clearances at these values."""
        omega, right, left = values.get("omega", self.omega), self.right, self.left
        for name, value in values.items():
            if name in ("clearance", "clearance_right"):
                right = value
            if name in ("clearance", "clearance_left"):
                left = value
        assert omega is not None  # as validated
        return omega, ClearancePair.model_construct(right=right, left=left)

    def require(self, name: str, *at: str) -> None:
        """Refuse a parameter that the oscillator does not have; `at` is the place of the name in the request."""
        oscillator, indexed = self.oscillator, _INDEXED.fullmatch(name)
        if name == "bias" and not any(oscillator.bias or ()):
            raise invalid("the bias varies, and the oscillator has none", "another parameter, or a bias", *at)
        if name == "forcing" and not oscillator.orders:
            raise invalid("the forces vary, and there are none", "another parameter, or forces", *at)
        if indexed is None:
            return
        if oscillator.matrices is not None:
            raise invalid(f"{indexed[1]} are those of a chain", "a chain, or another parameter", *at)
        if int(indexed[2]) > oscillator.size:
            raise invalid(f"{name} does not exist", f"{indexed[1]}[1] to {indexed[1]}[{oscillator.size}]", *at)
        if indexed[1] == "dampings" and not isinstance(oscillator.damping, list):
            detail = "dampings[i] is one of a list of dampings, and the oscillator has one number for all links"
            raise invalid(detail, "a list of dampings, or the parameter damping, which is a factor", *at)


def is_scalar(name: str) -> bool:
    """Return whether trajectories that differ in a parameter share the tables of their structure."""
    return name in SCALARS


def is_of_gaps(name: str) -> bool:
    """Return whether a parameter moves the stops relative to the motion, so that curves over it are explicit."""
    return name in ("bias", "forcing") or name.startswith("clearance")


def is_structural(name: str) -> bool:
    """Return whether a parameter is one of the linear structure."""
    return name == "damping" or _INDEXED.fullmatch(name) is not None


def structure_value(oscillator: Oscillator, name: str) -> float:
    """Return the value of a parameter of the structure; 1 of the damping, which is a factor."""
    indexed = _INDEXED.fullmatch(name)
    return 1.0 if indexed is None else float(getattr(oscillator, _field(indexed))[int(indexed[2]) - 1])


def is_place(name: str) -> bool:
    """Return whether a parameter is the frequency or a clearance, not one of the oscillator."""
    return name == "omega" or name.startswith("clearance")


@described
@dataclass(frozen=True)
class Line:
    """One parameter that varies, and the values of the others."""

    parameters: Parameters
    """The values of the others."""
    axis: Axis
    """What varies, and its values."""

    def corners(self) -> list[PlanePoint]:
        """Return the points at the ends."""
        return [self.parameters.at({self.axis.vary: end}) for end in self.axis.ends]


@described
@dataclass(frozen=True)
class Plane:
    """Two parameters that vary, and the values of the others."""

    parameters: Parameters
    """The values of the others."""
    horizontal: Axis
    """What varies along the rows, and its values."""
    vertical: Axis
    """What varies along the columns, and its values."""

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of values, vertical and horizontal."""
        return grid_points(self.vertical.values), grid_points(self.horizontal.values)

    @property
    def names(self) -> tuple[str, str]:
        """The names of the horizontal and of the vertical parameter."""
        return self.horizontal.vary, self.vertical.vary

    @property
    def mirrors(self) -> bool:
        """Whether mirror images of motions are motions too at all points: both stops, and the forces, are alike."""
        oscillator, parameters = self.parameters.oscillator, self.parameters
        alike = "clearance" in self.names or parameters.right == parameters.left is not None
        broken = any(name == "bias" or name.endswith(("_right", "_left")) for name in self.names)
        same = oscillator.has_equal_restitution or "restitution" in self.names
        return alike and not broken and oscillator.is_symmetric and same

    def corners(self) -> list[PlanePoint]:
        """Return the points at the corners."""
        across, up = self.horizontal, self.vertical
        return [self.parameters.at({across.vary: x, up.vary: y}) for x in across.ends for y in up.ends]


def with_parameter(oscillator: Oscillator, name: str, value: float) -> Oscillator:
    """Return the oscillator with a value of a parameter that it has; of bias, forcing and damping with a factor."""
    indexed = _INDEXED.fullmatch(name)
    changes: dict[str, Any]
    if indexed is not None:
        field = _field(indexed)
        values = list(getattr(oscillator, field))
        values[int(indexed[2]) - 1] = value
        changes = {field: values}
    elif name.startswith("restitution"):
        changes = {"restitution": _restitution(oscillator, name, value)}
    elif name == "bias":
        changes = {"bias": [value * one for one in oscillator.bias or ()]}
    elif name == "forcing":
        changes = _scaled_forces(oscillator, value)
    else:
        changes = _scaled_damping(oscillator, value)
    return oscillator.model_copy(update=changes)


def _field(indexed: re.Match[str]) -> str:
    """Return the field of an oscillator that has the values of masses[i], stiffnesses[i] or dampings[i]."""
    return {"dampings": "damping"}.get(indexed[1], indexed[1])


def _restitution(oscillator: Oscillator, name: str, value: float) -> float | RestitutionPair:
    if name == "restitution":
        return value
    right, left = restitutions(oscillator.restitution)
    if name == "restitution_right":
        return RestitutionPair.model_construct(right=value, left=left)
    return RestitutionPair.model_construct(right=right, left=value)


def _scaled_forces(oscillator: Oscillator, factor: float) -> dict[str, Any]:
    forcing: Any = oscillator.forcing
    several = oscillator.harmonics
    changes: dict[str, Any] = {"forcing": [factor * one for one in forcing]} if not several else {}
    if several:
        scaled = [one.model_copy(update={"amplitude": [factor * part for part in one.amplitude]}) for one in several]
        changes = {"forcing": scaled[0] if isinstance(forcing, Forcing) else scaled}
    if oscillator.base is not None:
        moved: Base = oscillator.base.model_copy(update={"amplitude": factor * oscillator.base.amplitude})
        changes["base"] = moved
    return changes


def _scaled_damping(oscillator: Oscillator, factor: float) -> dict[str, Any]:
    if oscillator.matrices is None:
        given = oscillator.damping
        return {"damping": [factor * one for one in given] if isinstance(given, list) else factor * given}
    of: Any = oscillator.matrices.damping
    if isinstance(of, ModalDamping):
        modal = [factor * one for one in of.modal] if isinstance(of.modal, list) else factor * of.modal
        of = of.model_copy(update={"modal": modal})
    elif isinstance(of, RayleighDamping):
        of = of.model_copy(update={"rayleigh": [factor * one for one in of.rayleigh]})
    else:
        of = [[factor * one for one in row] for row in of]
    matrices: Matrices = oscillator.matrices.model_copy(update={"damping": of})
    return {"matrices": matrices}


def axes(omega: Any, clearance: Any, horizontal: Any, vertical: Any, given: str = _GRID) -> tuple[Axis, Axis]:
    """Return the axes of a map or a window: those that are given, or those of the ranges of omega and clearance.

    `given` describes such a range.
    """
    if horizontal is not None and vertical is not None:
        for name, value in (("omega", omega), ("clearance", clearance)):
            if any(map(_varies, (value.right, value.left) if isinstance(value, _OF_SIDES) else (value,))):
                raise invalid(f"{name} has a range beside the axes", "numbers, or left out where it varies", name)
        return _as_axis(horizontal), _as_axis(vertical)
    for one, other in (("horizontal", "vertical"), ("vertical", "horizontal")):
        if (horizontal if one == "horizontal" else vertical) is not None:
            raise invalid(
                f"{one} is given, and {other} is missing", "both axes, or ranges of omega and clearance", other
            )
    allowed = f"{given}, or the axes horizontal and vertical"
    if not _varies(omega):
        raise invalid("omega does not vary" if omega else "omega is missing", allowed, "omega")
    sides = {} if not isinstance(clearance, _OF_SIDES) else {one: getattr(clearance, one) for one in ("right", "left")}
    stop = next((one for one, side in sides.items() if _varies(side)), None)
    values: Any = clearance if stop is None else sides[stop]
    if not _varies(values):
        raise invalid("clearance does not vary" if clearance else "clearance is missing", allowed, "clearance")
    name = "clearance" if stop is None else f"clearance_{stop}"
    return _axis("omega", omega), _axis(name, values)


def _varies(given: Any) -> bool:
    """Whether the values of a parameter are a range, a list or an interval."""
    return isinstance(given, Interval | list)


def _axis(name: str, values: Any) -> Axis:
    """Return the axis of a range, a list, or of the ends of an interval."""
    ends = isinstance(values, Interval) and not isinstance(values, Range)
    return Axis.model_construct(vary=name, values=[values.start, values.stop] if ends else values)


def _as_axis(given: Axis | WindowAxis) -> Axis:
    return given.axis if isinstance(given, WindowAxis) else given


def plane_of(oscillator: Oscillator, omega: Any, clearance: Any, horizontal: Axis, vertical: Axis) -> Plane:
    """Return the plane of two axes; refuse what is missing, what is given twice, and values out of their domains."""
    _require_different(horizontal.vary, vertical.vary)
    parameters = _others(oscillator, omega, clearance, (horizontal.vary, vertical.vary))
    plane = Plane(parameters, horizontal, vertical)
    for name, axis in (("horizontal", horizontal), ("vertical", vertical)):
        parameters.require(axis.vary, name, "vary")
        axis.require_domain(name, "values")
    _require_space(plane.corners()[0])
    return plane


def line_of(oscillator: Oscillator, omega: Any, clearance: Any, vary: str, values: Any) -> Line:
    """Return the line of a parameter; refuse as `plane_of`. The names of its fields are vary and range."""
    parameters = _others(oscillator, omega, clearance, (vary,))
    line = Line(parameters, Axis.model_construct(vary=vary, values=values))
    parameters.require(vary, "vary")
    line.axis.require_domain("range")
    _require_space(line.corners()[0])
    return line


def _others(oscillator: Oscillator, omega: Any, clearance: Any, varied: tuple[str, ...]) -> Parameters:
    """Return the values of the parameters that do not vary."""
    fixed = omega if "omega" not in varied or not _varies(omega) else None
    if "omega" in varied and fixed is not None:
        raise invalid("omega varies: its values are those of an axis", "left out", "omega")
    if "omega" not in varied and not isinstance(fixed, float | int):
        raise invalid("omega is missing: it does not vary", "a finite number > 0", "omega")
    return Parameters(oscillator, fixed, *_fixed_stops(clearance, varied))


def _require_space(point: PlanePoint) -> None:
    right, left = point.clearance.right, point.clearance.left
    if right is not None and left is not None and not right + left > 0.0:
        raise invalid("the stops leave no space between them", "right + left > 0", "clearance")


def _require_different(one: str, other: str) -> None:
    """Refuse two axes of one parameter, or of that of both stops and that of one of them."""
    if one == other or one.startswith(f"{other}_") or other.startswith(f"{one}_"):
        detail = "both axes have the same parameter" if one == other else f"{one} and {other} are not independent"
        raise invalid(detail, "two different parameters", "vertical", "vary")


def _fixed_stops(clearance: Any, varied: tuple[str, ...]) -> tuple[float | None, float | None]:
    """Return the clearances of the right and of the left stop where they do not vary; None also for an absent stop."""
    named = [name for name in varied if name.startswith("clearance")]
    if _varies(clearance):
        if "clearance" not in named:
            raise invalid("clearance has a range beside the axes", "numbers", "clearance")
        return None, None
    if isinstance(clearance, _OF_SIDES):
        return _of_sides({stop: getattr(clearance, stop) for stop in ("right", "left")}, named)
    if clearance is not None and named:
        raise invalid(f"{named[0]} varies: its values are those of an axis", _ONE_STOP, "clearance")
    if clearance is None and not named:
        raise invalid("clearance is missing", 'a number, or {"right": .., "left": ..}', "clearance")
    return clearance, clearance


def _of_sides(sides: Mapping[str, Any], named: list[str]) -> tuple[float | None, float | None]:
    """Return the clearances of `_fixed_stops` where those of each stop are given."""
    if "clearance" in named:
        raise invalid("clearance varies: its values are those of an axis", "left out", "clearance")
    fixed = []
    for stop, side in sides.items():
        varies, has_range = f"clearance_{stop}" in named, _varies(side)
        if has_range and named != [f"clearance_{stop}"]:
            raise invalid("clearance has a range beside the axes", "a number", "clearance", stop)
        if varies and side is not None and not has_range:
            detail = f"clearance_{stop} varies: its values are those of an axis"
            raise invalid(detail, "left out or null where it varies", "clearance", stop)
        fixed.append(None if varies else side)
    if not named and fixed == [None, None]:
        raise invalid("both stops are absent", "right, left, or both", "clearance")
    return fixed[0], fixed[1]


def ranges_of(plane: Plane, stops: type[ClearanceGrid | ClearanceWindow] = ClearanceGrid) -> dict[str, Any] | None:
    """Return a plane of omega and clearance as the fields of ranges, so that equal requests have the same text.

    `stops` is the model of the clearances of each stop; with intervals the ranges are these.
    """
    across, up = plane.horizontal, plane.vertical
    if across.vary != "omega" or not up.vary.startswith("clearance") or not up.ends[0] > 0.0:
        return None
    omega, values = (_as_range(one, stops is ClearanceWindow) for one in (across, up))
    clearance: Any = values
    if up.vary != "clearance":
        stop, other = ("right", "left") if up.vary == "clearance_right" else ("left", "right")
        clearance = stops(**{stop: values, other: getattr(plane.parameters, other)})
    return {"omega": omega, "clearance": clearance, "horizontal": None, "vertical": None}


def _as_range(axis: Axis, interval: bool) -> Any:
    if interval:
        return Interval(start=axis.ends[0], stop=axis.ends[1])
    return Range(**axis.values.model_dump()) if isinstance(axis.values, CoordinateRange) else axis.values


def fixed_stops_of(plane: Plane, stops: type[ClearanceGrid | ClearanceWindow] = ClearanceGrid) -> dict[str, Any]:
    """Return the field of fixed clearances in its simplest form: one number for two equal ones."""
    right, left = plane.parameters.right, plane.parameters.left
    if right is None and left is None:
        return {"clearance": None}
    same = right == left and right is not None and right > 0.0
    return {"clearance": right if same else stops(right=right, left=left)}
