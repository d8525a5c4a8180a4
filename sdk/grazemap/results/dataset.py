"""Results as xarray Datasets, by their schemas. Needs the extra "xarray".

A record's fields are variables with its prefix. A list of records is a dimension: plain fields are columns along it,
arrays of different lengths are joined, and ``{dimension}_{list}`` is the position, or the coordinate, of the record
that an entry belongs to. What is missing in a column is NaN or the empty text; a column of numbers or truth values in
which something may be missing holds floats. Texts over a plane are small codes, with the attributes `flag_values` and
`flag_meanings` of the CF conventions: words with blanks between them, and `_` for a blank inside.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.errors import MissingExtra
from grazemap.results.common_records import Motion
from grazemap.results.fields import TYPES, Field, RecordSchema, ResultSchema
from grazemap.results.observables import outputs_of

if TYPE_CHECKING:
    import xarray

    from grazemap.results.base import Result

_MISSING: dict[str, Any] = {"float": np.nan, "int": np.nan, "bool": np.nan, "str": ""}
# Dimensions that the records of a list share: shorter arrays are padded with NaN.
_SHARED = ("mass", "time")


def dataset(result: Result) -> xarray.Dataset:
    """Return a result as a Dataset; its attributes hold the process, the version, and the request as JSON.

    Raises
    ------
    MissingExtra
        xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise MissingExtra("to_xarray()", "xarray") from error
    columns = _Columns(result.units, result.roles)
    columns.add_record(result.schema, result)
    for field, values in outputs_of(result):
        columns.add(field, field.name, field.dims, values, result.schema)
    derived = result.derived()
    for field in result.schema.derived:
        codes, texts = derived[field.name]
        meanings, order = np.unique(texts, return_inverse=True)
        codes = order.astype(_smallest(len(meanings)))[codes]
        columns.add(field, field.name, field.dims, codes, result.schema, meanings=meanings.tolist())
    columns.number()
    for role, name in result.roles.items():
        columns.coordinates.setdefault(name, ((name,), getattr(result, role, None)))
    converted = xarray.Dataset(columns.variables, columns.coordinates, _attributes(result))
    for name, attributes in columns.attributes.items():
        converted[name].attrs.update(attributes)
    return converted


def _attributes(result: Result) -> dict[str, str]:
    attributes = {
        "process": result.process,
        "core_version": str(result.meta.get("core_version", "")),
        "request": json.dumps(result.meta.get("request", {}), sort_keys=True),
    }
    for field in result.schema:
        if _is_motion(field):
            attributes["motion"] = json.dumps(asdict(getattr(result, field.name)))
        elif isinstance(field.type, RecordSchema) and any(_is_motion(inner) for inner in field.type):
            attributes["motion"] = json.dumps([asdict(item.motion) for item in getattr(result, field.name)])
    return attributes


def _is_motion(field: Field) -> bool:
    return field.type is Motion.schema and field.variable is None


