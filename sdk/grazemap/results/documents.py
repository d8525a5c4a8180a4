"""Documents and their schemas: deprecated names in documents, and documents from JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from grazemap.results.fields import Field, RecordSchema, Request, ResultSchema

Document = dict[str, Any]
_DTYPES = {"float": "float64", "int": "int64", "bool": "bool", "complex": "float64"}


def add_deprecated(record: RecordSchema, document: Document) -> None:
    """Add the deprecated names of fields beside the names that replace them, in place, also in the records inside."""
    for one in record:
        value = document.get(one.name)
        if isinstance(one.type, RecordSchema) and value is not None:
            for item in value if one.dims else [value]:
                add_deprecated(one.type, item)
        if one.replaces in document:
            document[one.name] = document[one.replaces]


def from_json(record: RecordSchema, document: Mapping[str, Any]) -> Document:
    """Return a document from its JSON, with arrays where the schema has them, and NaN for null in them.

    Fields that JSON alone has are left out. Fields that the schema lacks, as a newer service may send, become arrays if
    they are lists of numbers.
    """
    left_out = {one.name for one in record.in_json} if isinstance(record, ResultSchema) else set()
    return {
        name: _value_from_json(_field(record, name), value) for name, value in document.items() if name not in left_out
    }


def _field(record: RecordSchema, name: str) -> Field | None:
    return next((one for one in record if one.name == name), None)


def _value_from_json(one: Field | None, value: Any) -> Any:
    if one is None:
        return _guessed(value)
    if isinstance(one.type, Request) or value is None:
        return value
    if isinstance(one.type, RecordSchema):
        record = one.type
        return [from_json(record, item) for item in value] if one.dims else from_json(record, value)
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
