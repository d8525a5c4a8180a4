"""What is wrong with a result's document, compared with its schema."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.results.fields import TYPES, Field, RecordSchema, RequestDocument, ResultSchema


def problems(record: RecordSchema, document: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with a document: missing or undeclared fields, types, dimensions, values."""
    return list(_problems(record, document, record.name, {}))


def _problems(record: RecordSchema, document: Mapping[str, Any], path: str, sizes: dict[str, int]) -> Iterator[str]:
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
    if isinstance(one.type, RecordSchema):
        if not one.dims:
            yield from _problems(one.type, value, at, {} if isinstance(one.type, ResultSchema) else sizes)
            return
        yield from _size_problems(one.dims, (len(value),), at, sizes)
        for item in value:
            # the names of a record's own dimensions hold in this record only
            yield from _problems(one.type, item, at, {})
    elif isinstance(one.type, RequestDocument):
        if not isinstance(value, dict):
            yield f"{at} is no request"
    elif one.dims:
        array = np.asarray(value)
        pair = one.type == "complex"
        yield from _size_problems(one.dims, array.shape[:-1] if pair else array.shape, at, sizes)
        found = "str" if array.dtype.kind == "U" else str(array.dtype)
        if found != one.stored_dtype and not (one.is_tuple and array.size == 0):
            yield f"{at} is {found}, not {one.stored_dtype}"
        yield from _number_problems(one, array, at)
    else:
        if not isinstance(value, TYPES[one.type] | np.generic):
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
