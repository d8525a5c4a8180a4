"""What varies in maps, diagrams and branches: one or two parameters of the motion, of the stops or of the structure.

Also the bases of the requests in which one parameter varies, or two of them, and the request of maps.

>>> request = UnfoldingMapsRequest(omega=[0.28, 0.29], clearance=[1.5, 1.6])
>>> request.horizontal.vary, request.vertical.values
('omega', [1.5, 1.6])
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from grazemap.constants import COORDINATE_UNITS, UNITS
from grazemap.described import described
from grazemap.wire.base import (
    Grid,
    Interval,
    LeftOut,
    Listable,
    Positive,
    PositiveGrid,
    PositiveInterval,
    Range,
    Request,
    grid_points,
    invalid,
)
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.process import Operation, ProcessRequest, ShortForms
from grazemap.wire.states import MOST_OTHER_STARTS, MaxPeriod, MaxPeriods, Seed
from grazemap.wire.structure import (
    SIDES,
    ClearancePair,
    FixedClearance,
    Forcing,
    ModalDamping,
    RayleighDamping,
    RestitutionPair,
    as_pair,
    restitutions,
)

AXES = ("horizontal", "vertical")
"""The fields of a request that have the two parameters of a plane."""
# So many find a motion to which a quarter of the states lead nine times in ten.
OTHER_STARTS_OF_MAP = 8

_PLAIN_NAMES = ("omega", "bias", "forcing", "damping")
OF_STOPS = tuple(f"{name}{side}" for name in ("clearance", "restitution") for side in ("", "_right", "_left"))
SCALARS = (*OF_STOPS, "bias", "forcing")
"""The parameters that change neither the frequency nor the structure, so that trajectories share its tables."""
_LISTS = ("masses", "stiffnesses", "dampings")
_INDEXED = re.compile(rf"({'|'.join(_LISTS)})\[([1-9][0-9]*)\]")
_PATTERN = rf"^({'|'.join((*_PLAIN_NAMES, *OF_STOPS))}|({'|'.join(_LISTS)})\[[1-9][0-9]*\])$"
ALLOWED = f"one of {', '.join((*_PLAIN_NAMES, *OF_STOPS))}, masses[i], stiffnesses[i], dampings[i], with i from 1"
_POSITIVE = ("omega", "clearance", "forcing", "masses", "stiffnesses")
_NOT_NEGATIVE = ("damping", "dampings")


def _known(name: str) -> str:
    if re.fullmatch(_PATTERN, name) is None:
        raise invalid("there is no such parameter", ALLOWED)
    return name


Varied = Annotated[str, AfterValidator(_known), Field(json_schema_extra={"pattern": _PATTERN})]
"""The name of a parameter that varies."""


class _Varying(Request):
    vary: Varied
    """omega; clearance or restitution (_right, _left: one stop); a factor on bias, forcing, damping; masses[i], etc."""
    values: Range | Interval | list[float]

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last value."""
        return ends_of(self.values)


def unit_of(name: str) -> str:
    """Return the unit in SI of a parameter, or of an initial coordinate; empty if it has none."""
    return (UNITS | COORDINATE_UNITS).get(name.partition("[")[0], "")


class Axis(_Varying):
    """A parameter that varies, and its values."""

    values: Grid
    """Its values: a range, or an increasing list."""

    @property
    def grid(self) -> Range | list[float]:
        """Its values."""
        return self.values


class WindowAxis(_Varying):
    """A parameter that varies, and the interval of its values."""

    values: Interval
    """The interval of its values."""

    @property
    def grid(self) -> Range | list[float]:
        """The two ends."""
        return [*self.ends]


class Frequencies(Axis):
    """Forcing frequencies."""

    vary: Literal["omega"] = "omega"
    """The forcing frequency."""
    values: PositiveGrid
    """Its values: a range, or an increasing list."""


class FrequencyWindow(WindowAxis):
    """An interval of forcing frequencies."""

    vary: Literal["omega"] = "omega"
    """The forcing frequency."""
    values: PositiveInterval
    """The interval of its values."""


