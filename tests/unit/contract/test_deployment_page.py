"""The deployment page: its blocks are well formed, and name settings, modules and variables that exist."""

from __future__ import annotations

import importlib.util
import re
from configparser import RawConfigParser
from pathlib import Path
from typing import Any

import pytest
import yaml

from grazemap_service.settings_list import settings
from tests.support.narrow import SETTINGS
from tools.release_check import relative_links

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "deployment.md").read_text("utf-8")
VARIABLES = {setting.variable: setting for setting in settings()}


def block(kind: str) -> str:
    """The last block of a kind."""
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)[-1]


CONTAINERS: list[dict[str, Any]] = [
    manifest["spec"]["template"]["spec"]["containers"][0] for manifest in yaml.safe_load_all(block("yaml"))
]


def test_every_variable_is_a_setting_or_one_of_clients() -> None:
    named = set(re.findall(r"\bGRAZEMAP_\w+", PAGE))
    assert "GRAZEMAP_WORKERS" in named
    assert named - {*VARIABLES} == {"GRAZEMAP_API_KEY"}


@pytest.mark.parametrize(("container", "process"), [*zip(CONTAINERS, ("service", "worker"), strict=True)])
def test_a_container_runs_a_module_with_its_own_settings(container: dict[str, Any], process: str) -> None:
    assert importlib.util.find_spec(container["command"][2])
    assert {VARIABLES[entry["name"]].readers for entry in container["env"]} <= {"both", process}
    for probe in (value for key, value in container.items() if key.endswith("Probe")):
        assert "exec" not in probe or importlib.util.find_spec(probe["exec"]["command"][2])


def test_the_unit_has_its_sections_and_stops_the_stack_in_order() -> None:
    parser = RawConfigParser(strict=False)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(block("ini"))
    assert parser.sections() == ["Unit", "Service", "Install"]
    assert parser["Service"]["KillMode"] == "mixed"
    assert parser["Service"]["StateDirectory"] == Path(parser["Service"]["ExecStart"].split()[-1]).name


def test_the_variables_for_one_kind_of_processors_are_those_of_the_recorded_digests() -> None:
    chosen = dict(line.split("=", 1) for line in block("bash").splitlines())
    assert chosen.items() <= SETTINGS.items()
    assert set(SETTINGS) - set(chosen) == {"OPENBLAS_NUM_THREADS"}  # which workers set themselves


def test_links_lead_to_files_and_headings() -> None:
    for address in relative_links(PAGE):
        path, _, heading = address.partition("#")
        text = (DOCS / path).read_text("utf-8")
        headings = re.findall(r"^#+ (.*)", text, re.MULTILINE)
        assert not heading or heading in {re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in headings}
