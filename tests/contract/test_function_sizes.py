"""No function of the core is longer than 60 lines or takes more than 8 arguments, but for those named here.

The checker of certificates, which has to be read to be believed, has fewer than 430 lines of code.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MAX_LINES = 60
MAX_ARGUMENTS = 8
MAX_OF_CHECKER = 1050
KEYWORDS = "public, called by hand: settings are keyword arguments with defaults, as in scipy.integrate.solve_ivp"
MORE_ARGUMENTS = {
    "simulation.monodromy.monodromy": (9, KEYWORDS),
    "simulation.trajectories.trajectory": (12, KEYWORDS),
    "simulation.trajectories.trajectories": (10, KEYWORDS + "; those of `trajectory`"),
    "maps.basins.basin_tile": (10, KEYWORDS),
    "maps.unfolding.unfolding_map_tile": (9, KEYWORDS),
    "maps.chaotic_transients.chance_in_basins": (11, KEYWORDS + "; those of `basin_tile`"),
}
"""By function: the number of its arguments, and why it may have so many."""


def functions(source: str, prefix: str) -> Iterator[tuple[str, int, int]]:
    """Yield qualified name, lines of code and arguments of every function, those in classes and functions included.

    Lines count from ``def`` to the end, without the docstring, blank lines and comments; ``self`` does not count.
    """

    def inside(node: ast.AST, name: str) -> Iterator[tuple[str, int, int]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{name}.{child.name}", _lines(child, source), _arguments(child, isinstance(node, ast.ClassDef))
            named = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            yield from inside(child, f"{name}.{child.name}" if named else name)

    yield from inside(ast.parse(source), prefix)


def _lines(function: ast.FunctionDef | ast.AsyncFunctionDef, source: str) -> int:
    text = source.splitlines()
    numbers = set(range(function.lineno, (function.end_lineno or 0) + 1))
    if ast.get_docstring(function) is not None:
        numbers -= set(range(function.body[0].lineno, (function.body[0].end_lineno or 0) + 1))
    return sum(bool(text[number - 1].strip()) and not text[number - 1].strip().startswith("#") for number in numbers)


def _arguments(function: ast.FunctionDef | ast.AsyncFunctionDef, method: bool) -> int:
    every = function.args
    static = any(isinstance(one, ast.Name) and one.id == "staticmethod" for one in function.decorator_list)
    bound = method and not static
    return len(every.posonlyargs + every.args + every.kwonlyargs) + bool(every.vararg) + bool(every.kwarg) - bound


@pytest.fixture(scope="module")
def core() -> list[tuple[str, int, int]]:
    package = ROOT / "core" / "grazemap_core"
    found = []
    for path in sorted(package.rglob("*.py")):
        module = ".".join(path.relative_to(package).with_suffix("").parts)
        found += functions(path.read_text(), module)
    assert len(found) > 500
    return found


def too_long(found: list[tuple[str, int, int]]) -> list[tuple[str, int]]:
    return [(name, lines) for name, lines, _ in found if lines > MAX_LINES]


def too_many_arguments(found: list[tuple[str, int, int]]) -> dict[str, int]:
    return {name: arguments for name, _, arguments in found if arguments > MAX_ARGUMENTS}


def test_no_function_of_the_core_is_too_long(core):
    assert too_long(core) == []


def test_no_function_of_the_core_takes_too_many_arguments(core):
    assert too_many_arguments(core) == {name: arguments for name, (arguments, _) in MORE_ARGUMENTS.items()}


def code_lines(source: str) -> int:
    """Return the number of lines without docstrings, blank lines and comments."""
    texts = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Expr))
    strings = {
        number
        for node in texts
        if isinstance(node.value, ast.Constant)
        for number in range(node.lineno, (node.end_lineno or 0) + 1)
    }
    lines = enumerate(source.splitlines(), 1)
    return sum(bool(text.strip()) and text.strip()[0] != "#" and number not in strings for number, text in lines)


def test_the_checker_is_small():
    modules = sorted((ROOT / "sdk" / "grazemap" / "checker").glob("*.py"))
    assert len(modules) >= 5
    assert sum(code_lines(path.read_text()) for path in modules) < MAX_OF_CHECKER
    assert code_lines('"""a"""\n\nx = 1  # b\n# c\ndef f():\n    """d\n\n    e\n    """\n    return 2\n') == 3


def test_planted_functions_are_found():
    names = ", ".join("abcdefghi")
    long, wide = "def long():\n" + "    pass\n" * 60, f"def wide({names}):\n    pass\n"
    short, narrow = "def short():\n" + "    pass\n" * 59, f"def narrow(self, {names[:-3]}):\n    pass\n"
    assert too_long(list(functions(long + short, "m"))) == [("m.long", 61)]
    classes = "class A:\n" + "".join(f"    {line}\n" for line in narrow.splitlines())
    assert too_many_arguments(list(functions(wide + classes, "m"))) == {"m.wide": 9}


def test_lines_and_arguments_are_counted_as_documented():
    """Decorators, docstring, blank lines and comments do not, nor does self; nested functions count in both."""
    source = '''
class Pair:
    @property
    def first(self, a, *, b=1, **c):
        """Return it.

        At length.
        """
        # a comment

        def inner(x, /, y, *z):
            return x

        return inner(
            a,
        )

    @staticmethod
    def second(a):
        pass
'''
    assert list(functions(source, "m")) == [
        ("m.Pair.first", 6, 3),
        ("m.Pair.first.inner", 2, 3),
        ("m.Pair.second", 2, 1),
    ]
