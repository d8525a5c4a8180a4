"""The base of the classes of records and results, which declare their fields once.

A field is an annotated attribute of a class, ``phase: FloatArray = field("Phase of the contact.", "omega", "rad")``.
Its name is that of the attribute. Whether it is a number, an array, a text, a record, or a list of those follows from
the annotation. The class behaves like a frozen dataclass, and `Record.schema` has its fields as plain data.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, replace
from functools import cache, partial
from inspect import Parameter, Signature, cleandoc, get_annotations
from textwrap import fill, indent
from types import FunctionType, GenericAlias, NoneType, UnionType
from typing import Any, ClassVar, TypeVar, cast, dataclass_transform, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from grazemap.described import LazyAttribute
from grazemap.results.fields import TYPES, Field, RecordSchema, RequestDocument, ResultSchema, Scalar

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
TextArray = NDArray[np.str_]
ComplexArray = NDArray[np.complex128]

_SCALARS: Mapping[Any, Scalar] = {kind: name for name, kind in TYPES.items()}
_ARRAYS: Mapping[Any, Scalar] = {
    FloatArray: "float",
    IntArray: "int",
    BoolArray: "bool",
    TextArray: "str",
    ComplexArray: "complex",
}

R = TypeVar("R", bound="Record")


class _Declared:
    """A field as it is declared, before it gets its name and its type from the class."""

    def __init__(self, source: str | _Declared | type[Record], default: object, changes: Mapping[str, Any]) -> None:
        self.default = default
        self._source, self._changes = source, changes

    def arguments(self, name: str) -> dict[str, Any]:
        """Return the arguments of `Field`; the annotation of the field may replace the type "float" later."""
        if isinstance(self._source, str):
            return {"name": name, "type": "float", "description": self._source, **self._changes}
        source = self._source
        copied = source.arguments(name) if isinstance(source, _Declared) else vars(source.schema[name])
        return {**copied, "name": name, **self._changes}


def field(
    source: str | type[Record] | Any,
    dims: str | None = None,
    unit: str | None = None,
    *,
    default: object = dataclasses.MISSING,
    **more: Any,
) -> Any:
    """Declare a field of a class.

    Parameters
    ----------
    source : str, class of a record, or field
        The description of the field, in one sentence. Or what to copy: the field of the same name of a class, for
        example `Common`, or a field that was declared outside of a class.
    dims : str
        The roles of its dimensions, separated by blanks.
    unit : str
        Unit in SI.
    default
        The value of the attribute where none is given. Without a default, a field that not every result has is None, or
        an empty tuple if it is a list of records.
    more
        Other arguments of `Field`, for example `type` for a field that has no annotation.
    """
    changes = {"dims": None if dims is None else tuple(dims.split()), "unit": unit}
    return _Declared(source, default, {name: value for name, value in changes.items() if value is not None} | more)


def stored(description: str, **more: Any) -> Any:
    """Declare a field of documents that objects of the class lack as an attribute, so it is not annotated."""
    return _Declared(description, dataclasses.MISSING, more | {"stored_only": True})


def _dataclass_fields(cls: type[Record]) -> dict[str, dataclasses.Field[Any]]:
    """Make a class a dataclass, and return its fields."""
    dataclasses.dataclass(init=False, repr=False, eq=False)(cls)
    fields: dict[str, dataclasses.Field[Any]] = vars(cls)["__dataclass_fields__"]
    return fields


def _signature(cls: type[Record]) -> Signature:
    """Return the signature of the constructor, in which a field without a default may follow one with a default.

    Python allows this only for keyword-only parameters, so that field and all later ones are keyword-only here. The
    constructor takes all by position too, in the order of `dataclasses.fields`.
    """
    parameters: list[Parameter] = []
    keyword_only = has_default = False
    for attribute in dataclasses.fields(cls) if cls is not Record else ():
        default = Parameter.empty if attribute.default is dataclasses.MISSING else attribute.default
        keyword_only |= has_default and default is Parameter.empty
        has_default |= default is not Parameter.empty
        kind = Parameter.KEYWORD_ONLY if keyword_only else Parameter.POSITIONAL_OR_KEYWORD
        parameters.append(Parameter(attribute.name, kind, default=default, annotation=attribute.type))
    return Signature(parameters, return_annotation=None)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field, dataclasses.field))
class Record:
    """Base of the classes of records and results, whose attributes are fields of documents.

    Attributes cannot be set. Two objects are equal if their attributes are equal; an object of a class with arrays or
    requests is equal only to itself. The service and the workers need only the schemas, and generating dozens of
    dataclasses takes a tenth of a second at import. So this base class has the methods that `dataclass` would generate
    for each class, and signature and docstring are made when they are read.
    """

    schema: ClassVar[RecordSchema]
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    __signature__: ClassVar[Any] = LazyAttribute(_signature)
    _comparable: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        annotations = get_annotations(cls)
        own = _own_fields(cls, annotations)
        inherited = [declared for base in cls.__bases__ if issubclass(base, Record) for declared in _fields_of(base)]
        fields = (*(declared for declared in inherited if declared.name not in own), *own.values())
        cls.schema = RecordSchema(cls.__name__, " ".join((cls.__doc__ or "").split()), fields, cls)
        cls.__dataclass_fields__ = LazyAttribute(_dataclass_fields)  # type: ignore[assignment]
        cls._comparable = "Any" not in annotations.values() and all(map(_is_comparable, fields))
        cls.__doc__ = LazyAttribute(partial(_with_attributes, cls.__doc__ or ""))  # type: ignore[assignment]

    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        fields = dataclasses.fields(self)
        if len(arguments) > len(fields):
            raise TypeError(f"{type(self).__name__}() takes {len(fields)} values, not {len(arguments)}")
        values = {attribute.name: value for attribute, value in zip(fields, arguments, strict=False)}
        for attribute in fields[len(arguments) :]:
            values[attribute.name] = keywords.pop(attribute.name, attribute.default)
            if values[attribute.name] is dataclasses.MISSING:
                raise TypeError(f"{type(self).__name__}() lacks {attribute.name}")
        if keywords:
            name = next(iter(keywords))
            raise TypeError(f"{type(self).__name__}() {'has two values of' if name in values else 'has no'} {name}")
        vars(self).update(values)

    def __setattr__(self, name: str, value: object) -> None:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> None:
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def __eq__(self, other: object) -> bool:
        if not self._comparable or type(self) is not type(other):
            return NotImplemented
        return self._compared() == other._compared()

    def __hash__(self) -> int:
        return hash(self._compared()) if self._comparable else object.__hash__(self)

    def __repr__(self) -> str:
        shown = (
            f"{attribute.name}={getattr(self, attribute.name)!r}"
            for attribute in dataclasses.fields(self)
            if attribute.repr
        )
        return f"{type(self).__qualname__}({', '.join(shown)})"

    def _compared(self) -> tuple[Any, ...]:
        return tuple(getattr(self, attribute.name) for attribute in dataclasses.fields(self) if attribute.compare)


def changed(record: R, **changes: Any) -> R:
    """Return a record or a result with some attributes changed."""
    # type checkers accept `replace` only for classes with the decorator `dataclass`
    return cast("R", replace(cast("Any", record), **changes))


def _fields_of(cls: type[Record]) -> tuple[Field, ...]:
    return cls.schema.fields if cls is not Record else ()


def _own_fields(cls: type[Record], annotations: Mapping[str, Any]) -> dict[str, Field]:
    """Return the fields that a class declares, by name; replace each of them in the class by its default, if any."""
    fields: dict[str, Field] = {}
    for name, value in list(vars(cls).items()):
        if not isinstance(value, _Declared):
            continue
        delattr(cls, name)
        arguments = value.arguments(name)
        if not arguments.get("stored_only"):
            arguments = _typed(arguments, _evaluated(annotations[name], cls.__module__), cls)
        fields[name] = declared = Field(**arguments)
        if value.default is not dataclasses.MISSING:
            setattr(cls, name, value.default)
        elif declared.optional and not declared.stored_only:
            setattr(cls, name, () if isinstance(declared.type, RecordSchema) and declared.dims else None)
    return fields


def named_field(name: str, declared: Any) -> Field:
    """Return a field that was declared outside of a class, with a name."""
    return Field(**declared.arguments(name))


def _evaluated(annotation: Any, module: str) -> Any:
    return _evaluated_text(annotation, module) if isinstance(annotation, str) else annotation


@cache
def _evaluated_text(annotation: str, module: str) -> Any:
    return eval(annotation, vars(sys.modules[module]))


def _typed(arguments: Mapping[str, Any], annotation: Any, cls: type[Record]) -> dict[str, Any]:
    """Return the arguments of a field, with the type of its annotation unless that is `Any` or they have a schema.

    Raises TypeError where a field with dimensions is no array and no list, or the reverse.
    """
    kinds = [kind for kind in get_args(annotation) if kind is not NoneType]
    nullable = isinstance(annotation, UnionType)
    kind = kinds[0] if nullable else annotation
    listed = isinstance(kind, GenericAlias) and get_origin(kind) is tuple
    item = get_args(kind)[0] if listed else kind
    null = arguments.get("null", False) or (nullable and not arguments.get("when"))
    if item is Any or isinstance(arguments["type"], RecordSchema | RequestDocument):
        return {**arguments, "null": null}
    is_record = isinstance(item, type) and issubclass(item, Record)
    field_type = item.schema if is_record else (_ARRAYS if item in _ARRAYS else _SCALARS)[item]
    if bool(arguments.get("dims")) is not (listed or item in _ARRAYS):
        raise TypeError(f"{cls.__name__}.{arguments['name']}: arrays and lists have dimensions, and nothing else has")
    return {**arguments, "type": field_type, "null": null, "is_tuple": listed and not is_record}


def _is_comparable(declared: Field) -> bool:
    if isinstance(declared.type, RecordSchema):
        return bool(getattr(declared.type.kind, "_comparable", False))
    return isinstance(declared.type, str) and (not declared.dims or declared.is_tuple)


def _with_attributes(docstring: str, cls: type[Record]) -> str:
    """Return a docstring with a section of the fields; for a result, the properties and the methods are listed too."""
    if not cls.schema.fields:
        return cleandoc(docstring)
    summary, _, rest = cleandoc(docstring).partition("\n")
    parts = [summary, *(["", rest.strip()] if rest.strip() else []), "", "Attributes", "----------"]
    is_result = isinstance(cls.schema, ResultSchema)
    roles = cls.schema.roles if isinstance(cls.schema, ResultSchema) else {}
    for declared in cls.schema:
        if not declared.stored_only:
            parts += [f"{declared.name} : {_type(declared, roles)}", indent(fill(_text(declared), 108), "    ")]
    if is_result:
        parts += [*_members(cls, property), "", "Methods", "-------", *_members(cls, FunctionType)]
    return "\n".join(parts) + "\n"


def _members(cls: type, kind: type) -> list[str]:
    """Return two lines for each public property (or method) of a class: its name, and its docstring's first line."""
    members = {name: value for base in reversed(cls.__mro__[:-1]) for name, value in vars(base).items()}
    lines = []
    for name, value in sorted(members.items()):
        text = cleandoc(value.__doc__ or "").partition("\n")[0] if isinstance(value, kind) else ""
        # `derived` and `derived_tables` serve Datasets and tables, not users
        if text and not name.startswith(("_", "derived")):
            lines += [name if kind is property else f"{name}()", f"    {text}"]
    return lines


def _type(declared: Field, roles: Mapping[str, str]) -> str:
    name = declared.type.kind.__name__ if isinstance(declared.type, RecordSchema) else str(declared.type)
    name = "dict" if isinstance(declared.type, RequestDocument) else name
    if declared.dims:
        listed = declared.is_tuple or isinstance(declared.type, RecordSchema)
        dims = [roles.get(role, role) for role in declared.dims]
        shape = f"({', '.join(dims)}{',' * (len(dims) == 1)})"
        name = f"tuple of {name}" if listed else f"ndarray of {name}, shape {shape}"
    return (
        f"{name}, or None" if declared.optional or (declared.null and not declared.dims and name != "float") else name
    )


def _text(declared: Field) -> str:
    when = f" Only {declared.when}." if declared.when else ""
    index = f" Position in `{declared.index_of}`." if declared.index_of else ""
    return declared.description + index + declared.unit_sentence + when
