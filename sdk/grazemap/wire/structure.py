"""Parts of the description of a general oscillator: matrices, contact, forces, moving base, stops."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)

from grazemap.wire.base import (
    Float,
    GridList,
    GridRange,
    Interval,
    Kind,
    Listable,
    NonNegative,
    Positive,
    Range,
    Request,
    grid_tag,
    invalid,
)

Floats = NDArray[np.float64]
Row = Annotated[list[Float], Field(min_length=1, fail_fast=True), Listable]
# A row of zeros is none.
OptionalRow = Annotated[Row | None, Field(exclude_if=lambda row: not any(row or ()))]
Matrix = Annotated[list[Row], Field(min_length=1, fail_fast=True), Listable]
# Largest difference of M and its transpose, relative to its largest number, that is rounding; as in the core.
_ASYMMETRY = 16.0 * 2.220446049250313e-16


class ModalDamping(Request):
    """Damping by the ratios of the modes."""

    modal: Annotated[
        Annotated[NonNegative, Tag("[of all]")]
        | Annotated[list[NonNegative], Field(min_length=1, fail_fast=True), Listable, Tag("[of each]")],
        Discriminator(lambda value: "[of each]" if _is_list(value) else "[of all]"),
    ]
    """One damping ratio for all modes, or N numbers, in the order of increasing frequency."""


class RayleighDamping(Request):
    """Damping ``C = alpha M + beta K``."""

    rayleigh: Annotated[list[Float], Field(min_length=2, max_length=2), Listable]
    """alpha and beta."""


def _is_list(value: Any) -> bool:
    return hasattr(value, "__len__") and getattr(value, "ndim", 1) > 0 and not isinstance(value, dict | str)


def _damping_tag(value: Any) -> str:
    if _is_list(value):
        return "[matrix]"
    named = value if isinstance(value, dict) else {"modal": None} if isinstance(value, ModalDamping) else {}
    return "[modal]" if "modal" in named else "[rayleigh]"


class Matrices(Request):
    """The matrices of a linear structure, N lists of N numbers each: ``M x'' + C x' + K x = forces``."""

    mass: Matrix
    """M, symmetric and positive definite."""
    damping: Annotated[
        Annotated[Matrix, Tag("[matrix]")]
        | Annotated[ModalDamping, Tag("[modal]")]
        | Annotated[RayleighDamping, Tag("[rayleigh]")],
        Discriminator(_damping_tag),
    ]
    """C as it is; or {"modal": damping ratio of all modes, or of each}; or {"rayleigh": [alpha, beta]}."""
    stiffness: Matrix
    """K; not symmetric with follower forces."""

    @model_validator(mode="after")
    def _agree(self) -> Matrices:
        count = len(self.mass)
        named = {"mass": self.mass, "stiffness": self.stiffness}
        if isinstance(self.damping, list):
            named["damping"] = self.damping
        for name, rows in named.items():
            if len(rows) != count:
                raise invalid(f"{name} has {len(rows)} rows and mass has {count}", "matrices of one size", name)
            if any(len(row) != count for row in rows):
                raise invalid(f"{name} is not square", f"{count} lists of {count} numbers", name)
        if isinstance(self.damping, ModalDamping) and isinstance(self.damping.modal, list):
            given = len(self.damping.modal)
            if given != count:
                detail = f"damping.modal has {given} numbers and the structure has {count} modes"
                raise invalid(detail, "one number, or one for each mode", "damping", "modal")
        mass, stiffness = np.array(self.mass), np.array(self.stiffness)
        if np.max(np.abs(mass - mass.T)) > _ASYMMETRY * np.max(np.abs(mass)):
            raise invalid("mass is not symmetric", "a symmetric, positive definite matrix", "mass")
        try:
            np.linalg.cholesky(mass)
        except np.linalg.LinAlgError:
            raise invalid("mass is not positive definite", "a symmetric, positive definite matrix", "mass") from None
        asymmetry = np.max(np.abs(stiffness - stiffness.T))
        if isinstance(self.damping, ModalDamping) and asymmetry > _ASYMMETRY * np.max(np.abs(stiffness)):
            raise invalid(
                "damping.modal is for a symmetric stiffness matrix: there are no real modes", "C itself", "damping"
            )
        return self


