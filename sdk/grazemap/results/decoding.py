"""From documents to the attributes of results, by their schemas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.results.records import RECORDS, ComplexArray, FloatArray, IntArray
from grazemap.schema import Field, Record, Request


def decoded(record: Record, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes that a document stands for; deprecated names are left out.

    Raises
    ------
    KeyError
        A field that is always present is missing.
    """
    attributes: dict[str, Any] = {}
    for one in record:
        if one.replaces:
            continue
        if one.optional and document.get(one.name) is None:
            attributes[one.name] = () if one.dims and isinstance(one.type, Record) else None
        else:
            attributes[one.name] = value_of(one, document[one.name])
    return attributes


def value_of(one: Field, value: Any) -> Any:
    """Return the attribute that a field's value in a document stands for."""
    if isinstance(one.type, Record):
        if one.dims:
            return tuple(_record(one.type, item) for item in value)
        return None if value is None else _record(one.type, value)
    if isinstance(one.type, Request):
        return _plain(value)
    if one.type == "complex":
        return _complex(value)
    if one.dims:
        return _texts(one, value) if one.texts else _array(one, value)
    if one.type == "float":
        return float(floats(value))
    if value is None:
        return None
    kinds: dict[str, type] = {"int": int, "bool": bool, "str": str}
    return kinds[one.type](value)


def floats(value: Any) -> FloatArray:
    """Return an array of binary64; None is NaN."""
    return np.asarray(value, dtype=np.float64)


def integers(value: Any) -> IntArray:
    """Return an array of int64."""
    return np.asarray(value, dtype=np.int64)


def _record(record: Record, document: Mapping[str, Any]) -> Any:
    return RECORDS[record.name](**decoded(record, document))


def _texts(one: Field, value: Any) -> tuple[Any, ...]:
    return tuple((int if one.type == "int" else str)(item) for item in value)


def _array(one: Field, value: Any) -> NDArray[Any]:
    if one.type == "int":
        return integers(value)
    kinds: dict[str, Any] = {"float": np.float64, "bool": np.bool_, "str": np.str_}
    array = np.asarray(value, dtype=kinds[str(one.type)])
    # JSON and npz alike write no second dimension where the first one is empty
    return array if array.size else array.reshape(*array.shape, *[0] * (len(one.dims) - array.ndim))


def _complex(pairs: Any) -> ComplexArray:
    values = floats(pairs)
    if not values.size:
        return np.zeros(values.shape[:-1] if values.ndim > 1 else (0, 0), dtype=np.complex128)
    joined: ComplexArray = values[..., 0] + 1j * values[..., 1]
    return joined


def _plain(value: Any) -> Any:
    """Return a request as plain values, from npz and from JSON alike."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
