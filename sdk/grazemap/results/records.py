"""The records that several results contain, the table of all records' classes, and the attributes in docstrings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import cleandoc
from textwrap import dedent, fill, indent
from types import FunctionType
from typing import Any, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from grazemap.schema import Field, Record, ResultSchema
from grazemap.schema.common import CHANCE_TO_SETTLE, IMPACTS, MOTION, RESTS, STATE
from grazemap.schema.maps import INFERRED_WRONG

R = TypeVar("R")
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]

ARRAY_TYPES: dict[str, Any] = {"float": np.float64, "int": np.int64, "bool": np.bool_, "str": np.str_}
RECORDS: dict[str, type[Any]] = {}
"""The classes of records by the names of their schemas."""


@dataclass_transform(frozen_default=True, eq_default=False)
def described(record: Record, *, comparable: bool = False) -> Callable[[type[R]], type[R]]:
    """Return a decorator that makes a class the frozen dataclass of a record, its attributes in the docstring.

    A `comparable` class, without arrays, has slots, and its instances are equal if their attributes are.
    """

    def register(cls: type[R]) -> type[R]:
        cls.__doc__ = with_attributes(cls.__doc__ or "", record)
        made = dataclass(frozen=True, eq=comparable, slots=comparable)(cls)
        RECORDS[record.name] = made
        return made

    return register


def with_attributes(docstring: str, record: Record, cls: type | None = None) -> str:
    """Return a docstring with the section Attributes, and for a class with its properties there and its methods."""
    summary, _, rest = docstring.partition("\n")
    parts = [summary, "", "Attributes", "----------"]
    roles = record.roles if isinstance(record, ResultSchema) else {}
    for one in record:
        if not one.replaces and one.name != "at_computed":
            parts += [f"{one.name} : {_type(one, roles)}", indent(fill(_text(one), 108), "    ")]
    if cls is not None:
        parts += [*members(cls, property), "", "Methods", "-------", *members(cls, FunctionType)]
    return "\n".join(parts) + (f"\n\n{dedent(rest).strip()}\n" if rest.strip() else "\n")


def members(cls: type, kind: type) -> list[str]:
    """Return the lines that say in one sentence what each public property, or method, of a class returns."""
    found = {name: value for base in reversed(cls.__mro__[:-1]) for name, value in vars(base).items()}
    lines = []
    for name, value in sorted(found.items()):
        said = cleandoc(value.__doc__ or "").partition("\n")[0] if isinstance(value, kind) else ""
        if said and not name.startswith(("_", "derived")):
            lines += [name if kind is property else f"{name}()", f"    {said}"]
    return lines


def _type(one: Field, roles: Mapping[str, str]) -> str:
    name = one.type.name if isinstance(one.type, Record) else one.type if isinstance(one.type, str) else "dict"
    if one.dims:
        listed = one.texts or isinstance(one.type, Record)
        dims = [roles.get(role, role) for role in one.dims]
        shape = f"({', '.join(dims)}{',' * (len(dims) == 1)})"
        name = f"tuple of {name}" if listed else f"ndarray of {name}, shape {shape}"
    return f"{name}, or None" if one.optional or (one.null and not one.dims and name != "float") else name


def _text(one: Field) -> str:
    always = one.unit_in("nondimensional") == one.unit
    unit = f" Unit: {one.unit}{'' if always else ' in SI'}." if one.unit else ""
    when = f" Only {one.when}." if one.when else ""
    index = f" Position in `{one.index_of}`." if one.index_of else ""
    return one.description + index + unit + when


@described(MOTION, comparable=True)
class Motion:
    """The motion n-p_r-q_l that a trajectory settles to."""

    kind: str
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    label: str | None = None
    verified: bool = False
    reason: str | None = None


@described(IMPACTS)
class Impacts:
    """Every contact of a trajectory with a stop, in order."""

    time: FloatArray
    period: IntArray
    phase_time: FloatArray
    stop: IntArray
    velocity: FloatArray
    kind: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.time)


@described(RESTS)
class Sticking:
    """The intervals during which the contact rests on a stop."""

    start: FloatArray
    stop_time: FloatArray
    stop: IntArray

    def __len__(self) -> int:
        return len(self.start)


@described(CHANCE_TO_SETTLE, comparable=True)
class ChanceToSettle:
    """How many of a sample of the chaotic motions settle when they are simulated for ten times as long."""

    watched: int
    run_on: int
    chaotic: int
    sampled: int
    settled: int
    chance: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.settled} of {self.sampled} chaotic motions settle within {self.run_on} periods"


@described(INFERRED_WRONG, comparable=True)
class InferredWrong:
    """How many of the inferred points of an adaptive map are wrong, from a random sample of them that was computed."""

    inferred: int
    sampled: int
    wrong: int
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.wrong} of {self.sampled} inferred points in a sample wrong ({self.low:.2%} to {self.high:.2%})"


@described(STATE)
class State:
    """The state at a moment; another trajectory starts there if it is passed as `initial`."""

    displacement: FloatArray
    velocity: FloatArray
    phase: float


@dataclass(frozen=True, slots=True)
class MotionShare:
    """One motion of an unfolding map and how much of the map it covers.

    Attributes
    ----------
    label : str
        n-p_r-q_l as plain text, or the name of the kind for a motion that is not periodic.
    kind : str
    period, impacts_right, impacts_left : int or None
        None for a motion that is not periodic.
    pixels : int
    share : float
        pixels over all pixels of the map, from 0 to 1.
    mirror_images : bool
        Whether the mirror images n-q_r-p_l are counted too.
    colour : str or None
        #RRGGBB in the picture of a map; None for one of the "other motions", and without a map.
    """

    label: str
    kind: str
    period: int | None
    impacts_right: int | None
    impacts_left: int | None
    pixels: int
    share: float
    mirror_images: bool = False
    colour: str | None = None
