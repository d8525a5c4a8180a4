"""The tables of results' fields in the guides are those of the schemas."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import re
from pathlib import Path
from typing import Any

import pytest

from grazemap import Client, local
from grazemap.client.process_methods import METHODS
from grazemap.results import SCHEMAS
from grazemap.wire import PROCESSES

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(scope="module")
def tables() -> Any:
    spec = importlib.util.spec_from_file_location("field_tables", DOCS / "field_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", ["api.md", "sdk.md", "operations.md"])
def test_the_tables_are_those_of_the_schemas(tables: Any, page: str) -> None:
    text = (DOCS / page).read_text("utf-8")
    assert tables.written(text) == text, "run `make tables`"
    stale = text.replace("first_recurrence", "last_recurrence").replace("GRAZEMAP_PORT` | 8000", "GRAZEMAP_PORT` | 80")
    assert stale != text
    assert tables.written(stale) != stale


def test_the_guide_has_the_fields_of_every_result() -> None:
    text = (DOCS / "api.md").read_text("utf-8")
    shown = set(re.findall(r"<!-- fields of (\w+) -->", text))
    # a list of trajectories has one field, which the text names
    assert {schema.name for schema in SCHEMAS} - {"Trajectories", "CodimensionTwoPoints"} <= shown


def test_the_guides_have_every_process_and_every_signature() -> None:
    """Of the client, of `local`, and of each method of a process: its parameters with their defaults."""
    methods = {name: getattr(Client, name) for name in METHODS}
    assert len(methods) == len(PROCESSES)
    guide = (DOCS / "sdk.md").read_text("utf-8")
    for name, function in {"Client": Client, "local": local, **methods}.items():
        expected = {
            parameter.name: parameter.default if parameter.default is not parameter.empty else ...
            for parameter in inspect.signature(function).parameters.values()
            if parameter.name != "self"
        }
        called = f"client.{name}" if name in methods else name
        shown = [
            _parameters(signature) for signature in re.findall(rf"^{called}(\(.*?\))$", guide, re.DOTALL | re.MULTILINE)
        ]
        assert expected in shown, name
    posted = re.findall(r"^\| `/v1/([\w-]+)` \|", (DOCS / "api.md").read_text("utf-8"), re.MULTILINE)
    assert posted == [*PROCESSES]


def _parameters(text: str) -> dict[str, object] | None:
    """The parameters of a signature with their defaults (...: none), or None if the text is a call."""
    try:
        function = ast.parse(f"def function{text}: pass").body[0]
    except SyntaxError:
        return None
    assert isinstance(function, ast.FunctionDef)
    arguments = function.args
    names = [argument.arg for argument in (*arguments.args, *arguments.kwonlyargs)]
    first = [None] * (len(arguments.args) - len(arguments.defaults))
    defaults = [*first, *arguments.defaults, *arguments.kw_defaults]
    return {
        name: ... if default is None else ast.literal_eval(default)
        for name, default in zip(names, defaults, strict=True)
    }
