"""Documents and their schemas: checking them, deprecated names in them, those of earlier versions, those from JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.schema.fields import VERSION, Field, Record, Request, ResultSchema

Document = dict[str, Any]
_DTYPES = {"float": "float64", "int": "int64", "bool": "bool", "complex": "float64"}
_KINDS = {"float": float, "int": int, "bool": bool, "str": str}


def with_deprecated(record: Record, document: Mapping[str, Any]) -> Document:
    """Return a document with the deprecated names of its fields beside the names that replace them."""
    full: Document = {}
    for name, value in document.items():
        one = _field(record, name)
        full[name] = _each(one, value, lambda item, inside: with_deprecated(inside, item))
    for one in record:
        if one.replaces in document:
            full[one.name] = document[one.replaces]
    return full


def upgraded(record: Record, document: Mapping[str, Any], version: int) -> Document:
    """Return a document that was written with a layout of a version in the layout of this one.

    Version 1 had `certified` alone: of a periodic orbit it said that the orbit is isolated, elsewhere that the motion
    is verified.
    """
    if version >= VERSION:
        return dict(document)
    new: Document = {}
    for name, value in document.items():
        new[name] = _each(_field(record, name), value, lambda item, inside: upgraded(inside, item, version))
    if "certified" in document and "verified" not in document:
        new["verified"] = document["certified"]
    if record.name == "PeriodicOrbit":
        _upgrade_orbit(new)
    if record.name == "OrbitBranch" and "isolated" not in document:
        # version 1 did not keep whether the orbits along a branch are isolated
        new |= dict.fromkeys(("isolated", "verified"), np.zeros_like(np.asarray(new["stable"], dtype=np.bool_)))
    return new


def _upgrade_orbit(new: Document) -> None:
    motion = new["motion"]
    new["isolated"] = new["certified"]
    least = motion["period"] == new["period"]
    new["verified"] = bool(new["isolated"] and new["admissible"] and new["stable"] and least)
    new["motion"] = {**motion, "verified": new["verified"]}


def problems(record: Record, document: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with a document: missing or undeclared fields, types, dimensions, values."""
    return list(_problems(record, document, record.name, {}))


def from_json(record: Record, document: Mapping[str, Any]) -> Document:
    """Return the document whose JSON was read, with arrays where the schema has them; null is NaN in an array.

    Fields that the schema does not know, as a newer service may send, are arrays where they are lists of numbers.
    """
    return {name: _value_from_json(_field(record, name), value) for name, value in document.items()}


def _field(record: Record, name: str) -> Field | None:
    return next((one for one in record if one.name == name), None)


def _each(one: Field | None, value: Any, change: Any) -> Any:
    """Return a value with `change(item, record)` in place of each record in it."""
    if one is None or not isinstance(one.type, Record) or value is None:
        return value
    record = one.type
    return [change(item, record) for item in value] if one.dims else change(value, record)


def _value_from_json(one: Field | None, value: Any) -> Any:
    if one is None:
        return _guessed(value)
    if isinstance(one.type, Request) or value is None:
        return value
    if isinstance(one.type, Record):
        return _each(one, value, lambda item, inside: from_json(inside, item))
    if not one.dims or (one.texts and one.type != "str"):
        return value
    if one.type == "str":
        return np.asarray(value, dtype=np.str_)
    return np.asarray(value, dtype=one.dtype or _DTYPES[one.type])


def _guessed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _guessed(item) for key, item in value.items()}
    if not isinstance(value, list):
        return value
    if value and isinstance(value[0], dict):
        return [_guessed(item) for item in value]
    array = np.asarray(value)
    return np.asarray(value, dtype=np.float64) if array.dtype == object else array


def _problems(record: Record, document: Mapping[str, Any], path: str, sizes: dict[str, int]) -> Iterator[str]:
    known = {one.name for one in record}
    yield from (f"{path}.{name} is not declared" for name in document if name not in known)
    for one in record:
        at = f"{path}.{one.name}"
        if one.name not in document or (document[one.name] is None and one.when):
            if not one.optional:
                yield f"{at} lacks"
        elif document[one.name] is None:
            if not one.null:
                yield f"{at} is null"
        else:
            yield from _value_problems(one, document[one.name], at, sizes)


def _value_problems(one: Field, value: Any, at: str, sizes: dict[str, int]) -> Iterator[str]:
    if isinstance(one.type, Record):
        if not one.dims:
            yield from _problems(one.type, value, at, {} if isinstance(one.type, ResultSchema) else sizes)
            return
        yield from _size_problems(one.dims, (len(value),), at, sizes)
        for item in value:
            # the names of a record's own dimensions hold in this record only
            yield from _problems(one.type, item, at, {})
    elif isinstance(one.type, Request):
        if not isinstance(value, dict):
            yield f"{at} is no request"
    elif one.dims:
        array = np.asarray(value)
        pair = one.type == "complex"
        yield from _size_problems(one.dims, array.shape[:-1] if pair else array.shape, at, sizes)
        expected = "str" if one.type == "str" else one.dtype or _DTYPES[one.type]
        found = "str" if array.dtype.kind == "U" else str(array.dtype)
        if found != expected and not (one.texts and array.size == 0):
            yield f"{at} is {found}, not {expected}"
        yield from _number_problems(one, array, at)
    else:
        if not isinstance(value, _KINDS[one.type] | np.generic):
            yield f"{at} is a {type(value).__name__}, not a {one.type}"
        yield from _number_problems(one, np.asarray(value), at)


def _number_problems(one: Field, array: NDArray[Any], at: str) -> Iterator[str]:
    if array.dtype.kind == "f" and not one.null and not np.isfinite(array).all():
        yield f"{at} is not finite"
    if one.values and not set(array.ravel().tolist()) <= set(one.values):
        yield f"{at} has other values than {one.values}"


def _size_problems(dims: tuple[str, ...], shape: tuple[int, ...], at: str, sizes: dict[str, int]) -> Iterator[str]:
    if len(shape) != len(dims):
        yield f"{at} has {len(shape)} dimensions, not {len(dims)}"
        return
    for dim, size in zip(dims, shape, strict=True):
        if sizes.setdefault(dim, size) != size:
            yield f"{at} has {size} along {dim}, where others have {sizes[dim]}"
