"""Tuples with names and data classes whose help lists their fields.

A field is described by the string below it, where documents' generators look for it. Python does not keep these
strings: the docstring of a record reads them from the source, when somebody asks for it.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import textwrap
import types
import typing
from abc import ABCMeta
from itertools import pairwise
from typing import TYPE_CHECKING, Any

__all__ = ["ABC", "NamedTuple", "dataclass"]


class _Docstring:
    """The docstring of a record, with its fields."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __get__(self, record: object, cls: type) -> str:
        fields: dict[str, str] = {}
        for base in reversed(cls.__mro__):
            if isinstance(vars(base).get("__doc__"), _Docstring):
                fields |= _fields(base)
        listed = ["", "Attributes", "----------", *fields.values()] if fields else []
        return "\n".join([inspect.cleandoc(self._text), *listed])


def _fields(cls: type) -> dict[str, str]:
    """Return what the source of a class has of its fields, by their names; without a source nothing."""
    try:
        (source,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, TypeError):
        return {}
    fields = {}
    for field, below in pairwise([*source.body, ast.Pass()]):  # type: ignore[attr-defined]
        match field, below:
            case ast.AnnAssign(target=ast.Name(name), annotation=kind), ast.Expr(ast.Constant(str(text))):
                text = textwrap.indent(inspect.cleandoc(text), "    ")
                fields[name] = f"{name} : {ast.unparse(kind)}\n{text}"
    return fields


def _described(cls: type) -> type:
    """Give a class a docstring with its fields."""
    cls.__doc__ = _Docstring(cls.__doc__ or "")  # type: ignore[assignment]
    return cls


class _Tuples(type):
    """Turns a class that is derived from `NamedTuple` into one that is derived from `typing.NamedTuple`."""

    def __new__(cls, name: str, bases: tuple[type, ...], body: dict[str, Any]) -> type:
        if not bases:
            return super().__new__(cls, name, bases, body)
        return _described(types.new_class(name, (typing.NamedTuple,), exec_body=lambda space: space.update(body)))


class _Abstract(ABCMeta):
    """Has the docstrings of its classes where `type` has them, as `help` looks there; `ABCMeta` has its own."""

    __doc__ = vars(type)["__doc__"]


if TYPE_CHECKING:
    from abc import ABC
    from dataclasses import dataclass
    from typing import NamedTuple
else:

    class ABC(metaclass=_Abstract):
        """As `abc.ABC`."""

    class NamedTuple(metaclass=_Tuples):
        """As `typing.NamedTuple`."""

    def dataclass(cls=None, /, **options):
        """As `dataclasses.dataclass`."""
        if cls is None:
            return lambda cls: dataclass(cls, **options)
        return _described(dataclasses.dataclass(cls, **options))
