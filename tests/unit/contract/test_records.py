"""Every field of a tuple or data class is described once, by the string below it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[3]
LEFT_OUT = re.compile(
    r"sdk/grazemap/(client/events|results/(base|record|structures|unfolding|unfolding_diagram)|checker/__init__)\.py"
)
"""Users read the help of these classes of the SDK, which knows their docstrings alone."""


def is_record(node: ast.ClassDef) -> bool:
    """Whether a class is a tuple with names or a data class."""
    marks = [mark.func if isinstance(mark, ast.Call) else mark for mark in (*node.bases, *node.decorator_list)]
    return any(ast.unparse(mark).rpartition(".")[2] in ("NamedTuple", "dataclass") for mark in marks)


def faults(source: str) -> Iterator[str]:
    """Yield the fields without a text below them, and those that the docstring of their class describes, too."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ClassDef):
            continue
        _, _, section = (ast.get_docstring(node) or "").partition("Attributes\n----------\n")
        listed = {name for line in re.findall(r"^(\w[\w, ]*) :", section, re.MULTILINE) for name in line.split(", ")}
        for field, below in pairwise([*node.body, ast.Pass()]):
            match field, below:
                case ast.AnnAssign(target=ast.Name(name)), _ if name in listed:
                    yield f"{node.name}.{name} is described twice"
                case ast.AnnAssign(), ast.Expr(ast.Constant(str())):
                    pass
                case ast.AnnAssign(target=ast.Name(name)), _ if is_record(node):
                    yield f"{node.name}.{name} is not described"


def test_every_field_of_a_record_is_described_once():
    faults_by_path = {
        path.relative_to(ROOT).as_posix(): wrong
        for folder in ("core", "worker", "service", "sdk")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if not LEFT_OUT.search(path.as_posix()) and (wrong := list(faults(path.read_text("utf-8"))))
    }
    assert faults_by_path == {}


def test_planted_faults_are_found():
    good = 'class A(NamedTuple):\n    """An a."""\n\n    x: int\n    """The x."""\n'
    assert list(faults(good)) == []
    assert list(faults(good + "    y: int\n")) == ["A.y is not described"]
    assert list(faults("@dataclasses.dataclass(frozen=True)\nclass B:\n    x: int = 1\n")) == ["B.x is not described"]
    twice = good.replace('An a."""', 'An a.\n\n    Attributes\n    ----------\n    w, x : int\n        The x.\n    """')
    assert list(faults(twice)) == ["A.x is described twice"]
