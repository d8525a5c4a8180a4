"""The tables of results' fields in the guides are those of the schemas."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

from grazemap import Client, local
from grazemap.client.process_methods import METHODS
from grazemap.results import SCHEMAS
from grazemap.results.tables import tables as tables_of
from grazemap.wire import PROCESSES
from tests.support.sdk_documents import REQUESTS, result_of
from tools.guide import tables


@pytest.mark.parametrize("page", tables.pages(), ids=lambda page: page.name)
def test_the_tables_are_those_of_the_schemas(page: Path) -> None:
    text = page.read_text("utf-8")
    assert tables.written(text) == text, "run `make tables`"


@pytest.mark.parametrize("sample", REQUESTS)
def test_the_client_s_page_has_every_table_of_a_result(sample: str) -> None:
    result = result_of(sample)
    (row,) = re.findall(
        rf"^\| \[`{type(result).__name__}`\].*", (tables.DOCS / "sdk.md").read_text("utf-8"), re.MULTILINE
    )
    assert set(tables_of(result)) <= set(re.findall(r"`(\w+)`", row.split("|")[2]))


def test_a_stale_table_is_noticed() -> None:
    text = (tables.REFERENCE / "grazing-curves.md").read_text("utf-8")
    stale = text.replace("first_recurrence", "last_recurrence")
    assert stale != text
    assert tables.written(stale) == text


@pytest.mark.parametrize("process", PROCESSES)
def test_a_new_process_gets_a_page(process: str) -> None:
    page = tables.written(tables.new_page(process))
    assert all(f"| `{name}` |" in page for name in PROCESSES[process].model_fields)


@pytest.mark.parametrize("process", PROCESSES)
def test_the_page_of_a_process_shows_a_request_as_one_posts_it(process: str) -> None:
    page = tables.REFERENCE / f"{process}.md"
    for text in (page.read_text("utf-8"), tables.written(tables.new_page(process))):
        assert tables.requests_in(text.partition("\n## ")[0], process)


def test_the_guide_has_the_fields_of_every_result() -> None:
    text = "".join(page.read_text("utf-8") for page in tables.pages())
    shown = set(re.findall(r"<!-- fields of (\w+) -->", text))
    # a list of trajectories has one field, which the text names
    assert {schema.name for schema in SCHEMAS} - {"Trajectories", "CodimensionTwoPoints"} <= shown


def test_the_guides_have_every_process_and_every_signature() -> None:
    """Of the client, of `local`, and of each method of a process: its parameters with their defaults."""
    methods = {name: getattr(Client, name) for name in METHODS}
    assert len(methods) == len(PROCESSES)
    guide = (tables.DOCS / "sdk.md").read_text("utf-8")
    guide += "".join((tables.REFERENCE / f"{process}.md").read_text("utf-8") for process in PROCESSES)
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
    posted = re.findall(r"^\| `/v1/([\w-]+)` \|", (tables.REFERENCE / "http.md").read_text("utf-8"), re.MULTILINE)
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
