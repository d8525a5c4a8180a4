"""Tables of results. A row is a record of a list, an entry of a record of arrays, or an entry of the own arrays."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap.constants import TABLE_FILES
from grazemap.errors import MissingExtra
from grazemap.results.fields import Field, RecordSchema
from grazemap.results.observables import outputs_of
from grazemap.units import shown_in
from grazemap.wire.planes import unit_of

if TYPE_CHECKING:
    import pandas

    from grazemap.results.base import Result

_Columns = dict[str, tuple[Field, list[Any]]]

POINTS = "points"
"""The table of the points of a plane, or of those of curves."""

PLANE = ("vertical", "horizontal")
"""The dimensions of a plane."""

CURVE = ("curve",)
"""The dimension of a list of curves."""
_POINT = ("point",)
# The columns of what varies along a line, whose unit is that of the parameter.
_OF_PARAMETER = ("parameter", "first", "last")
# Characters of the longest text in a printed table.
_WIDEST = 24
# pandas types of columns that can hold None.
_NULLABLE = {"int": "Int64", "bool": "boolean"}


def tables(result: Result) -> list[str]:
    """Return the names of the tables that a result has."""
    stored = [
        field.name for field in result.schema if is_table(field) and getattr(result, field.name, None) is not None
    ]
    stored = [name for name in stored if name != "outputs" or _are_rows(result)]
    rows = [result.schema.rows] if result.schema.rows else []
    return [*rows, *stored, *result.derived_tables(), *([POINTS] if _has_points(result) else [])]


def dataframe(result: Result, name: str | None) -> pandas.DataFrame:
    """Return a table of a result, in its `shown_units`.

    Raises
    ------
    MissingExtra
        pandas is not installed.
    ValueError
        The result has no such table; or `name` is None, and the result has neither a table of its own arrays nor
        exactly one other table.
    """
    try:
        import pandas
    except ImportError as error:
        raise MissingExtra("to_dataframe()", "pandas") from error
    names = tables(result)
    if name is None and (result.schema.rows or len(names) - _has_points(result) == 1):
        name = names[0]
    shown = shown_columns(result, name)
    table = pandas.DataFrame({key: pandas.Series(column.values, dtype=column.dtype) for key, column in shown.items()})
    table.attrs["units"] = {key: column.unit for key, column in shown.items() if column.unit}
    return table


def shown_columns(result: Result, name: str | None) -> dict[str, Column]:
    """Return the columns of a table of a result, in its `shown_units`. Raises ValueError."""
    names = tables(result)
    if name is None or name not in names:
        raise ValueError(f"a {type(result).__name__} has the tables: {', '.join(names) or 'none'}")
    return {key: _in_units(column, result.shown_units) for key, column in columns(result, name).items()}


class Column(NamedTuple):
    """A column of a table."""

    values: Sequence[Any] | NDArray[Any]
    """Its values."""
    dtype: str | None = None
    """Their type, as pandas names it; None where it is that of the values."""
    unit: str = ""
    """Its unit."""


def _in_units(column: Column, shown: Sequence[str]) -> Column:
    unit, factor = shown_in(column.unit, shown)
    if factor == 1.0:
        return column
    if isinstance(column.values, np.ndarray):
        return Column(factor * column.values, column.dtype, unit)
    return Column([None if value is None else factor * value for value in column.values], column.dtype, unit)


def columns(result: Result, name: str) -> dict[str, Column]:
    """Return the columns of a table of a result, by name. An empty table that is not in the schema has no columns."""
    derived = result.derived_tables().get(name)
    if derived is not None:
        rows = [asdict(item) for item in derived]
        listed = {key: [row[key] for row in rows] for key in (rows[0] if rows else ())}
        # whole numbers beside None stay whole
        whole = {key for key, values in listed.items() if any(type(value) is int for value in values)}
        units = result.derived_units() if result.units == "SI" else {}
        return {
            key: Column(values, "Int64" if key in whole else None, units.get(key, "")) for key, values in listed.items()
        }
    plane = _plane_of(result)
    if name == POINTS and plane is not None:
        return _points(plane)
    curves = _curves_of(result)
    if name == POINTS and curves is not None:
        return _points_of_curves(result, curves)
    collected: _Columns = {}
    if name == result.schema.rows:
        _add_arrays(collected, result, name)
    else:
        field = result.schema[name]
        assert isinstance(field.type, RecordSchema)
        value = getattr(result, name)
        if field.dims:
            _add_arrays(collected, result, *field.dims)
            _add_records(collected, field.type, value, "", _lengths(result))
        else:
            for inner in field.type:
                collected[inner.name] = (inner, list(getattr(value, inner.name)))
    return {
        key: Column(
            values,
            _dtype(field, values),
            _unit_along(result, "axis") if key in _OF_PARAMETER else _unit_of_column(result, key, field),
        )
        for key, (field, values) in collected.items()
    }


def _unit_of_column(result: Result, name: str, field: Field) -> str:
    return field.unit_in(result.units) or (_unit_along(result, name) if name in PLANE else "")


def _unit_along(result: Result, axis: str) -> str:
    """Return the unit of what varies along an axis of the request."""
    varied = result.meta["request"].get(axis, {}).get("vary", "")
    return unit_of(varied) if result.units == "SI" else ""


def _plane_of(result: Result) -> Result | None:
    """Return the result that has arrays over a plane: it, or its map; None if there is none."""
    plane: Result = getattr(result, "unfolding_map", result)
    return plane if any(field.dims == PLANE for field in plane.schema.derived) else None


def _curves_of(result: Result) -> Field | None:
    """Return the field of a result that has curves with points; None if there is none."""
    return next((field for field in result.schema if field.dims == CURVE), None)


def _inside(curves: Field) -> tuple[Field, ...]:
    assert isinstance(curves.type, RecordSchema)
    return curves.type.fields


def _has_points(result: Result) -> bool:
    return _plane_of(result) is not None or _curves_of(result) is not None


def _points_of_curves(result: Result, curves: Field) -> dict[str, Column]:
    """Return the columns of the points of curves: the position of the curve, what it is, and the numbers of a point."""
    items = getattr(result, curves.name)
    axes: dict[str, str] = dict(zip(reversed(PLANE), getattr(result, "parameters", ()), strict=False))
    lengths = [_length(curves, item) for item in items]
    table = {curves.dims[0]: Column(np.repeat(np.arange(len(items)), lengths))}
    for inner in _inside(curves):
        values = [getattr(item, inner.name) for item in items]
        if all(value is None for value in values) or (inner.dims and inner.dims != _POINT):
            continue
        unit = inner.unit_in(result.units) or ""
        if inner.dims:
            pairs = zip(values, lengths, strict=True)
            shown = [np.full(length, np.nan) if value is None else value for value, length in pairs]
            name = axes.get(inner.name, inner.name)
            unit = unit_of(name) if name != inner.name and result.units == "SI" else unit
            table[name] = Column(np.concatenate([np.zeros(0), *shown]), None, unit)
        elif isinstance(inner.type, str) and inner.type != "complex":
            repeated = [value for value, length in zip(values, lengths, strict=True) for _ in range(length)]
            table[inner.name] = Column(repeated, _dtype(inner, repeated), unit)
    return table


def _length(curves: Field, item: Any) -> int:
    """Return the number of points of a curve."""
    arrays = (getattr(item, inner.name) for inner in _inside(curves) if inner.dims == _POINT)
    return next(len(values) for values in arrays if values is not None)


def _points(plane: Result) -> dict[str, Column]:
    """Return the columns of the points of a plane: both coordinates, the names of motions, and all numbers."""
    up, across = (np.asarray(getattr(plane, role)) for role in PLANE)
    table: dict[str, Column] = {}
    for role, values in (("horizontal", np.tile(across, len(up))), ("vertical", np.repeat(up, len(across)))):
        name = plane.roles.get(role, role)
        stored = "".join(field.unit for field in plane.schema if field.name == name and plane.units == "SI")
        table[name] = Column(values, None, stored or _unit_along(plane, role))
    derived = plane.derived()
    for field in plane.schema.derived:
        if field.dims == PLANE:
            codes, texts = derived[field.name]
            table[field.name] = Column(np.array(texts, dtype=object)[codes].ravel())
    for field in plane.schema:
        if field.dims == PLANE and (entries := getattr(plane, field.name)) is not None:
            names = getattr(plane, field.index_of) if field.index_of else None
            shown = entries if names is None else np.array(names, dtype=object)[entries]
            table[field.name] = Column(shown.ravel(), None, field.unit_in(plane.units))
    return table


_WRITERS = {".xlsx": ("openpyxl", "xlsxwriter"), ".parquet": ("pyarrow", "fastparquet")}
"""Packages of which pandas needs one for files with these endings."""
_SHEET_ROWS = 1 << 20
"""Most rows of a sheet of a workbook."""


def require_writer(ending: str) -> None:
    """Raise MissingExtra where what writes tables with this ending is not installed."""
    if ending in _WRITERS and not (find_spec("pandas") and any(map(find_spec, _WRITERS[ending]))):
        raise MissingExtra(f"a table as {ending}", "tables")


def require_rows(ending: str, rows: int, table: str) -> None:
    """Raise ValueError where a file with this ending cannot have so many rows and their heads."""
    if ending == ".xlsx" and rows + 1 > _SHEET_ROWS:
        allowed = ", ".join(form for form in TABLE_FILES if form != ending)
        raise ValueError(
            f"the table {table} has {rows:,} rows, and a sheet of {ending} at most {_SHEET_ROWS - 1:,} below the heads "
            f"(allowed: {allowed})"
        )


def write_table(result: Result, path: Path, name: str | None) -> None:
    """Write a table of a result, or all of them into a workbook; the units are in the heads of the columns.

    Raises
    ------
    MissingExtra
        What writes the form is not installed.
    ValueError
        As `dataframe`, but no name is needed: the points come first, then the result's own arrays. Or a workbook cannot
        have so many rows.
    """
    names = tables(result)
    first = POINTS if _has_points(result) else next(iter(names), None)
    if path.suffix == ".csv":
        shown = shown_columns(result, name or first)
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(_head(key, column.unit) for key, column in shown.items())
            writer.writerows(zip(*(map(_written, column.values) for column in shown.values()), strict=True))
        return
    require_writer(path.suffix)
    sheets = [name] if name or path.suffix == ".parquet" else list(dict.fromkeys([first, *names]))
    frames = {sheet or "": _headed(dataframe(result, sheet or first)) for sheet in sheets}
    for sheet, frame in frames.items():
        require_rows(path.suffix, len(frame), sheet)
    if path.suffix == ".parquet":
        next(iter(frames.values())).to_parquet(path, index=False)
        return
    from pandas import ExcelWriter

    # pandas leaves a file open where it fails
    content = io.BytesIO()
    with ExcelWriter(content) as book:
        for sheet, frame in frames.items():
            frame.to_excel(book, sheet_name=sheet, index=False)
    path.write_bytes(content.getvalue())


def _head(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit and unit != "nondimensional" else name


def _headed(table: pandas.DataFrame) -> pandas.DataFrame:
    return table.rename(columns={key: _head(key, table.attrs["units"].get(key, "")) for key in table.columns})


def _written(value: Any) -> Any:
    """Return a value as text has it: nothing for what is missing, and floats with all their digits."""
    if isinstance(value, float):  # numpy's too
        return repr(float(value)) if value == value else ""
    return "" if value is None else value


def text(table: Mapping[str, Column], rows: int, width: int) -> list[str]:
    """Return the lines of the first rows of a table; columns that do not fit the width follow below."""
    count = len(next(iter(table.values())).values) if table else 0
    if not count:
        return ["no rows"]
    shown = min(rows, count)
    numbers = _aligned("", list(map(str, range(shown))))
    blocks: list[list[str]] = []
    for key, column in table.items():
        cells = _aligned(_head(key, column.unit), list(map(_cell, column.values[:shown])))
        if not blocks or len(blocks[-1][0]) + 2 + len(cells[0]) > width:
            blocks.append(list(numbers))
        blocks[-1] = [f"{line}  {cell}" for line, cell in zip(blocks[-1], cells, strict=True)]
    lines = [line for block in blocks for line in block]
    return lines if shown == count else [*lines, f"{count - shown} more rows"]


def _aligned(title: str, cells: Sequence[str]) -> list[str]:
    width = max(map(len, (title, *cells)))
    return [cell.rjust(width) for cell in (title, *cells)]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    written = "" if value is None else str(value)
    return written if len(written) <= _WIDEST else f"{written[: _WIDEST - 3]}..."


def _are_rows(result: Result) -> bool:
    """Return whether the outputs of a result are rows of a table; outputs that are arrays are columns of another."""
    return any(not field.dims for field, _ in outputs_of(result))


def is_table(field: Field) -> bool:
    """Return whether a field is a list of records, or a record of arrays of one length."""
    if field.stored_only or not isinstance(field.type, RecordSchema):
        return False
    dims = field.type.fields[0].dims
    return bool(field.dims) or (
        len(dims) == 1 and all(inner.dims == dims and isinstance(inner.type, str) for inner in field.type)
    )


def _numbers(field: Field) -> bool:
    """Return whether a field is an array of numbers that columns can have."""
    return bool(field.dims) and field.type in ("float", "int", "bool") and not field.is_tuple


def _lengths(result: Result) -> dict[str, int]:
    """Return the lengths of the dimensions that arrays of a result have by themselves."""
    return {
        field.dims[0]: len(values)
        for field in result.schema
        if _numbers(field) and len(field.dims) == 1 and (values := getattr(result, field.name)) is not None
    }


def _add_arrays(columns: _Columns, result: Result, rows: str) -> None:
    """Add a column for each array over a dimension; an array with a second dimension has numbered columns."""
    for field in result.schema:
        if not _numbers(field) or rows not in field.dims or getattr(result, field.name) is None:
            continue
        values = np.moveaxis(getattr(result, field.name), field.dims.index(rows), -1)
        if values.ndim == 1:
            columns[field.name] = (field, list(values))
        else:
            columns |= {f"{field.name}_{i}": (field, list(entry)) for i, entry in enumerate(values, start=1)}
    columns |= {field.name: (field, list(values)) for field, values in outputs_of(result) if field.dims == (rows,)}


def _add_records(
    columns: _Columns,
    record: RecordSchema,
    items: Sequence[Any],
    prefix: str,
    lengths: Mapping[str, int],
) -> None:
    """Add a column for each field of some records that is a single value; a record inside has its name as prefix.

    Arrays over a dimension of the result, whose length is in `lengths`, have a numbered column for each entry. The
    label of a motion that is not periodic is its kind, as in legends.
    """
    of_motions = any(field.name == "kind" for field in record)
    for field in record:
        values = [None if item is None else getattr(item, field.name) for item in items]
        if field.name == "label" and of_motions:
            values = [None if item is None else item.label or item.kind for item in items]
        if field.dims:
            if field.type == "float" and field.dims[0] in lengths:
                for i in range(lengths[field.dims[0]]):
                    entries = [value[i] if value is not None and i < len(value) else np.nan for value in values]
                    columns[f"{prefix}{field.name}_{i + 1}"] = (field, entries)
        elif isinstance(field.type, RecordSchema):
            _add_records(columns, field.type, values, f"{prefix}{field.name}_", lengths)
        elif isinstance(field.type, str) and field.type != "complex":
            columns[prefix + field.name] = (field, values)


def _dtype(field: Field, values: list[Any]) -> str:
    if field.type in _NULLABLE:
        return _NULLABLE[field.type] if None in values else str(field.type)
    return "float64" if field.type == "float" else "object"