class ContactRow(Request):
    """A contact coordinate ``q = row x``."""

    row: Row
    """N numbers, not all 0."""


def _contact_tag(value: Any) -> str:
    if isinstance(value, dict | ContactRow):
        return "[row]"
    return "[two]" if _is_list(value) else "[one]"


def _one_contact(value: Any) -> Any:
    """Refuse several contacts by name."""
    row: Any = value.get("row") if isinstance(value, dict) else value
    if _is_list(row) and any(_is_list(one) or isinstance(one, dict) for one in row):
        raise invalid(
            "several contacts are not covered in this version", "one contact: a mass, a pair, or a row of N numbers"
        )
    return value


Mass = Annotated[int, Field(ge=1), Listable]
Contact = Annotated[
    Annotated[Mass, Tag("[one]")]
    | Annotated[list[Mass], Field(min_length=2, max_length=2), Listable, Tag("[two]")]
    | Annotated[ContactRow, Tag("[row]")],
    Discriminator(_contact_tag),
    BeforeValidator(_one_contact),
]


class Forcing(Request):
    """One harmonic of the forces: ``amplitude_i sin(harmonic omega t + phase_i)`` on every mass i."""

    amplitude: Row
    """On each of the N masses; N in SI. With the law "unbalance" of u, kg m in SI."""
    phase: Row | None = None
    """On each of the N masses, in radians, pi/2 for a cosine; left out: 0."""
    law: Literal["constant", "unbalance"] = "constant"
    """"unbalance": the amplitudes are (harmonic omega)^2 u, those of rotating masses, u = m r."""
    harmonic: Annotated[int, Field(ge=1, le=1000), Listable] = 1
    """The multiple of omega."""

    def normal(self) -> dict[str, Any]:
        """Return the values that differ from their defaults, and the amplitude."""
        found: dict[str, Any] = {"amplitude": self.amplitude}
        if self.phase is not None and any(self.phase):
            found["phase"] = self.phase
        if self.law != "constant":
            found["law"] = self.law
        if self.harmonic != 1:
            found["harmonic"] = self.harmonic
        return found


def _forcing_tag(value: Any) -> str:
    if isinstance(value, dict | Forcing):
        return "[one]"
    several = _is_list(value) and len(value) > 0 and isinstance(value[0], dict | Forcing)
    return "[several]" if several else "[amplitudes]"


Forces = Annotated[
    Annotated[Row, Tag("[amplitudes]")]
    | Annotated[Forcing, Tag("[one]")]
    | Annotated[list[Forcing], Field(min_length=1, max_length=100, fail_fast=True), Listable, Tag("[several]")],
    Discriminator(_forcing_tag),
]


class Base(Request):
    """A ground that moves: ``amplitude sin(omega t + phase)``."""

    amplitude: Float
    """Displacement of the ground; m in SI."""
    phase: Float = 0.0
    """In radians."""
    stops_move: bool
    """true: the stops move with the ground, and displacements are relative to it; false: stops are fixed in space."""
    influence: Row | None = None
    """By how much a unit displacement of the ground moves each coordinate of the free structure; a chain: ones."""


class RestitutionPair(Request):
    """The restitution of each stop."""

    right: Annotated[float, Field(ge=0, le=1), Listable]
    """Of the stop at +clearance."""
    left: Annotated[float, Field(ge=0, le=1), Listable]
    """Of the stop at -clearance."""


Restitution = Annotated[
    Annotated[float, Field(ge=0, le=1), Listable, Tag("[of both]")] | Annotated[RestitutionPair, Tag("[of each]")],
    Discriminator(lambda value: "[of each]" if isinstance(value, dict | RestitutionPair) else "[of both]"),
]


def restitutions(given: float | RestitutionPair) -> tuple[float, float]:
    """Return the restitution of the right and of the left stop."""
    return (given.right, given.left) if isinstance(given, RestitutionPair) else (given, given)


