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
    known = {field.name for field in record}
    yield from (f"{path}.{name} is not declared" for name in document if name not in known)
    for field in record:
        at = f"{path}.{field.name}"
        if field.name not in document or (document[field.name] is None and field.when):
            if not field.optional:
                yield f"{at} lacks"
        elif document[field.name] is None:
            if not field.null:
                yield f"{at} is null"
        else:
            yield from _value_problems(field, document[field.name], at, sizes)


def _value_problems(field: Field, value: Any, at: str, sizes: dict[str, int]) -> Iterator[str]:
    if isinstance(field.type, RecordSchema):
        if not field.dims:
            yield from _problems(field.type, value, at, {} if isinstance(field.type, ResultSchema) else sizes)
            return
        yield from _size_problems(field.dims, (len(value),), at, sizes)
        for item in value:
            # the names of a record's own dimensions hold in this record only
            yield from _problems(field.type, item, at, {})
    elif isinstance(field.type, RequestDocument):
        if not isinstance(value, dict):
            yield f"{at} is no request"
    elif field.dims:
        array = np.asarray(value)
        pair = field.type == "complex"
        yield from _size_problems(field.dims, array.shape[:-1] if pair else array.shape, at, sizes)
        dtype = "str" if array.dtype.kind == "U" else str(array.dtype)
        if dtype != field.stored_dtype and not (field.is_tuple and array.size == 0):
            yield f"{at} is {dtype}, not {field.stored_dtype}"
        yield from _number_problems(field, array, at)
    else:
        if not isinstance(value, TYPES[field.type] | np.generic):
            yield f"{at} is a {type(value).__name__}, not a {field.type}"
        yield from _number_problems(field, np.asarray(value), at)


def _number_problems(field: Field, array: NDArray[Any], at: str) -> Iterator[str]:
    if array.dtype.kind == "f" and not field.null and not np.isfinite(array).all():
        yield f"{at} is not finite"
    if field.values and not set(array.ravel().tolist()) <= set(field.values):
        yield f"{at} has other values than {field.values}"


def _size_problems(dims: tuple[str, ...], shape: tuple[int, ...], at: str, sizes: dict[str, int]) -> Iterator[str]:
    if len(shape) != len(dims):
        yield f"{at} has {len(shape)} dimensions, not {len(dims)}"
        return
    for dim, size in zip(dims, shape, strict=True):
        if sizes.setdefault(dim, size) != size:
            yield f"{at} has {size} along {dim}, where others have {sizes[dim]}"