def vary_of(axis: Any) -> str | None:
    """Return the name of the parameter of an axis, a model or as it is written; None where there is none."""
    vary = axis.get("vary") if isinstance(axis, Mapping) else getattr(axis, "vary", None)
    return vary if isinstance(vary, str) else None


def ends_of(values: Range | Interval | list[float]) -> tuple[float, float]:
    """Return the first and the last of increasing values."""
    return (values[0], values[-1]) if isinstance(values, list) else (values.start, values.stop)


def require_values(axis: Axis | WindowAxis, *at: str) -> None:
    """Refuse values that are out of the domain of their parameter; `at` is the path of their field in the request."""
    places = ("0", str(len(axis.values) - 1)) if isinstance(axis.values, list) else ("start", "stop")
    for end, place in zip(axis.ends, places, strict=True):
        require_domain(axis.vary, end, *at, place)


def require_domain(name: str, value: float, *at: str) -> None:
    """Refuse a value that is out of the domain of a parameter; `at` is the path of its field in the request."""
    kind = name.partition("[")[0]
    if kind.startswith("restitution") and not 0.0 <= value <= 1.0:
        raise invalid(f"{name} must be between 0 and 1", "0 to 1", *at)
    if kind in _POSITIVE and not value > 0.0:
        raise invalid(f"{name} must be greater than 0", "numbers > 0", *at)
    if kind in _NOT_NEGATIVE and not value >= 0.0:
        raise invalid(f"{name} must be at least 0", "numbers >= 0", *at)


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
        """Refuse a parameter that the oscillator does not have; `at` is the path of the name in the request."""
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


def is_structural(name: str) -> bool:
    """Return whether a parameter is a mass, a stiffness or a damping."""
    return name == "damping" or _INDEXED.fullmatch(name) is not None


def structure_value(oscillator: Oscillator, name: str) -> float:
    """Return the value of a parameter of the structure; 1 for `damping`, which is a factor."""
    indexed = _INDEXED.fullmatch(name)
    return 1.0 if indexed is None else float(getattr(oscillator, _field(indexed))[int(indexed[2]) - 1])


def is_place(name: str) -> bool:
    """Return whether a parameter is the frequency or a clearance; all others are of the oscillator."""
    return name == "omega" or name.startswith("clearance")


@described
@dataclass(frozen=True)
class Line:
    """One parameter that varies, and the values of the others."""

    parameters: Parameters
    """The values of the parameters that do not vary."""
    axis: Axis | WindowAxis
    """What varies, and its values."""

    @property
    def names(self) -> tuple[str]:
        """The name of the parameter."""
        return (self.axis.vary,)

    def corners(self) -> list[PlanePoint]:
        """Return the points at the ends."""
        return [self.parameters.at({self.axis.vary: end}) for end in self.axis.ends]