class OtherClearance(Request):
    """The clearance of one stop, where that of the other one varies: the one that is left out."""

    right: Float | None = None
    """Of the right stop, which is fixed, and the left one varies; null: there is no right stop."""
    left: Float | None = None
    """Of the left stop, which is fixed, and the right one varies; null: there is no left stop."""

    @model_validator(mode="after")
    def _leaves_one(self) -> OtherClearance:
        if len(self._given) != 1:
            raise invalid("one stop is fixed or absent, and the other one varies", "right or left, not both")
        return self

    @property
    def _given(self) -> set[str]:
        numbers = {name for name in ("right", "left") if getattr(self, name) is not None}
        return numbers or self.model_fields_set

    @property
    def varied(self) -> int:
        """The stop whose clearance varies: +1 right, -1 left."""
        return -1 if "right" in self._given else 1

    @property
    def other(self) -> float | None:
        """The clearance of the other stop; None if it is absent."""
        return self.right if self.varied < 0 else self.left

    @model_serializer(mode="wrap")
    def _normal(self, dump: SerializerFunctionWrapHandler) -> dict[str, float | None]:
        return {"left" if self.varied > 0 else "right": self.other}


class FixedStops(Request):
    """The distances of the stops from ``q = 0`` that do not vary; None: there is no such stop, or it varies."""

    right: Float | None = None
    """Of the stop at +right."""
    left: Float | None = None
    """Of the stop at -left."""

    @model_validator(mode="after")
    def _is_between(self) -> Self:
        if self.right is not None and self.left is not None and self.right + self.left <= 0.0:
            raise invalid("the stops leave no space between them", "right + left > 0")
        return self

    @model_serializer(mode="wrap")
    def _normal(self, dump: SerializerFunctionWrapHandler) -> Any:
        """Return one number for two equal stops, so that requests that mean the same have the same text."""
        return self.right if self.right == self.left and (self.right or 0.0) > 0.0 else dump(self)


class ClearancePair(FixedStops):
    """The distances of the stops from ``q = 0``; None: there is no such stop."""

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if self.right is None and self.left is None:
            raise invalid("both stops are absent", "right, left, or both")
        return self


def _clearance_tag(value: Any) -> str:
    return "[of each]" if isinstance(value, dict | FixedStops) else "[of both]"


Clearance = Annotated[
    Annotated[Positive, Tag("[of both]")] | Annotated[ClearancePair, Tag("[of each]")],
    Discriminator(_clearance_tag),
    Kind("clearance"),
]
FixedClearance = Annotated[
    Annotated[Positive, Tag("[of both]")] | Annotated[FixedStops, Tag("[of each]")],
    Discriminator(_clearance_tag),
    Kind("clearance"),
]


def as_pair(clearance: float | ClearancePair | None) -> ClearancePair:
    """Return the clearances of the two stops; both are None where none is given."""
    if isinstance(clearance, ClearancePair):
        return clearance
    return ClearancePair.model_construct(right=clearance, left=clearance)


def _side_tag(value: Any) -> str | None:
    return "[fixed]" if isinstance(value, int | float) else grid_tag(value)


def _map_omega_tag(value: Any) -> str | None:
    if value is None:
        return "[absent]"
    return "[fixed]" if isinstance(value, int | float) and not isinstance(value, bool) else grid_tag(value)


_Absent = Annotated[None, Tag("[absent]")]
MapOmega = Annotated[
    GridRange | GridList | Annotated[Positive, Tag("[fixed]")] | _Absent,
    Discriminator(
        _map_omega_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a range or a list of numbers, or a number where it does not vary",
        custom_error_context={
            "allowed": '{"start": .., "stop": .., "points": ..}, an increasing list of numbers > 0, or a number'
        },
    ),
    Kind("frequencies of a map"),
]
_Side = Annotated[Annotated[Float, Tag("[fixed]")] | GridRange | GridList, Discriminator(_side_tag)]


