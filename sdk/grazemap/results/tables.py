"""Tables of results: a row for each record of a list, for each entry of a record of arrays, or of the arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.errors import MissingExtra
from grazemap.schema import Field, Record

if TYPE_CHECKING:
    import pandas

    from grazemap.results.base import Result

# Columns in which None is kept apart from 0 and False.
_NULLABLE = {"int": "Int64", "bool": "boolean"}


def tables(result: Result) -> list[str]:
    """Return the names of the tables that a result has."""
    stored = [one.name for one in result.schema if _is_table(one) and getattr(result, one.name, None) is not None]
    return [*([result.schema.rows] if result.schema.rows else []), *stored, *result.derived_tables()]


def dataframe(result: Result, name: str | None) -> pandas.DataFrame:
    """Return a table of a result.

    Raises
    ------
    MissingExtra
        pandas is not installed.
    ValueError
        The result has no such table; or `name` is None, and there is none of its arrays, and not exactly one other.
    """
    try:
        import pandas
    except ImportError as error:
        raise MissingExtra("to_dataframe()", "pandas") from error
    found = tables(result)
    if name is None and (result.schema.rows or len(found) == 1):
        name = found[0]
    if name is None or name not in found:
        raise ValueError(f"a {type(result).__name__} has the tables: {', '.join(found) or 'none'}")
    derived = result.derived_tables().get(name)
    if derived is not None:
        plain = pandas.DataFrame([asdict(item) for item in derived])
        # whole numbers beside None stay whole
        whole = {key: "Int64" for key in plain if any(type(getattr(item, key)) is int for item in derived)}
        return plain.astype(whole)
    columns: dict[str, tuple[Field, list[Any]]] = {}
    if name == result.schema.rows:
        _add_arrays(columns, result, name)
    else:
        one = result.schema[name]
        assert isinstance(one.type, Record)
        value = getattr(result, name)
        if one.dims:
            _add_arrays(columns, result, *one.dims)
            _add_records(columns, one.type, value, "", _lengths(result))
        else:
            for inner in one.type:
                columns[inner.name] = (inner, list(getattr(value, inner.name)))
    series = {key: pandas.Series(values, dtype=_dtype(of, values)) for key, (of, values) in columns.items()}
    table = pandas.DataFrame(series)
    units = {key: of.unit_in(result.units) for key, (of, _) in columns.items()}
    table.attrs["units"] = {key: unit for key, unit in units.items() if unit}
    return table


def _is_table(one: Field) -> bool:
    if not isinstance(one.type, Record):
        return False
    dims = one.type.fields[0].dims
    return bool(one.dims) or (
        len(dims) == 1 and all(inner.dims == dims and isinstance(inner.type, str) for inner in one.type)
    )


def _numbers(one: Field) -> bool:
    """Return whether a field is an array of numbers that columns can have."""
    return bool(one.dims) and one.type in ("float", "int", "bool") and not one.texts and not one.replaces


def _lengths(result: Result) -> dict[str, int]:
    """Return the lengths of the dimensions that arrays of a result have by themselves."""
    return {
        one.dims[0]: len(getattr(result, one.name)) for one in result.schema if _numbers(one) and len(one.dims) == 1
    }


def _add_arrays(columns: dict[str, tuple[Field, list[Any]]], result: Result, rows: str) -> None:
    """Add a column for each array over a dimension; for one with another dimension too, a numbered one per entry."""
    for one in result.schema:
        if not _numbers(one) or rows not in one.dims or getattr(result, one.name) is None:
            continue
        values = np.moveaxis(getattr(result, one.name), one.dims.index(rows), -1)
        if values.ndim == 1:
            columns[one.name] = (one, list(values))
        else:
            columns |= {f"{one.name}_{i}": (one, list(entry)) for i, entry in enumerate(values, start=1)}


def _add_records(
    columns: dict[str, tuple[Field, list[Any]]],
    record: Record,
    items: Sequence[Any],
    prefix: str,
    lengths: Mapping[str, int],
) -> None:
    """Add a column for each field of records that is one value; records in a record have its name as prefix.

    Arrays over a dimension of the result, which has a length, have a numbered column for each entry.
    """
    for one in record:
        if one.replaces:
            continue
        values = [None if item is None else getattr(item, one.name) for item in items]
        if one.dims:
            if one.type == "float" and one.dims[0] in lengths:
                for i in range(lengths[one.dims[0]]):
                    entries = [value[i] if value is not None and i < len(value) else np.nan for value in values]
                    columns[f"{prefix}{one.name}_{i + 1}"] = (one, entries)
        elif isinstance(one.type, Record):
            _add_records(columns, one.type, values, f"{prefix}{one.name}_", lengths)
        elif isinstance(one.type, str) and one.type != "complex":
            columns[prefix + one.name] = (one, values)


def _dtype(one: Field, values: list[Any]) -> str:
    if one.type in _NULLABLE:
        return _NULLABLE[one.type] if None in values else str(one.type)
    return "float64" if one.type == "float" else "object"