@described
@dataclass(frozen=True)
class Plane:
    """Two parameters that vary, and the values of the others."""

    parameters: Parameters
    """The values of the parameters that do not vary."""
    horizontal: Axis | WindowAxis
    """What varies along the rows, and its values."""
    vertical: Axis | WindowAxis
    """What varies along the columns, and its values."""

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of values, vertical and horizontal."""
        return grid_points(self.vertical.grid), grid_points(self.horizontal.grid)

    @property
    def names(self) -> tuple[str, str]:
        """The names of the horizontal and of the vertical parameter."""
        return self.horizontal.vary, self.vertical.vary

    @property
    def fields(self) -> tuple[str, str]:
        """The names of the fields of a result that have the values of the two parameters.

        They are omega and clearance if the frequency is horizontal and a clearance, of both stops or of one, is
        vertical and positive.
        """
        across, up = self.names
        of_usual = across == "omega" and up.startswith("clearance") and self.vertical.ends[0] > 0.0
        return ("omega", "clearance") if of_usual else AXES

    @property
    def mirrors(self) -> bool:
        """Whether mirror images of motions are motions too at all points.

        The stops are equal, there is no bias, and the forces change their sign after half of their period.
        """
        oscillator, right, left = self.parameters.oscillator, self.parameters.right, self.parameters.left
        equal_gaps = "clearance" in self.names or (right is not None and right == left)
        one_sided = any(name == "bias" or name.endswith(("_right", "_left")) for name in self.names)
        equal_restitution = len({*restitutions(oscillator.restitution)}) == 1 or "restitution" in self.names
        return equal_gaps and not one_sided and oscillator.is_symmetric and equal_restitution

    def corners(self) -> list[PlanePoint]:
        """Return the points at the corners."""
        across, up = self.horizontal, self.vertical
        return [self.parameters.at({across.vary: x, up.vary: y}) for x in across.ends for y in up.ends]


def with_parameter(oscillator: Oscillator, name: str, value: float) -> Oscillator:
    """Return the oscillator with a parameter that it has set to a value; bias, forcing and damping are multiplied."""
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
        changes = {"bias": [value * force for force in oscillator.bias or ()]}
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
    changes: dict[str, Any] = {"forcing": [factor * amplitude for amplitude in forcing]} if not several else {}
    if several:
        scaled = [
            force.model_copy(update={"amplitude": [factor * part for part in force.amplitude]}) for force in several
        ]
        changes = {"forcing": scaled[0] if isinstance(forcing, Forcing) else scaled}
    if oscillator.base is not None:
        changes["base"] = oscillator.base.model_copy(update={"amplitude": factor * oscillator.base.amplitude})
    return changes


def _scaled_damping(oscillator: Oscillator, factor: float) -> dict[str, Any]:
    if oscillator.matrices is None:
        damping = oscillator.damping
        return {"damping": [factor * value for value in damping] if isinstance(damping, list) else factor * damping}
    of: Any = oscillator.matrices.damping
    if isinstance(of, ModalDamping):
        modal = [factor * ratio for ratio in of.modal] if isinstance(of.modal, list) else factor * of.modal
        of = of.model_copy(update={"modal": modal})
    elif isinstance(of, RayleighDamping):
        of = of.model_copy(update={"rayleigh": [factor * coefficient for coefficient in of.rayleigh]})
    else:
        of = [[factor * entry for entry in row] for row in of]
    return {"matrices": oscillator.matrices.model_copy(update={"damping": of})}


def _require_different(across: str, up: str) -> None:
    """Refuse two axes that are not independent, such as clearance and clearance_right, or damping and dampings[1]."""
    pairs = ((across, up), (up, across))
    if across == up or any(part.startswith((f"{whole}_", f"{whole}s[")) for part, whole in pairs):
        detail = "both axes have the same parameter" if across == up else f"{across} and {up} are not independent"
        raise invalid(detail, "two different parameters", "vertical", "vary")


def _varies(name: str, allowed: str, *at: str) -> PydanticCustomError:
    return invalid(f"{name} varies: its values are those of an axis", allowed, *at)


def _fixed_stops(clearance: float | ClearancePair | None, varied: tuple[str, ...]) -> tuple[float | None, float | None]:
    """Return the clearances of the right and of the left stop where they do not vary; None also for an absent stop."""
    names = [name for name in varied if name.startswith("clearance")]
    if clearance is None and not names:
        raise invalid("clearance is missing", 'a number, or {"right": .., "left": ..}', "clearance")
    if "clearance" in names and clearance is not None:
        raise _varies("clearance", "left out", "clearance")
    if names and isinstance(clearance, float | int):
        other = next(side for side in SIDES if side != names[0].removeprefix("clearance_"))
        allowed = f'left out, or the other stop alone: {{"{other}": 1.2}}'
        raise _varies(names[0], allowed, "clearance")
    stops = as_pair(clearance)
    for side in SIDES:
        if f"clearance_{side}" in names and stops.side(side) is not None:
            raise _varies(f"clearance_{side}", "left out or null where it varies", "clearance", side)
    if not names and stops.right is None and stops.left is None:
        raise invalid("both stops are absent", "right, left, or both", "clearance")
    return stops.right, stops.left


def _fixed_clearance(varied: Line | Plane) -> float | ClearancePair | None:
    """Return the clearances that do not vary, in their simplest form; None if all vary."""
    sides = () if "clearance" in varied.names else SIDES
    fixed = {side: getattr(varied.parameters, side) for side in sides if f"clearance_{side}" not in varied.names}
    pair = ClearancePair.model_validate(fixed) if fixed else None
    return pair and (pair.of_both or pair)


class _VariedRequest(ProcessRequest):
    omega: Annotated[Positive | None, LeftOut] = None
    """Forcing frequency, where it does not vary."""
    clearance: Annotated[FixedClearance | None, LeftOut] = None
    """Distance of the stops from q = 0 where it does not vary: one number or {"right": .., "left": ..}, null: none."""

    @model_validator(mode="after")
    def _clearance_is_simplest(self) -> Self:
        """Write the clearances in their simplest form, so that requests that mean the same have the same text."""
        self.varied.corners()[0].clearance.require_space("clearance")
        self._replace("clearance", _fixed_clearance(self.varied))
        return self

    @property
    def varied(self) -> Line | Plane:
        """What varies, and the parameters that do not."""
        varied: Line | Plane = getattr(self, "line" if "axis" in type(self).model_fields else "plane")
        return varied

    def _others(self, *varied: str) -> Parameters:
        """Return the values of the parameters that do not vary."""
        if "omega" in varied and self.omega is not None:
            raise _varies("omega", "left out", "omega")
        if "omega" not in varied and self.omega is None:
            raise invalid("omega is missing: it does not vary", "a finite number > 0", "omega")
        return Parameters(self.oscillator, self.omega, *_fixed_stops(self.clearance, varied))


class OneParameterRequest(_VariedRequest):
    """Base of requests along one parameter; omega and clearance are given where they do not vary."""

    short = ShortForms(
        ("axis",),
        {
            "omega": "Forcing frequencies, if they vary: a range, or an increasing list.",
            "clearance": "Clearances of both stops or of one, if they vary: a range, or an increasing list.",
        },
        "",
    )

    axis: Axis
    """The parameter that varies, and its values."""

    @cached_property
    def line(self) -> Line:
        """The parameter that varies, and the others."""
        line = Line(self._others(self.axis.vary), self.axis)
        line.parameters.require(self.axis.vary, "axis", "vary")
        require_values(self.axis, "axis", "values")
        return line


class PlaneRequest(_VariedRequest):
    """Base of requests over two parameters; omega and clearance are given where they do not vary."""

    short = ShortForms(
        AXES,
        {
            "omega": "Forcing frequencies, if they vary, along the horizontal axis.",
            "clearance": "Clearances of both stops or of one, if they vary, along the vertical axis.",
        },
    )

    horizontal: Axis | WindowAxis
    vertical: Axis | WindowAxis

    @cached_property
    def plane(self) -> Plane:
        """The parameters that vary, and the others."""
        across, up = self.horizontal, self.vertical
        _require_different(across.vary, up.vary)
        plane = Plane(self._others(across.vary, up.vary), across, up)
        for name, axis in zip(AXES, (across, up), strict=True):
            plane.parameters.require(axis.vary, name, "vary")
            require_values(axis, name, "values")
        return plane


def example_axis(vary: str, start: float, stop: float, points: int = 16) -> dict[str, Any]:
    """Return an axis, for examples."""
    return {"vary": vary, "values": {"start": start, "stop": stop, "points": points}}


def _example(points: int) -> dict[str, Any]:
    axes = {
        "horizontal": example_axis("omega", 0.26, 0.3, points),
        "vertical": example_axis("clearance", 1.3, 2.0, points),
    }
    return {**axes, "max_periods": 200}


class UnfoldingMapsRequest(PlaneRequest, ObservedRequest):
    """The motion that each point of a rectangle of two parameters settles to: of omega and clearance, or of others.

    Trajectories start at rest; in a sweep, at the final state for the next smaller or larger value of the vertical
    parameter; in an ensemble, at random states, and the map has the motion that most of them settle to.

    An adaptive map is computed where neighbours differ and inferred where they agree. A preview takes less time; it
    classifies periodic motions only.
    """

    operation = Operation(
        "unfolding-maps",
        "submit_unfolding_map",
        "Compute the motion that each point of a grid settles to; its tiles can be fetched before the map is complete.",
        {
            "coarse map of the default oscillator": _example(16),
            "map computed where neighbours differ": {**_example(32), "adaptive": True},
            "names of motions, soon": {**_example(32), "preview": True},
            "one stop": {
                **_example(16),
                "vertical": example_axis("clearance_right", 0.5, 2.0),
                "clearance": {"left": None},
            },
            "over frequency and restitution": {
                "horizontal": example_axis("omega", 0.26, 0.3),
                "vertical": example_axis("restitution", 0.5, 0.9),
                "clearance": 1.6,
                "max_periods": 200,
            },
        },
    )

    horizontal: Axis
    """The parameter of the map's columns and its values."""
    vertical: Axis
    """The parameter of the map's rows and its values."""
    policy: Literal["rest", "sweep-up", "sweep-down", "ensemble"] = "rest"
    """Where trajectories start: at rest, at the final state of a neighbour, or at several random states."""
    max_periods: MaxPeriods = 1000
    max_period: MaxPeriod = 32
    # Of the policy "ensemble" only; accepted with any policy, but then not part of the request.
    initial_conditions: Annotated[int, Field(ge=1, le=1000), Listable] = 16
    """Random states at each point, for the policy ensemble; ignored with another policy."""
    seed: Seed = 0
    """Seed of the random states, for the policy ensemble; ignored with another policy."""
    adaptive: Annotated[bool, LeftOut] = False
    """Whether points are inferred where all neighbours agree, and computed only elsewhere; not for a sweep."""
    preview: Annotated[bool, LeftOut] = False
    """Whether only periodic motions are identified: faster, without multipliers, exponents and chaos."""
    resolve_sensitive: Annotated[bool, LeftOut] = False
    """Whether the motions of sensitive points are decided in more digits, which takes seconds a point."""
    # the same where it is left out, so that requests keep their text
    other_starts: Annotated[
        int,
        Field(ge=0, le=MOST_OTHER_STARTS, exclude_if=lambda starts: starts == OTHER_STARTS_OF_MAP),
        Listable,
    ] = OTHER_STARTS_OF_MAP
    """Random starts tried at each point of a sample, for other stable motions than from rest; 0: no sample."""

    @model_validator(mode="after")
    def _options_agree(self) -> UnfoldingMapsRequest:
        if self.resolve_sensitive and self.policy.startswith("sweep"):
            raise invalid("a sweep starts at rounded states", "false for a sweep", "resolve_sensitive")
        if self.resolve_sensitive and self.adaptive:
            raise invalid("an adaptive map is not resolved", "false for an adaptive map", "resolve_sensitive")
        if self.adaptive and self.policy.startswith("sweep"):
            raise invalid(
                "a sweep cannot be adaptive: each point starts from its neighbour", "rest or ensemble", "policy"
            )
        for name in ("adaptive", "resolve_sensitive"):
            if self.observed and getattr(self, name):
                detail = "observables and outputs are of motions that a trajectory in double precision has settled to"
                raise invalid(detail, "false where observables or outputs are asked for", name)
        return self

    def unused(self) -> Collection[str]:
        """Return the names of the fields of ensembles for other policies, and of those for maps from rest."""
        of_ensemble = () if self.policy == "ensemble" else ("initial_conditions", "seed")
        return of_ensemble if self.samples_other_starts else (*of_ensemble, "other_starts")

    @property
    def samples_other_starts(self) -> bool:
        """Whether other starts are tried: in maps from rest that are not previews."""
        return self.policy == "rest" and not self.preview
