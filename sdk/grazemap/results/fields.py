"""The schemas of results: fields, records of fields, and the result of one process.

A schema is plain data. The classes of results and of records declare their fields (see `record.py`), from which their
schemas are made. Everything that has to know the fields of a result is derived from its schema: reading and checking
documents, Datasets, the responses in the API's document, and the tables of the guides.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np

VERSION = 3
"""The version of the layout of results."""

Scalar = Literal["float", "int", "bool", "str", "complex"]
TYPES: Mapping[Any, type] = {"float": float, "int": int, "bool": bool, "str": str, "complex": complex}
"""The types of values; numpy takes them as those of arrays."""
# Units that apply to nondimensional oscillators too.
_ALWAYS = frozenset({"rad", "forcing periods"})


@dataclass(frozen=True)
class RecordSchema:
    """A nested document with fields of its own."""

    name: str
    """Name of the class in `grazemap.results` and of the schema in the API's document."""
    description: str
    """One sentence."""
    fields: tuple[Field, ...]
    """Its fields."""
    kind: type[Any] = dict
    """The class of its objects."""

    def __getitem__(self, name: str) -> Field:
        """Return the field of a name. Raises KeyError."""
        for field in self.fields:
            if field.name == name:
                return field
        raise KeyError(name)

    def __iter__(self) -> Iterator[Field]:
        return iter(self.fields)

    def varied(self, name: str = "", omitted: Container[str] = (), **changes: Mapping[str, object]) -> Self:
        """Return the schema with another name, without some fields, and with attributes of other fields changed."""
        fields = tuple(field.varied(**changes.get(field.name, {})) for field in self if field.name not in omitted)
        return replace(self, name=name or self.name, fields=fields)


@dataclass(frozen=True)
class RequestDocument:
    """A nested document that can be posted to a process."""

    process: str
    """The process that takes it."""


@dataclass(frozen=True)
class Field:
    """One field of a result or of a record."""

    name: str
    """Its name."""
    type: Scalar | RecordSchema | RequestDocument
    """The type of its values. A complex number is stored as a pair, its real and imaginary part."""
    description: str
    """What it is, in one sentence."""
    dims: tuple[str, ...] = ()
    """The roles of its dimensions; a record with one is a list of records."""
    unit: str = ""
    """Unit in SI. For a nondimensional oscillator only angles and counts of forcing periods have a unit."""
    when: str = ""
    """When it is present; empty: always."""
    null: bool = False
    """Whether its numbers may be NaN, or its value None; both are null in JSON."""
    dtype: str = ""
    """dtype of the array, if it is not that of the type."""
    values: tuple[str | int, ...] = ()
    """The allowed values, if there are few."""
    index_of: str = ""
    """The field in which these numbers are positions."""
    variable: str | None = ""
    """Its name in a Dataset, if that differs; None if it is not in Datasets."""
    prefix: str = ""
    """Prefix of the names of a record's fields in a Dataset."""
    coordinate: bool = False
    """Whether it is a coordinate in a Dataset. A field named like its dimension always is one."""
    is_tuple: bool = False
    """Whether the values are a tuple in the result, not an array."""
    stored_only: bool = False
    """Whether it is in documents only, and no attribute of the class."""

    @property
    def optional(self) -> bool:
        """Whether there are results without it."""
        return bool(self.when)

    @property
    def stored_dtype(self) -> str:
        """The name of the dtype of its arrays in documents, where pairs of real numbers stand for complex ones."""
        return self.dtype or np.dtype(float if self.type == "complex" else TYPES[self.type]).name

    def unit_in(self, units: str) -> str:
        """Return its unit in results of an oscillator in SI, or in a nondimensional one; empty: it has none."""
        return self.unit if not self.unit or units == "SI" or self.unit in _ALWAYS else "nondimensional"

    @property
    def unit_sentence(self) -> str:
        """Its unit, after a blank, as in " Unit: m in SI."; empty if it has none."""
        return f" Unit: {self.unit}{'' if self.unit in _ALWAYS else ' in SI'}." if self.unit else ""

    def varied(self, **changes: object) -> Field:
        """Return the field with some of its attributes changed."""
        return replace(self, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True)
class ResultSchema(RecordSchema):
    """The result of a process."""

    process: str = ""
    """The process."""
    roles: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """From the role of a dimension to the field with its coordinates, where the two are named differently."""
    derived: tuple[Field, ...] = ()
    """Additional variables of a Dataset, which the result's class computes."""
    rows: str = ""
    """The dimension whose arrays are a table, named after it, one row for each entry; empty: there is none."""
    in_json: tuple[Field, ...] = ()
    """Additional fields of its JSON, which the result's class computes."""
