"""The base of all results: it reads documents by their schema, and saves, loads and converts results."""

from __future__ import annotations

import json
import os
from collections.abc import Container, Mapping, Sequence, Sized
from dataclasses import field as attribute
from inspect import Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import CodecError, Document, decode_npz, encode_json, encode_npz
from grazemap.constants import ENGINEERING_UNITS, TABLE_FILES, UNITS
from grazemap.described import described
from grazemap.errors import ResultFormatError
from grazemap.results.documents import from_json
from grazemap.results.fields import TYPES, VERSION, Field, RecordSchema, RequestDocument, ResultSchema
from grazemap.results.record import ComplexArray, Record, changed, named_field
from grazemap.units import Refused, example, in_si, shown_in, si_unit
from grazemap.whole_files import whole_file
from grazemap.wire import Note

if TYPE_CHECKING:
    import pandas
    import xarray

RESULTS: dict[str, type[Result]] = {}
"""The classes of results by their names."""
# Maximum length of a list of texts, such as the reasons to which a map refers by numbers. No result has a longer one.
_MAX_TEXTS = 1 << 16
# What the meta of a file has besides that of the result.
_SHOWN_UNITS = "shown_units"


def counted(items: Sized, noun: str) -> str:
    """Return the number of items with the noun, in the plural unless it is one."""
    return f"{len(items)} {noun}{'' if len(items) == 1 else 's'}"


def counted_points(mask: NDArray[np.bool_], what: str) -> str:
    """Return the number of points in a mask with a word for them, and their share of all points."""
    return f"{np.count_nonzero(mask)} {what} ({mask.mean():.2%})"


def outside(what: str, name: str, value: float, ends: tuple[float, float], units: str) -> ValueError:
    """Return the error for a parameter value outside the range of a result; in SI it has units, and Hz or mm too."""
    low, high = ends
    if units != "SI" or name not in UNITS:
        return ValueError(f"{name} = {value:g} is outside the {what}, which has {low:g} to {high:g}")
    unit = UNITS[name]
    engineering_unit, factor = shown_in(unit, ENGINEERING_UNITS)
    return ValueError(
        f"{name} = {value:g} {unit} is outside the {what}, which has {low:g} to {high:g} {unit}, "
        f"{low * factor:g} to {high * factor:g} {engineering_unit}"
    )


