"""The relations for which schemathesis lets a request be refused are those for which the wire refuses one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

CHECKS = Path(__file__).parents[2] / "slow" / "described_requests_checks.py"
WIRE = Path(__file__).parents[3] / "sdk" / "grazemap" / "wire"


def texts(node: ast.expr) -> Iterator[str]:
    """The texts that an expression may be, with `x` for what they are filled in with."""
    if isinstance(node, ast.IfExp):
        yield from texts(node.body)
        yield from texts(node.orelse)
    elif isinstance(node, ast.JoinedStr):
        yield "".join(str(part.value) if isinstance(part, ast.Constant) else "x" for part in node.values)
    else:
        yield str(ast.literal_eval(node))


def reasons() -> set[str]:
    """The reasons of all calls of `invalid`, given there or as the variable `detail` of the function."""
    details: set[str] = set()
    for path in WIRE.glob("*.py"):
        for function in ast.walk(ast.parse(path.read_text("utf-8"))):
            if not isinstance(function, ast.FunctionDef):
                continue
            nodes = list(ast.walk(function))
            calls = [node for node in nodes if isinstance(node, ast.Call) and ast.unparse(node.func) == "invalid"]
            arguments = [call.args[0] for call in calls]
            if any(isinstance(argument, ast.Name) for argument in arguments):
                assigned = [node for node in nodes if isinstance(node, ast.Assign)]
                arguments += [node.value for node in assigned if ast.unparse(node.targets[0]) == "detail"]
            details.update(
                text for argument in arguments if not isinstance(argument, ast.Name) for text in texts(argument)
            )
    return details


def relations() -> tuple[str, ...]:
    """The patterns; their module is for an environment of its own."""
    for node in ast.parse(CHECKS.read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "RELATIONS":
            return tuple(ast.literal_eval(node.value))
    raise AssertionError


def test_every_reason_is_known_to_the_check_and_every_pattern_has_a_reason() -> None:
    patterns, details = relations(), reasons()
    assert len(details) > 80
    assert [text for text in sorted(details) if not re.fullmatch("|".join(patterns), text)] == []
    unused = [pattern for pattern in patterns if not any(re.fullmatch(pattern, text) for text in details)]
    assert unused == ["Input should be a valid integer"]  # that of the library
