"""The checker of certificates, which has to be read to be believed, stays small."""

from __future__ import annotations

import ast
from pathlib import Path

CHECKER = Path(__file__).parents[3] / "sdk" / "grazemap" / "checker"
MOST_LINES = 1050


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
    modules = sorted(CHECKER.glob("*.py"))
    assert len(modules) >= 5
    assert sum(code_lines(path.read_text("utf-8")) for path in modules) < MOST_LINES


def test_lines_of_code_are_counted_without_comments_and_docstrings():
    assert code_lines('"""a"""\n\nx = 1  # b\n# c\ndef f():\n    """d\n\n    e\n    """\n    return 2\n') == 3