def quantities(values: Any, name: str, units: str) -> NDArray[np.float64]:
    """Return values of a parameter as numbers, in their shape; of a machine in SI also from texts such as "5 Hz".

    Raises ValueError, which names the parameter, for anything else.
    """
    listed = values.tolist() if isinstance(values, np.ndarray) and values.dtype.kind not in "iuf" else values
    refused: list[Refused] = []
    kind = name.partition("[")[0]  # of "masses[1]"
    numbers = in_si(listed, units, refused, kind)
    if refused:
        raise ValueError(f"{name}: {refused[0].detail} (allowed: {refused[0].allowed})")
    try:
        return np.asarray(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        with_unit = f', or in SI numbers with a unit, as "{example(kind)}"' if kind in UNITS else ""
        raise ValueError(f"{name}: {values!r} is no number (allowed: numbers{with_unit})") from None


@described
class Result(Record):
    """What all results share; a subclass is the result of a process."""

    schema: ClassVar[ResultSchema]
    process: ClassVar[str]

    meta: dict[str, Any]
    """process, schema (version of the layout), request (canonical: every default filled in), core_version, numerics,
    units and notes."""
    _document: Document
    _shown_units: tuple[str, ...] = attribute(default=(), repr=False, compare=False, kw_only=True)
    # the address of the service that computed it; a result from a file, or computed without a service, has none
    _service: str | None = attribute(default=None, repr=False, compare=False, kw_only=True)

    def __init_subclass__(
        cls,
        process: str,
        rows: str = "",
        roles: Mapping[str, str] | None = None,
        derived: Mapping[str, Any] | None = None,
        in_json: Mapping[str, Any] | None = None,
    ) -> None:
        """Make the schema of the class. The keywords are those of `ResultSchema`, with fields of `derived` by name."""
        super().__init_subclass__()
        cls.schema = ResultSchema(
            **vars(cls.schema),
            process=process,
            rows=rows,
            roles=roles or {},
            derived=tuple(named_field(name, declared) for name, declared in (derived or {}).items()),
            in_json=tuple(named_field(name, declared) for name, declared in (in_json or {}).items()),
        )
        cls.process = process
        cls._comparable = False
        RESULTS[cls.__name__] = cls
        # results come from clients and files, so help() shows no arguments of the constructor
        cls.__signature__ = Signature()

    @classmethod
    def from_document(cls, document: Document, meta: dict[str, Any], service: str | None = None) -> Self:
        """Return the result that a document of the codec describes. Raises KeyError where a field is missing.

        `service` is the address of the service that has it.
        """
        return cls(meta=meta, _document=document, _service=service, **cls._attributes(document, meta))

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        return _decoded(cls.schema, document)

    @classmethod
    def json_document(cls, document: Document) -> Document:
        """Return a document of the codec with the fields that only JSON has."""
        return document

    @property
    def units(self) -> str:
        """Either "nondimensional" or "SI"."""
        return str(self.meta["request"]["oscillator"]["units"])

    @property
    def shown_units(self) -> tuple[str, ...]:
        """The units in place of rad/s and m in pictures and tables: those in which the request was written."""
        return self._shown_units

    def in_units(self, *units: str) -> Self:
        """Return the result with other units in its pictures and tables; its arrays stay in rad/s and m.

        Parameters
        ----------
        units
            Those of requests: "Hz", "rpm" or "rad/s" for frequencies, "mm" or "m" for lengths, "g" for masses. A
            quantity without a unit here keeps its own. No unit at all: the result itself.

        Raises
        ------
        ValueError
            Another unit, or the result is nondimensional.
        """
        if not units:
            return self
        if self.units != "SI":
            raise ValueError(f"a nondimensional result has no {' or '.join(units)}")
        chosen = {si_unit(unit): unit for unit in (*self.shown_units, *units)}
        # a diagram has a map and curves, and many trajectories are results of their own
        parts = {name: _in_units(part, units) for name, part in vars(self).items() if _has_results(part)}
        shown = tuple(unit for si, unit in chosen.items() if unit != si)
        return changed(self, **parts, _shown_units=shown)

    @property
    def notes(self) -> list[Note]:
        """Notes on what is probably not meant in the request, for example a window off the grazing curve."""
        return [Note.model_validate(note) for note in self.meta.get("notes", [])]

    def save(self, path: str | os.PathLike[str], table: str | None = None, *, engineering_units: bool = False) -> Path:
        """Write the result, or a table of it, to a file, and return its path.

        A file ending in .npz or .json has the whole result, whose arrays stay in SI, and its `shown_units`;
        `grazemap.load` reads both. One ending in .csv, .xlsx or .parquet has a `table` of those that `to_dataframe`
        names, with the units in the heads of its columns; the last two need the extra "tables". Without a name it is
        that of the points of a map, of basins or of bifurcation curves, or else of the result's own arrays; a workbook
        has all tables, each on a sheet. `engineering_units` makes the `shown_units`, in which tables are, Hz and mm.

        Raises
        ------
        ValueError
            Another ending, a table in a file of the whole result, an unknown name, or engineering units of a
            nondimensional result.
        MissingExtra
            What writes the file is not installed.
        """
        target = Path(path)
        encoders = {".npz": encode_npz, ".json": encode_json}
        endings = (*encoders, *TABLE_FILES)
        if target.suffix not in endings:
            raise ValueError(f"the name of a result's file ends in one of {', '.join(endings)}")
        if table is not None and target.suffix in encoders:
            allowed = ", ".join(TABLE_FILES)
            raise ValueError(f"table: a {target.suffix} file has the whole result (allowed: endings {allowed})")
        result = self.in_units(*ENGINEERING_UNITS) if engineering_units else self
        with whole_file(target) as file:
            if target.suffix in TABLE_FILES:
                from grazemap.results.tables import write_table

                write_table(result, file, table)
            else:
                document = result.json_document(result._document) if target.suffix == ".json" else result._document
                shown = {_SHOWN_UNITS: result.shown_units} if result.shown_units else {}
                file.write_bytes(encoders[target.suffix](document, result.meta | shown))
        return target

    def to_xarray(self) -> xarray.Dataset:
        """Return the result as an xarray Dataset, with dimensions, units and labels (needs the extra "xarray").

        Its attributes hold the process, the version, the request as JSON and the motion, if there is one. Records are
        stored by columns. Arrays of different lengths are joined, and a variable has the record of each entry.
        """
        from grazemap.results.dataset import dataset

        return dataset(self)

    def to_dataframe(self, table: str | None = None, *, engineering_units: bool = False) -> pandas.DataFrame:
        """Return a table of the result, such as its points or impacts, one row each (needs the extra "pandas").

        Without a name it is the table of the result's own arrays, such as the points of a curve or the samples of a
        trajectory; this table has the name of their dimension. A result without such arrays gives its only table. The
        `attrs` of the table have the units, which are those of `shown_units`, or with `engineering_units` Hz and mm.
        Raises ValueError for an unknown name, with the known names, and for engineering units of a nondimensional
        result.
        """
        from grazemap.results.tables import dataframe

        return dataframe(self.in_units(*ENGINEERING_UNITS) if engineering_units else self, table)

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """Return the tables of `to_dataframe` that are not in the schema: lists of dataclasses by name."""
        return {}

    def derived_units(self) -> dict[str, str]:
        """Return the units in SI of the columns of `derived_tables` that have one, by name."""
        return {}

    @property
    def roles(self) -> Mapping[str, str]:
        """The names of dimensions in a Dataset by their roles, where the two differ."""
        return self.schema.roles

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """Return the additional variables of a Dataset by name: codes, and the texts that they stand for."""
        return {}

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _repr_html_(self) -> str:
        from grazemap.results.html import result_html

        return result_html(self, self._summary())

    def _summary(self) -> str:
        raise NotImplementedError


def _has_results(part: Any) -> bool:
    return isinstance(part, Result) or (isinstance(part, tuple) and any(isinstance(item, Result) for item in part))


def _in_units(part: Any, units: Sequence[str]) -> Any:
    """Return a result, or several, in some units."""
    return part.in_units(*units) if isinstance(part, Result) else tuple(item.in_units(*units) for item in part)


def class_of(process: str, names: Container[str]) -> type[Result]:
    """Return the class of the result of a process; if there are several, the one whose fields are all among the names.

    Raises
    ------
    KeyError
        There is no such process.
    """
    forms = [kind for kind in RESULTS.values() if kind.process == process]
    if not forms:
        raise KeyError(process)
    whole = (kind for kind in forms if all(field.optional or field.name in names for field in kind.schema))
    return next(whole, forms[0])


def schema_of(process: str, names: Container[str]) -> ResultSchema:
    """Return the schema of `class_of`. Raises KeyError."""
    return class_of(process, names).schema


def load(path: str | os.PathLike[str]) -> Result:
    """Read a result from a .npz or .json file, as `Result.save` and the service write them.

    Raises
    ------
    ResultFormatError
        The file is not a result; the message names it.
    OSError
        The file cannot be read.
    """
    data = Path(path).read_bytes()
    try:
        return _decode_json(data) if data.lstrip().startswith(b"{") else decode_result(data)
    except ResultFormatError as error:
        raise ResultFormatError(f"{os.fspath(path)}: {error}") from error


def decode_result(data: bytes, service: str | None = None) -> Result:
    """Return the result object of npz bytes, from the service at an address. Raises ResultFormatError."""
    try:
        document, meta = decode_npz(data)
    except CodecError as error:
        raise ResultFormatError(str(error)) from error
    return _result_from(document, meta, service)


def _decode_json(data: bytes) -> Result:
    try:
        document = json.loads(data)
        meta = document.pop("meta")
        _check_layout(meta)
        # in JSON these repeat the meta
        for name in ("process", "schema"):
            document.pop(name, None)
        arrays = from_json(schema_of(meta["process"], document), document)
    except ResultFormatError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise ResultFormatError("not a grazemap result") from error
    return _result_from(arrays, meta)


def _check_layout(meta: Any) -> None:
    layout = meta.get("schema") if isinstance(meta, Mapping) else None
    if layout != VERSION:
        raise ResultFormatError(f"the result has layout {layout}, and this version of grazemap reads layout {VERSION}")


def _result_from(document: Document, meta: Mapping[str, Any], service: str | None = None) -> Result:
    _check_layout(meta)
    try:
        own = {name: value for name, value in meta.items() if name != _SHOWN_UNITS}
        result = class_of(meta["process"], document).from_document(document, own, service)
        _ = result.units  # pictures and Datasets need the request
        return result.in_units(*meta.get(_SHOWN_UNITS, ()))
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ResultFormatError("the document is not a result that this version can read") from error


def _decoded(record: RecordSchema, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes of a result from its document, without fields that are in documents only.

    Raises KeyError where a field that is always present is missing.
    """
    attributes: dict[str, Any] = {}
    for field in record:
        if field.stored_only:
            continue
        if field.optional and document.get(field.name) is None:
            attributes[field.name] = () if field.dims and isinstance(field.type, RecordSchema) else None
        else:
            attributes[field.name] = value_of(field, document[field.name])
    return attributes


def value_of(field: Field, value: Any) -> Any:
    """Return the attribute for a field's value in a document."""
    if isinstance(field.type, RecordSchema):
        kind = field.type.kind
        if field.dims:
            return tuple(kind(**_decoded(field.type, item)) for item in value)
        return None if value is None else kind(**_decoded(field.type, value))
    if isinstance(field.type, RequestDocument):
        return _plain(value)
    if field.type == "complex":
        return _complex(value)
    if field.is_tuple:
        if len(value) > _MAX_TEXTS:
            raise ValueError("a list of texts is too long")
        # a number of one byte would become a text of fifty
        if field.type == "str" and isinstance(value, np.ndarray) and value.size and value.dtype.kind != "U":
            raise ValueError("a list of texts has numbers")
        return tuple(map(TYPES[field.type], value))
    if field.dims:
        array: NDArray[Any] = np.asarray(value, dtype=TYPES[field.type])
        # neither JSON nor npz has the second dimension of an array without rows
        return array if array.size else array.reshape(*array.shape, *[0] * (len(field.dims) - array.ndim))
    if field.type == "float":
        return np.nan if value is None else float(value)
    return None if value is None else TYPES[field.type](value)


def _complex(pairs: Any) -> ComplexArray:
    values = np.asarray(pairs, dtype=np.float64)
    if not values.size:
        return np.zeros(values.shape[:-1] if values.ndim > 1 else (0, 0), dtype=np.complex128)
    joined: ComplexArray = values[..., 0] + 1j * values[..., 1]
    return joined


def _plain(value: Any) -> Any:
    """Return a request as plain values, whether it comes from npz or JSON."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
