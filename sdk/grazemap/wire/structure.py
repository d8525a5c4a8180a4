"""Parts of the description of a general oscillator: matrices, contact, forces, moving base, stops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    field_validator,
    model_serializer,
    model_validator,
)

from grazemap.constants import EPSILON
from grazemap.later import Later
from grazemap.wire.base import Count, Float, Kind, Listable, NonEmpty, NonNegative, Positive, Request, Share, invalid

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

Row = NonEmpty[Float]
# A row of zeros is none.
OptionalRow = Annotated[Row | None, Field(exclude_if=lambda row: not any(row or ()))]
Matrix = NonEmpty[Row]
# Largest difference of M and its transpose, relative to its largest number, that is rounding; as in the core.
_ASYMMETRY = 16.0 * EPSILON


class ModalDamping(Request):
    """Damping by the ratios of the modes."""

    modal: Annotated[
        Annotated[NonNegative, Tag("[of all]")] | Annotated[NonEmpty[NonNegative], Tag("[of each]")],
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
            length = len(self.damping.modal)
            if length != count:
                detail = f"damping.modal has {length} numbers and the structure has {count} modes"
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
    if _is_list(row) and any(_is_list(entry) or isinstance(entry, dict) for entry in row):
        raise invalid(
            "several contacts are not covered in this version", "one contact: a mass, a pair, or a row of N numbers"
        )
    return value


Contact = Annotated[
    Annotated[Count, Tag("[one]")]
    | Annotated[list[Count], Field(min_length=2, max_length=2), Listable, Tag("[two]")]
    | Annotated[ContactRow, Tag("[row]")],
    Discriminator(_contact_tag),
    BeforeValidator(_one_contact),
]


class Forcing(Request):
    """One harmonic of the forces: ``amplitude_i sin(harmonic omega t + phase_i)`` on every mass i."""

    amplitude: Row
    """On each of the N masses; N in SI. With the law "unbalance" of u, kg m in SI."""
    phase: OptionalRow = None
    """On each of the N masses, in radians, pi/2 for a cosine; left out: 0."""
    law: Literal["constant", "unbalance"] = "constant"
    """"unbalance": the amplitudes are (harmonic omega)^2 u, those of rotating masses, u = m r."""
    harmonic: Annotated[int, Field(ge=1, le=1000), Listable] = 1
    """The multiple of omega."""


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

    right: Share
    """Of the stop at +clearance."""
    left: Share
    """Of the stop at -clearance."""


Restitution = Annotated[
    Annotated[Share, Tag("[of both]")] | Annotated[RestitutionPair, Tag("[of each]")],
    Discriminator(lambda value: "[of each]" if isinstance(value, dict | RestitutionPair) else "[of both]"),
]


def restitutions(restitution: float | RestitutionPair) -> tuple[float, float]:
    """Return the restitution of the right and of the left stop."""
    return (
        (restitution.right, restitution.left)
        if isinstance(restitution, RestitutionPair)
        else (restitution, restitution)
    )


class ClearancePair(Request):
    """The distances of the stops from ``q = 0``. A stop that is absent is null; one that varies is left out."""

    right: Float | None = None
    """Distance of the right stop from q = 0; null: there is none; left out: there is none, or its clearance varies."""
    left: Float | None = None
    """Distance of the left stop from q = 0; null: there is none; left out: there is none, or its clearance varies."""

    @field_validator("right", "left", mode="before")
    @classmethod
    def _is_of_one_stop(cls, distance: Any) -> Any:
        """Refuse the pair of a point of a map or of another request in the place of one of its numbers."""
        if is_of_sides(distance):
            raise invalid("these are the distances of both stops", "the number of one, or the pair as the clearance")
        return distance

    @model_validator(mode="after")
    def _leaves_space(self) -> Self:
        return self.require_space()

    @model_serializer(mode="plain")
    def _normal(self) -> Any:
        """Return one number for two equal stops, so that requests that mean the same have the same text."""
        return self.of_both or {side: self.side(side) for side in SIDES if side in self.model_fields_set}

    @property
    def of_both(self) -> float | None:
        """The distance of two stops that are equally far to both sides, which stands for the pair; None for others."""
        return self.right if self.right == self.left and (self.right or 0.0) > 0.0 else None

    @property
    def reach(self) -> tuple[float, float]:
        """How far the contact may go to the right and to the left: without end where there is no stop."""
        right, left = (math.inf if gap is None else gap for gap in (self.right, self.left))
        return right, left

    def require_space(self, *at: str) -> Self:
        """Refuse stops without space between them; `at` is their place in the request."""
        if sum(self.reach) <= 0.0:
            raise invalid("the stops leave no space between them", "right + left > 0", *at)
        return self

    def side(self, name: str) -> float | None:
        """Return the distance of the right or of the left stop."""
        distance: float | None = getattr(self, name)
        return distance


SIDES: tuple[StopName, StopName] = ("right", "left")
"""The names of the stops: at +clearance and at -clearance."""
_LETTERS = {"A": "right", "C": "left"}
StopName = Annotated[
    Literal["right", "left"],
    BeforeValidator(lambda name: _LETTERS.get(name, name) if isinstance(name, str) else name),
]
"""The stop at +right or the stop at -left. The letters of the paper, A and C, are short forms."""


def is_of_sides(value: Any) -> bool:
    """Return whether a clearance is written as those of the two stops."""
    return isinstance(value, ClearancePair) or (isinstance(value, Mapping) and not value.keys().isdisjoint(SIDES))


def _both_stops(clearance: float | ClearancePair) -> float | ClearancePair:
    """Return the clearances of a point, at which no stop varies."""
    if not isinstance(clearance, ClearancePair):
        return clearance
    if clearance.right is None and clearance.left is None:
        raise invalid("both stops are absent", "right, left, or both")
    return ClearancePair(right=clearance.right, left=clearance.left)


FixedClearance = Annotated[
    Annotated[Positive, Tag("[of both]")] | Annotated[ClearancePair, Tag("[of each]")],
    Discriminator(lambda value: "[of each]" if isinstance(value, dict | ClearancePair) else "[of both]"),
    Kind("clearance"),
]
"""The clearances that do not vary."""
Clearance = Annotated[FixedClearance, AfterValidator(_both_stops)]
"""The clearances of a point."""


def as_pair(clearance: float | ClearancePair | None) -> ClearancePair:
    """Return the clearances of the two stops; both are None where none is given."""
    if isinstance(clearance, ClearancePair):
        return clearance
    return ClearancePair.model_construct(right=clearance, left=clearance)


def _one_stop(clearance: ClearancePair) -> ClearancePair:
    """Return the stop that is given, {"left": 1.2}, or absent, {"left": null}, alone: the other one varies."""
    numbers = [side for side in SIDES if clearance.side(side) is not None]
    fixed = numbers or [side for side in SIDES if side in clearance.model_fields_set]
    if len(fixed) != 1:
        raise invalid("one stop is fixed or absent, and the other one varies", "right or left, not both")
    return ClearancePair.model_validate({fixed[0]: clearance.side(fixed[0])})


OtherClearance = Annotated[ClearancePair, AfterValidator(_one_stop), Kind("clearance of the other stop")]
"""The clearance of the stop that does not vary along a grazing curve of one stop, or null: there is no such stop."""


def varied_stop(clearance: ClearancePair) -> tuple[int, float | None]:
    """Return the stop that varies, +1 right or -1 left, where `OtherClearance` has the other one; and that one."""
    (fixed,) = clearance.model_fields_set
    return -1 if fixed == "right" else 1, clearance.side(fixed)