class _Columns:
    """Collects the variables, the coordinates and their attributes."""

    def __init__(self, units: str, roles: Mapping[str, str]) -> None:
        self.variables: dict[str, tuple[tuple[str, ...], Any]] = {}
        self.coordinates: dict[str, tuple[tuple[str, ...], Any]] = {}
        self.attributes: dict[str, dict[str, Any]] = {}
        self._units, self._roles = units, roles
        self._sizes: dict[str, int] = {}

    def add(
        self,
        field: Field,
        name: str,
        dims: tuple[str, ...],
        values: Any,
        record: RecordSchema,
        prefix: str = "",
        meanings: Sequence[str] = (),
    ) -> None:
        """Add a variable, or two for complex numbers; dimensions have the names of their coordinates.

        `meanings` are the texts that the values stand for.
        """
        if field.type == "complex":
            self._add(field, f"{name}_real", dims, values.real)
            self._add(field, f"{name}_imaginary", dims, values.imag)
            return
        if isinstance(record, ResultSchema):
            dims = tuple(prefix + self._roles.get(dim, dim) for dim in dims)
        self._add(field, name, dims, np.asarray(values))
        if meanings:
            words = " ".join(text.replace(" ", "_") or "_" for text in meanings)
            self.attributes[name] |= {
                "flag_values": np.arange(len(meanings), dtype=values.dtype),
                "flag_meanings": words,
            }

    def add_record(self, record: RecordSchema, item: Any, prefix: str = "") -> None:
        """Add the fields of a record."""
        for field in _shown(record):
            value = getattr(item, field.name)
            name = prefix + (field.variable or field.name)
            if field.type is Motion.schema:
                self.add(field, name, (), value.label or value.kind, record)
            elif isinstance(field.type, RecordSchema) and field.dims:
                self.add_records(field, value)
            elif isinstance(field.type, RecordSchema):
                if value is not None:
                    self.add_record(field.type, value, prefix + field.prefix)
                elif not field.optional:
                    self._add_nothing(field.type, prefix + field.prefix)
            elif value is not None:
                meanings = getattr(item, field.index_of) if field.index_of else ()
                codes = value.astype(_smallest(len(meanings))) if meanings else value
                self.add(field, name, field.dims, codes, record, prefix, meanings)

    def add_records(self, parent: Field, items: Sequence[Any], prefix: str = "") -> None:
        """Add the fields of a list of records; with a `prefix`, those of a record inside each record of a list."""
        assert isinstance(parent.type, RecordSchema)
        (along,) = parent.dims
        for field in _shown(parent.type):
            values: list[Any] = [None if item is None else getattr(item, field.name) for item in items]
            name = prefix + (field.variable or field.name)
            if field.type is Motion.schema:
                self.add(field, name, (along,), np.array([value.label or value.kind for value in values]), parent.type)
            elif isinstance(field.type, RecordSchema) and field.dims:
                self._add_owners(field.dims[0], along, [len(value) for value in values])
                self.add_records(field, [item for value in values for item in value])
            elif isinstance(field.type, RecordSchema):
                self.add_records(field.varied(dims=parent.dims), values, prefix + field.prefix)
            elif not field.dims:
                missing, kind = _MISSING[str(field.type)], TYPES[field.type]
                incomplete = any((field.optional, field.null, parent.optional, parent.null)) and field.type != "str"
                kind = np.float64 if incomplete else kind
                column: NDArray[Any] = np.array([missing if value is None else value for value in values], kind)
                self.add(field, parent.prefix + name if not prefix else name, (along,), column, parent.type)
            elif field.dims[-1] in _SHARED:
                self._add_padded(field, name, along, values)
            elif not values or any(value is not None for value in values):
                self._add_owners(field.dims[0], along, [len(value) for value in values])
                self.add(
                    field, name, field.dims, np.concatenate([np.zeros(0, TYPES[field.type]), *values]), parent.type
                )

    def number(self) -> None:
        """Add the coordinates of dimensions that are numbered from 1, and of the entries of states."""
        for dim, size in self._sizes.items():
            if dim in ("mass", "order"):
                self.coordinates.setdefault(dim, ((dim,), np.arange(1, size + 1)))
            elif dim == "state_entry":
                entries = [f"{name}{i}" for i in range(1, (size - 1) // 2 + 1) for name in ("x", "v")]
                self.coordinates[dim] = ((dim,), np.array([*entries, "theta"]))

    def _add(self, field: Field, name: str, dims: tuple[str, ...], values: NDArray[Any]) -> None:
        kind = self.coordinates if field.coordinate or dims == (name,) else self.variables
        kind[name] = (dims, values)
        self._sizes |= dict(zip(dims, values.shape, strict=True))
        unit = field.unit_in(self._units)
        self.attributes[name] = {"description": field.description} | ({"units": unit} if unit else {})

    def _add_nothing(self, record: RecordSchema, prefix: str) -> None:
        """Add a missing record, as NaN."""
        for field in _shown(record):
            nothing = np.full([self._sizes[dim] for dim in field.dims], _MISSING[str(field.type)])
            self.add(field, prefix + field.name, field.dims, nothing, record)

    def _add_owners(self, dim: str, list_dim: str, lengths: list[int]) -> None:
        owners = self.coordinates[list_dim][1] if list_dim in self.coordinates else np.arange(len(lengths))
        self.variables[f"{dim}_{list_dim}"] = ((dim,), np.repeat(owners, lengths))

    def _add_padded(self, field: Field, name: str, along: str, values: list[Any]) -> None:
        present = [value for value in values if value is not None]
        longest: Any = max(present, key=lambda value: value.shape[-1], default=None)
        shape = [self._sizes[dim] for dim in field.dims] if longest is None else longest.shape
        if field.dims == (name,):  # one coordinate for all records
            self._add(field, name, field.dims, longest)
            return
        whole = np.full((len(values), *shape), np.nan)
        for place, value in enumerate(values):
            if value is not None:
                whole[place, ..., : value.shape[-1]] = value
        self._add(field, name, (along, *field.dims), whole)


def _smallest(count: int) -> type[np.signedinteger[Any]]:
    """Return the type of codes for a number of meanings."""
    return np.int8 if count <= 128 else np.int16 if count <= 1 << 15 else np.int32


def _shown(record: RecordSchema) -> list[Field]:
    return [field for field in record if field.variable is not None]
