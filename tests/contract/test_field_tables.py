"""The tables of results' fields in the guides are those of the schemas."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

from grazemap.schema import SCHEMAS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def tables() -> Any:
    spec = importlib.util.spec_from_file_location("field_tables", DOCS / "field_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", ["api.md", "sdk.md"])
def test_the_tables_are_those_of_the_schemas(tables: Any, page: str) -> None:
    text = (DOCS / page).read_text("utf-8")
    assert tables.written(text) == text, "run `make tables`"
    stale = text.replace("first_recurrence", "last_recurrence")
    assert stale != text
    assert tables.written(stale) != stale


def test_the_guide_has_the_fields_of_every_result() -> None:
    text = (DOCS / "api.md").read_text("utf-8")
    shown = set(re.findall(r"<!-- fields of (\w+) -->", text))
    # a list of trajectories has one field, which the text names
    assert {schema.name for schema in SCHEMAS} - {"Trajectories", "CodimensionTwoPoints"} <= shown
