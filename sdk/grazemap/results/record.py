"""The base of the classes of records and results, which declare their fields once.

A field is an annotated attribute of a class, ``phase: FloatArray = field("Phase of the contact.", "omega", "rad")``.
Its name is that of the attribute. Whether it is a number, an array, a text, a record, or a list of those follows from
the annotation. The class is a frozen dataclass, and `Record.schema` has its fields as plain data.
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

from grazemap.described import Made
from grazemap.results.fields import TYPES, Field, RecordSchema, Request, ResultSchema, Scalar

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
    """A field before it has the name and the type of an attribute."""

    def __init__(self, of: str | _Declared | type[Record], default: object, changes: Mapping[str, Any]) -> None:
        self.default = default
        self._of, self._changes = of, changes

    def attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of the field, with the type "float" unless that is known."""
        if isinstance(self._of, str):
            return {"name": name, "type": "float", "description": self._of, **self._changes}
        known = self._of.attributes(name) if isinstance(self._of, _Declared) else vars(self._of.schema[name])
        return {**known, "name": name, **self._changes}


class _Deprecated:
    """A field that is the deprecated name of another one."""

    def __init__(self, of: str) -> None:
        self.of = of

    def named(self, name: str, fields: Mapping[str, Field]) -> Field:
        """Return the field, from those that the class has declared."""
        text = f"Deprecated: another name of `{self.of}`."
        return replace(fields[self.of], name=name, description=text, replaces=self.of, variable=None)


def field(
    of: str | type[Record] | Any,
    dims: str | None = None,
    unit: str | None = None,
    *,
    default: object = dataclasses.MISSING,
    **more: Any,
) -> Any:
    """Declare a field of a class.

    Parameters
    ----------
    of : str, class of a record, or field
        What it is, in one sentence; or the field that it resembles: that of its name in another class, or one that was
        declared by itself.
    dims : str
        The roles of its dimensions, separated by blanks.
    unit : str
        Unit in SI.
    default
        What the attribute is where it is left out. Without it, those that not every result has are None, or an empty
        list.
    more
        Other attributes of `Field`. `type` replaces that of the annotation.
    """
    given = {"dims": None if dims is None else tuple(dims.split()), "unit": unit}
    return _Declared(of, default, {name: value for name, value in given.items() if value is not None} | more)


def stored(of: str, **more: Any) -> Any:
    """Declare a field that is in documents only, and no attribute of the class; it is not annotated."""
    return _Declared(of, dataclasses.MISSING, more | {"stored_only": True})


def deprecated(of: str) -> Any:
    """Declare the deprecated name of a field above; it is in documents only, and not annotated."""
    return _Deprecated(of)


def _dataclass_fields(cls: type[Record]) -> dict[str, dataclasses.Field[Any]]:
    """Make a class a dataclass, and return its fields."""
    dataclasses.dataclass(init=False, repr=False, eq=False)(cls)
    fields: dict[str, dataclasses.Field[Any]] = vars(cls)["__dataclass_fields__"]
    return fields


def _signature(cls: type[Record]) -> Signature:
    """Return how objects are made: what follows a default is shown as keyword-only."""
    parameters: list[Parameter] = []
    late = False
    for one in dataclasses.fields(cls) if cls is not Record else ():
        default = Parameter.empty if one.default is dataclasses.MISSING else one.default
        late |= default is Parameter.empty and any(other.default is not default for other in parameters)
        kind = Parameter.KEYWORD_ONLY if late else Parameter.POSITIONAL_OR_KEYWORD
        parameters.append(Parameter(one.name, kind, default=default, annotation=one.type))
    return Signature(parameters, return_annotation=None)


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field, dataclasses.field))
class Record:
    """Base of the classes of records and results: dataclasses whose attributes are fields of documents.

    Attributes cannot be set. Objects are equal if their attributes are, unless the class has arrays or requests. The
    service and the workers need the schemas alone: all else of a class is here, or is made when it is read, as dozens
    of whole dataclasses would take a tenth of a second to import.
    """

    schema: ClassVar[RecordSchema]
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]
    __signature__: ClassVar[Any] = Made(_signature)
    _comparable: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        annotations = get_annotations(cls)
        own = _own_fields(cls, annotations)
        inherited = [one for base in cls.__bases__ if issubclass(base, Record) for one in _fields_of(base)]
        fields = (*(one for one in inherited if one.name not in own), *own.values())
        cls.schema = RecordSchema(cls.__name__, " ".join((cls.__doc__ or "").split()), fields, cls)
        cls.__dataclass_fields__ = Made(_dataclass_fields)  # type: ignore[assignment]
        cls._comparable = "Any" not in annotations.values() and all(_comparable(one) for one in fields)
        cls.__doc__ = Made(partial(_with_attributes, cls.__doc__ or ""))  # type: ignore[assignment]

    def __init__(self, *given: Any, **named: Any) -> None:
        fields = dataclasses.fields(self)
        if len(given) > len(fields):
            raise TypeError(f"{type(self).__name__}() takes {len(fields)} values, not {len(given)}")
        values = {one.name: value for one, value in zip(fields, given, strict=False)}
        for one in fields[len(given) :]:
            values[one.name] = named.pop(one.name, one.default)
            if values[one.name] is dataclasses.MISSING:
                raise TypeError(f"{type(self).__name__}() lacks {one.name}")
        if named:
            raise TypeError(f"{type(self).__name__}() has no {', '.join(named)}, or it is given twice")
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
        shown = (f"{one.name}={getattr(self, one.name)!r}" for one in dataclasses.fields(self) if one.repr)
        return f"{type(self).__qualname__}({', '.join(shown)})"

    def _compared(self) -> tuple[Any, ...]:
        return tuple(getattr(self, one.name) for one in dataclasses.fields(self) if one.compare)


