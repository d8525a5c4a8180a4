"""Documents and their schemas: documents from fields, and documents from JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NewType

import numpy as np

from grazemap.results.fields import Field, RecordSchema, Request, ResultSchema

if TYPE_CHECKING:
    from grazemap.results.record import Record

Document = dict[str, Any]
ClassDocument = NewType("ClassDocument", Document)
"""A document that `document_of` has made, with the names of the fields of a class."""


def document_of(kind: type[Record], source: object = None, /, **values: Any) -> ClassDocument:
    """Return the document of a record or of a result, with the deprecated names of its fields.

    Parameters
    ----------
    kind : class of a record or of a result
    source
        An object of the core, whose attributes are the fields without a value. What is None there is left out if not
        every document has the field.
    values
        Values of fields. A record inside is its document, or the object of the core that it is made of, and complex
        numbers need not be pairs.

    Raises
    ------
    TypeError
        The class, or that of a record inside, has no field of a name; or neither the values nor the object have one
        that every document has.
    """
    document: Document = {}
    for one in kind.schema:
        if one.replaces:
            values.pop(one.name, None)
            if one.replaces in document:
                document[one.name] = document[one.replaces]
        elif one.name in values:
            document[one.name] = _stored(one, values.pop(one.name))
        elif one.optional and getattr(source, one.name, None) is None:
            continue
        elif hasattr(source, one.name):
            document[one.name] = _stored(one, getattr(source, one.name))
        else:
            raise TypeError(f"a document of {kind.schema.name} lacks {one.name}")
    if values:
        raise TypeError(f"documents of {kind.schema.name} have no {', '.join(values)}")
    return ClassDocument(document)


def _stored(one: Field, value: Any) -> Any:
    """Return the value of a field as documents have it."""
    if isinstance(one.type, RecordSchema) and value is not None:
        return [_record(one.type, item) for item in value] if one.dims else _record(one.type, value)
    if one.type == "complex" and np.iscomplexobj(value):
        return np.stack([value.real, value.imag], axis=-1)
    return value


def _record(record: RecordSchema, value: Any) -> Any:
    return document_of(record.kind, **value) if isinstance(value, Mapping) else document_of(record.kind, value)


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
    return np.asarray(value, dtype=one.stored_dtype)


def _guessed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _guessed(item) for key, item in value.items()}
    if not isinstance(value, list):
        return value
    if value and isinstance(value[0], dict):
        return [_guessed(item) for item in value]
    array = np.asarray(value)
    return np.asarray(value, dtype=np.float64) if array.dtype == object else array