class ClearanceGrid(Request):
    """The clearances of the stops: those of one may vary, and that of the other one is fixed; None: no such stop."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    right: _Side | None = None
    """Of the stop at +right: a range or an increasing list, or one number, or null."""
    left: _Side | None = None
    """Of the stop at -left: a range or an increasing list, or one number, or null."""

    @model_validator(mode="after")
    def _at_most_one_varies(self) -> ClearanceGrid:
        lowest = [
            side[0] if isinstance(side, list) else side.start if isinstance(side, Range) else side
            for side in (self.right, self.left)
        ]
        if all(isinstance(side, Range | list) for side in (self.right, self.left)):
            raise invalid("one stop varies, and the other one is fixed or absent", "a range for right or for left")
        if None not in lowest and not sum(one for one in lowest if one is not None) > 0.0:
            raise invalid("the stops leave no space between them", "right + left > 0")
        return self

    @property
    def stop(self) -> str | None:
        """The stop whose clearance varies, "right" or "left"; None: neither."""
        for name in ("right", "left"):
            if isinstance(getattr(self, name), Range | list):
                return name
        return None


def _map_clearance_tag(value: Any) -> str | None:
    named = isinstance(value, dict) and bool({"right", "left"} & value.keys())
    return "[of one stop]" if named or isinstance(value, ClearanceGrid) else _map_omega_tag(value)


MapClearance = Annotated[
    GridRange
    | GridList
    | Annotated[ClearanceGrid, Tag("[of one stop]")]
    | Annotated[Positive, Tag("[fixed]")]
    | _Absent,
    Discriminator(
        _map_clearance_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a range, a list of numbers, or the clearances of each stop",
        custom_error_context={
            "allowed": '{"start": .., "stop": .., "points": ..}, an increasing list of numbers > 0, or one of these as '
            "right or left, with a number or null for the other stop; a number where it does not vary"
        },
    ),
    Kind("clearances of a map"),
]


def _window_side_tag(value: Any) -> str | None:
    if isinstance(value, dict | Interval):
        return "[interval]"
    return "[fixed]" if isinstance(value, int | float) else None


_WindowSide = Annotated[
    Annotated[Float, Tag("[fixed]")] | Annotated[Interval, Tag("[interval]")], Discriminator(_window_side_tag)
]


class ClearanceWindow(Request):
    """The clearances of the stops: those of one may vary, and that of the other one is fixed; None: no such stop."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    right: _WindowSide | None = None
    """Of the stop at +right: an interval, or one number, or null."""
    left: _WindowSide | None = None
    """Of the stop at -left: an interval, or one number, or null."""

    @model_validator(mode="after")
    def _at_most_one_varies(self) -> ClearanceWindow:
        sides = (self.right, self.left)
        if all(isinstance(side, Interval) for side in sides):
            detail = "the clearance of one stop varies, and the other one is fixed or absent"
            raise invalid(detail, "an interval for right or for left")
        lowest = [side.start if isinstance(side, Interval) else side for side in sides if side is not None]
        if len(lowest) == 2 and not sum(lowest) > 0.0:
            raise invalid("the stops leave no space between them", "right + left > 0")
        return self


def _window_omega_tag(value: Any) -> str | None:
    if value is None:
        return "[absent]"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "[fixed]"
    return "[interval]" if isinstance(value, dict | Interval) else None


def _window_tag(value: Any) -> str | None:
    each = isinstance(value, ClearanceWindow) or (isinstance(value, dict) and {"right", "left"} & value.keys())
    return "[of one stop]" if each else _window_omega_tag(value)


_INTERVAL: Any = '{"start": .., "stop": ..}'
WindowOmega = Annotated[
    Annotated[Interval, Tag("[interval]")] | Annotated[Positive, Tag("[fixed]")] | _Absent,
    Discriminator(
        _window_omega_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be an interval, or a number where it does not vary",
        custom_error_context={"allowed": f"{_INTERVAL}, or a number"},
    ),
    Kind("frequencies of a window"),
]
WindowClearance = Annotated[
    Annotated[Interval, Tag("[interval]")]
    | Annotated[ClearanceWindow, Tag("[of one stop]")]
    | Annotated[Positive, Tag("[fixed]")]
    | _Absent,
    Discriminator(
        _window_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be an interval, or the clearances of each stop",
        custom_error_context={
            "allowed": f"{_INTERVAL}, or one of these as right or left, with a number or null for the other stop; a "
            "number where it does not vary"
        },
    ),
    Kind("clearances of a window"),
]