def changed(record: R, **changes: Any) -> R:
    """Return a record or a result with some attributes changed."""
    # type checkers know `replace` for classes that are decorated as dataclasses alone
    return cast("R", replace(cast("Any", record), **changes))


def _fields_of(cls: type[Record]) -> tuple[Field, ...]:
    return cls.schema.fields if cls is not Record else ()


def _own_fields(cls: type[Record], annotations: Mapping[str, Any]) -> dict[str, Field]:
    """Return the fields that a class declares, by name, and leave their defaults in the class, where they have one."""
    fields: dict[str, Field] = {}
    for name, value in list(vars(cls).items()):
        if not isinstance(value, _Declared | _Deprecated):
            continue
        delattr(cls, name)
        if isinstance(value, _Deprecated):
            fields[name] = value.named(name, fields)
            continue
        given = value.attributes(name)
        if not given.get("stored_only"):
            given = _typed(given, _evaluated(annotations[name], cls.__module__), cls)
        fields[name] = one = Field(**given)
        if value.default is not dataclasses.MISSING:
            setattr(cls, name, value.default)
        elif one.optional and not one.stored_only:
            setattr(cls, name, () if isinstance(one.type, RecordSchema) and one.dims else None)
    return fields


def named(name: str, declared: Any) -> Field:
    """Return a field that was declared by itself, with its name."""
    return Field(**declared.attributes(name))


def _evaluated(annotation: Any, module: str) -> Any:
    return _of_text(annotation, module) if isinstance(annotation, str) else annotation


@cache
def _of_text(annotation: str, module: str) -> Any:
    return eval(annotation, vars(sys.modules[module]))


def _typed(given: Mapping[str, Any], annotation: Any, cls: type[Record]) -> dict[str, Any]:
    """Return the attributes of a field with the type of its annotation.

    Raises TypeError where its dimensions do not go with that type.
    """
    without = [kind for kind in get_args(annotation) if kind is not NoneType]
    nullable = isinstance(annotation, UnionType)
    kind = without[0] if nullable else annotation
    listed = isinstance(kind, GenericAlias) and get_origin(kind) is tuple
    item = get_args(kind)[0] if listed else kind
    null = given.get("null", False) or (nullable and not given.get("when"))
    if item is Any or isinstance(given["type"], RecordSchema | Request):
        return {**given, "null": null}
    is_record = isinstance(item, type) and issubclass(item, Record)
    of = item.schema if is_record else (_ARRAYS if item in _ARRAYS else _SCALARS)[item]
    if bool(given.get("dims")) is not (listed or item in _ARRAYS):
        raise TypeError(f"{cls.__name__}.{given['name']}: arrays and lists have dimensions, and nothing else has")
    return {**given, "type": of, "null": null, "texts": listed and not is_record}


def _comparable(one: Field) -> bool:
    if isinstance(one.type, RecordSchema):
        return bool(getattr(one.type.kind, "_comparable", False))
    return isinstance(one.type, str) and (not one.dims or one.texts)


def _with_attributes(docstring: str, cls: type[Record]) -> str:
    """Return the docstring with the section Attributes, and for a result its properties there and its methods."""
    if not cls.schema.fields:
        return cleandoc(docstring)
    summary, _, rest = cleandoc(docstring).partition("\n")
    parts = [summary, "", "Attributes", "----------"]
    is_result = isinstance(cls.schema, ResultSchema)
    roles = cls.schema.roles if isinstance(cls.schema, ResultSchema) else {}
    for one in cls.schema:
        if not one.replaces and not one.stored_only:
            parts += [f"{one.name} : {_type(one, roles)}", indent(fill(_text(one), 108), "    ")]
    if is_result:
        parts += [*_members(cls, property), "", "Methods", "-------", *_members(cls, FunctionType)]
    return "\n".join(parts) + (f"\n\n{rest.strip()}\n" if rest.strip() else "\n")


def _members(cls: type, kind: type) -> list[str]:
    """Return the lines that say in one sentence what each public property, or method, of a class returns."""
    members = {name: value for base in reversed(cls.__mro__[:-1]) for name, value in vars(base).items()}
    lines = []
    for name, value in sorted(members.items()):
        text = cleandoc(value.__doc__ or "").partition("\n")[0] if isinstance(value, kind) else ""
        if text and not name.startswith(("_", "derived")):
            lines += [name if kind is property else f"{name}()", f"    {text}"]
    return lines


def _type(one: Field, roles: Mapping[str, str]) -> str:
    name = one.type.kind.__name__ if isinstance(one.type, RecordSchema) else str(one.type)
    name = "dict" if isinstance(one.type, Request) else name
    if one.dims:
        listed = one.texts or isinstance(one.type, RecordSchema)
        dims = [roles.get(role, role) for role in one.dims]
        shape = f"({', '.join(dims)}{',' * (len(dims) == 1)})"
        name = f"tuple of {name}" if listed else f"ndarray of {name}, shape {shape}"
    return f"{name}, or None" if one.optional or (one.null and not one.dims and name != "float") else name


def _text(one: Field) -> str:
    always = one.unit_in("nondimensional") == one.unit
    unit = f" Unit: {one.unit}{'' if always else ' in SI'}." if one.unit else ""
    when = f" Only {one.when}." if one.when else ""
    index = f" Position in `{one.index_of}`." if one.index_of else ""
    return one.description + index + unit + when
