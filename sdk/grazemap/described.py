"""Data classes and tuples with names whose help lists their fields, each described by the string below it."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import partial
from inspect import cleandoc, getsource
from itertools import pairwise
from textwrap import dedent, indent
from typing import Any, TypeVar

C = TypeVar("C", bound=type)


class Made:
    """An attribute of a class that is made when it is read."""

    def __init__(self, make: Callable[[Any], object]) -> None:
        self._make = make

    def __get__(self, instance: object, cls: type) -> object:
        return self._make(cls)


def described(cls: C) -> C:
    """Add the fields of a class to its docstring: Python keeps no strings below fields, so its source is read."""
    cls.__doc__ = Made(partial(_with_fields, cls.__doc__ or ""))  # type: ignore[assignment]
    return cls


def _with_fields(docstring: str, cls: type) -> str:
    lines = [cleandoc(docstring), "", "Attributes", "----------"]
    try:
        (source,) = ast.parse(dedent(getsource(cls))).body
    except OSError:  # of a program without its source
        return lines[0]
    for field, below in pairwise(source.body):  # type: ignore[attr-defined]
        match field, below:
            case ast.AnnAssign(target=ast.Name(name), annotation=kind), ast.Expr(ast.Constant(str(text))):
                lines += [f"{name} : {ast.unparse(kind)}", indent(cleandoc(text), "    ")]
    return "\n".join(lines)
