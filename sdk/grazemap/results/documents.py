"""Makes documents by their schemas: from the values of fields, and from JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NewType

import numpy as np

from grazemap.results.fields import Field, RecordSchema, RequestDocument, ResultSchema

if TYPE_CHECKING:
    from grazemap.results.record import Record

Document = dict[str, Any]
ClassDocument = NewType("ClassDocument", Document)
"""A document that `document_of` has made, with the names of the fields of a class."""


def document_of(kind: type[Record], source: object = None, /, **values: Any) -> ClassDocument:
    """Return the document of a record or of a result.

    Parameters
    ----------
    kind : class of a record or of a result
    source
        An object of the core, whose attributes are the fields that `values` lacks. An optional field is left out where
        the attribute is None.
    values
        Values of fields. A record inside is given as its document, or as an object of the core. Complex numbers need
        not be pairs.

    Raises
    ------
    TypeError
        A name is not a field of the class, or of the class of a record inside; or a required field is neither among the
        values nor an attribute of the object.
    """
    document: Document = {}
    for field in kind.schema:
        if field.name in values:
            document[field.name] = _stored(field, values.pop(field.name))
        elif field.optional and getattr(source, field.name, None) is None:
            continue
        elif hasattr(source, field.name):
            document[field.name] = _stored(field, getattr(source, field.name))
        else:
            raise TypeError(f"a document of {kind.schema.name} lacks {field.name}")
    if values:
        raise TypeError(f"documents of {kind.schema.name} have no {', '.join(values)}")
    return ClassDocument(document)


def array_units(record: RecordSchema, document: Mapping[str, Any], units: str) -> dict[str, str]:
    """Return the units of the fields of a document, by their names as in npz; those without a unit are left out.

    `units` is "SI" or "nondimensional".
    """
    named: dict[str, str] = {}
    for field in record:
        value = document.get(field.name)
        if isinstance(field.type, RecordSchema) and value is not None:
            items = value if isinstance(value, list) else [value]
            for item in items:
                below = array_units(field.type, item, units)
                named |= {f"{field.name}.{name}": unit for name, unit in below.items()}
        elif value is not None and field.unit_in(units):
            named[field.name] = field.unit_in(units)
    return named


def meta_of_part(record: RecordSchema, document: Mapping[str, Any], meta: Mapping[str, Any], **own: Any) -> Document:
    """Return the meta of a result inside another one, `own` and the units of its fields, from the meta of the whole."""
    if "array_units" in meta:
        own["array_units"] = array_units(record, document, meta["units"])
    return {**meta, **own}


def _stored(field: Field, value: Any) -> Any:
    """Return the value of a field as documents have it."""
    if isinstance(field.type, RecordSchema) and value is not None:
        return [_record(field.type, item) for item in value] if field.dims else _record(field.type, value)
    if field.type == "complex" and np.iscomplexobj(value):
        return np.stack([value.real, value.imag], axis=-1)
    return value


def _record(record: RecordSchema, value: Any) -> Any:
    return document_of(record.kind, **value) if isinstance(value, Mapping) else document_of(record.kind, value)


def from_json(record: RecordSchema, document: Mapping[str, Any]) -> Document:
    """Return a document from its JSON, with arrays where the schema has them, and NaN for null in them.

    Fields that only JSON has are left out. Fields that the schema lacks, as a newer service may send, become arrays if
    they are lists of numbers.
    """
    left_out = {field.name for field in record.in_json} if isinstance(record, ResultSchema) else set()
    return {
        name: _value_from_json(_field(record, name), value) for name, value in document.items() if name not in left_out
    }


def _field(record: RecordSchema, name: str) -> Field | None:
    return next((field for field in record if field.name == name), None)


def _value_from_json(field: Field | None, value: Any) -> Any:
    if field is None:
        return _guessed(value)
    if isinstance(field.type, RequestDocument) or value is None:
        return value
    if isinstance(field.type, RecordSchema):
        record = field.type
        return [from_json(record, item) for item in value] if field.dims else from_json(record, value)
    if not field.dims or (field.is_tuple and field.type != "str"):
        return value
    if field.type == "str":
        return np.asarray(value, dtype=np.str_)
    return np.asarray(value, dtype=field.stored_dtype)


def _guessed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _guessed(item) for key, item in value.items()}
    if not isinstance(value, list):
        return value
    if value and isinstance(value[0], dict):
        return [_guessed(item) for item in value]
    array = np.asarray(value)
    return np.asarray(value, dtype=np.float64) if array.dtype == object else array
