"""A decorator that adds the fields of a data class or a named tuple to its docstring.

The description of a field is the string below it in the source.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import partial
from inspect import cleandoc, getsource
from itertools import pairwise
from textwrap import dedent, indent
from typing import Any, TypeVar

C = TypeVar("C", bound=type)


class LazyAttribute:
    """A class attribute that is computed each time it is read."""

    def __init__(self, make: Callable[[Any], object]) -> None:
        self._make = make

    def __get__(self, instance: object, cls: type) -> object:
        return self._make(cls)


def described(cls: C) -> C:
    """Add the fields of a class to its docstring. The source is parsed, as Python keeps no strings below fields."""
    cls.__doc__ = LazyAttribute(partial(_with_fields, cls.__doc__ or ""))  # type: ignore[assignment]
    return cls


def _with_fields(docstring: str, cls: type) -> str:
    lines = [cleandoc(docstring), "", "Attributes", "----------"]
    try:
        (source,) = ast.parse(dedent(getsource(cls))).body
    except OSError:  # the program has no source files
        return lines[0]
    for field, following in pairwise(source.body):  # type: ignore[attr-defined]
        match field, following:
            case ast.AnnAssign(target=ast.Name(name), annotation=kind), ast.Expr(ast.Constant(str(text))):
                lines += [f"{name} : {ast.unparse(kind)}", indent(cleandoc(text), "    ")]
    return "\n".join(lines)
