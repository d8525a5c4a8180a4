"""The texts below the fields of a class, read from its source when they are needed.

pydantic's `use_attribute_docstrings` reads them when the class is made; for the models of all processes this was a
third of the time of the import.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise


def texts_below(cls: type) -> Mapping[str, str]:
    """Return the texts below the fields of a class and of its bases, by the names of the fields."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        texts |= _texts_of_module(base.__module__).get(base.__qualname__, {})
    return texts


@cache
def _texts_of_module(name: str) -> Mapping[str, Mapping[str, str]]:
    """Return the texts of all classes of a module, by class and field; none where the source is not at hand."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[name]))
    except (OSError, TypeError):
        return {}
    return {node.name: dict(_texts_of(node)) for node in tree.body if isinstance(node, ast.ClassDef)}


def _texts_of(node: ast.ClassDef) -> Iterator[tuple[str, str]]:
    for field, below in pairwise(node.body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                yield name, inspect.cleandoc(text)
