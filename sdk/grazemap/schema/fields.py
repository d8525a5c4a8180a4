"""The elements of schemas: fields, records of fields, and the result of one process.

A schema is plain data. Everything that has to know the fields of a result is derived from it: reading and checking
documents, result classes, Datasets, the responses in the API's document, and the tables of the guides.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

VERSION = 2
"""The version of the layout of results. Version 1 is that of grazemap 0.1, whose results lack the number."""

Scalar = Literal["float", "int", "bool", "str", "complex"]
# Units that apply to nondimensional oscillators too.
_ALWAYS = frozenset({"rad", "forcing periods"})


@dataclass(frozen=True)
class Record:
    """A nested document with fields of its own.

    Attributes
    ----------
    name : str
        Name of the class in `grazemap.results` and of the schema in the API's document.
    description : str
        One sentence.
    fields : tuple of Field
    """

    name: str
    description: str
    fields: tuple[Field, ...]

    def __getitem__(self, name: str) -> Field:
        """Return the field of a name. Raises KeyError."""
        for one in self.fields:
            if one.name == name:
                return one
        raise KeyError(name)

    def __iter__(self) -> Iterator[Field]:
        return iter(self.fields)


@dataclass(frozen=True)
class Request:
    """A nested document that can be posted to a process.

    Attributes
    ----------
    process : str
        The process that takes it.
    """

    process: str


@dataclass(frozen=True)
class Field:
    """One field of a result or of a record.

    Attributes
    ----------
    name : str
    type : {"float", "int", "bool", "str", "complex"}, Record or Request
        A complex number is stored as a pair, its real and imaginary part.
    description : str
        What it is, in one sentence.
    dims : tuple of str
        The roles of its dimensions; a record with one is a list of records.
    unit : str
        Unit in SI. For a nondimensional oscillator only angles and counts of forcing periods have a unit.
    when : str
        When it is present; empty: always.
    null : bool
        Whether its numbers may be NaN, or its value None; both are null in JSON.
    dtype : str
        dtype of the array, if it is not that of the type.
    values : tuple
        The allowed values, if there are few.
    index_of : str
        The field in which these numbers are positions.
    replaces : str
        The field of which this is a deprecated name.
    variable : str or None
        Its name in a Dataset, if that differs; None if it is not in Datasets.
    prefix : str
        Prefix of the names of a record's fields in a Dataset.
    coordinate : bool
        Whether it is a coordinate in a Dataset. A field named like its dimension always is one.
    texts : bool
        Whether the values are a tuple in the result, not an array.
    """

    name: str
    type: Scalar | Record | Request
    description: str
    dims: tuple[str, ...] = ()
    unit: str = ""
    when: str = ""
    null: bool = False
    dtype: str = ""
    values: tuple[str | int, ...] = ()
    index_of: str = ""
    replaces: str = ""
    variable: str | None = ""
    prefix: str = ""
    coordinate: bool = False
    texts: bool = False

    @property
    def optional(self) -> bool:
        """Whether there are results without it."""
        return bool(self.when) or bool(self.replaces)

    def unit_in(self, units: str) -> str:
        """Return its unit in results of an oscillator in SI, or in a nondimensional one; empty: it has none."""
        return self.unit if not self.unit or units == "SI" or self.unit in _ALWAYS else "nondimensional"

    def in_result(self, **changes: object) -> Field:
        """Return the field with some of its attributes changed."""
        return replace(self, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True)
class ResultSchema(Record):
    """The result of a process.

    Attributes
    ----------
    process : str
    roles : mapping of str to str
        From the role of a dimension to the field with its coordinates, where the two are named differently.
    derived : tuple of Field
        Additional variables of a Dataset, which the result's class computes.
    rows : str
        The dimension whose arrays are a table, named after it, one row for each entry; empty: there is none.
    in_json : tuple of Field
        Additional fields of its JSON, which `schema.motions` computes.
    """

    process: str = ""
    roles: Mapping[str, str] = dataclasses.field(default_factory=dict)
    derived: tuple[Field, ...] = ()
    rows: str = ""
    in_json: tuple[Field, ...] = ()


def field(
    name: str, type: Scalar | Record | Request, description: str, dims: str = "", unit: str = "", **more: object
) -> Field:
    """Return a field; `dims` are separated by spaces."""
    return Field(name, type, description, tuple(dims.split()), unit, **more)  # type: ignore[arg-type]


def deprecated(name: str, of: Field) -> Field:
    """Return a field that is the deprecated name of another one."""
    return replace(
        of, name=name, description=f"Deprecated: another name of `{of.name}`.", replaces=of.name, variable=None
    )
