"""Tables of results: one row for each record of a list, or for each entry of a record of arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

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
    return [*stored, *result.derived_tables()]


def dataframe(result: Result, name: str | None) -> pandas.DataFrame:
    """Return a table of a result.

    Raises
    ------
    MissingExtra
        pandas is not installed.
    ValueError
        The result has no such table, or several and `name` is None.
    """
    try:
        import pandas
    except ImportError as error:
        raise MissingExtra("to_dataframe()", "pandas") from error
    found = tables(result)
    if name is None and len(found) == 1:
        (name,) = found
    if name is None or name not in found:
        raise ValueError(f"a {type(result).__name__} has the tables: {', '.join(found) or 'none'}")
    derived = result.derived_tables().get(name)
    if derived is not None:
        plain = pandas.DataFrame([asdict(item) for item in derived])
        # whole numbers beside None stay whole
        whole = {key: "Int64" for key in plain if any(type(getattr(item, key)) is int for item in derived)}
        return plain.astype(whole)
    one = result.schema[name]
    assert isinstance(one.type, Record)
    value = getattr(result, name)
    columns: dict[str, Any] = {}
    if one.dims:
        _add_records(columns, one.type, value, "")
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


def _add_records(columns: dict[str, Any], record: Record, items: Sequence[Any], prefix: str) -> None:
    """Add a column for each field of records that is one value; records in a record have its name as prefix."""
    for one in record:
        if one.replaces or one.dims:
            continue
        values = [None if item is None else getattr(item, one.name) for item in items]
        if isinstance(one.type, Record):
            _add_records(columns, one.type, values, f"{prefix}{one.name}_")
        elif isinstance(one.type, str) and one.type != "complex":
            columns[prefix + one.name] = (one, values)


def _dtype(one: Field, values: list[Any]) -> str:
    if one.type in _NULLABLE:
        return _NULLABLE[one.type] if None in values else str(one.type)
    return "float64" if one.type == "float" else "object"
