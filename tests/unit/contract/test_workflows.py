"""The workflows: actions are pinned, few rights are given, and a tag is published only after the release check."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from tools.first_start import PYTHONS

FOLDER = Path(__file__).parents[3] / ".github/workflows"
NAMES = ("ci.yml", "release.yml")


def read(name: str) -> dict[str, Any]:
    workflow: dict[str, Any] = yaml.safe_load((FOLDER / name).read_text("utf-8"))
    return workflow


@pytest.mark.parametrize("name", NAMES)
def test_actions_are_pinned_by_commit_with_their_full_version(name: str) -> None:
    used = re.findall(r"uses: (.*)", (FOLDER / name).read_text("utf-8"))
    assert used
    assert not [text for text in used if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", text)]


@pytest.mark.parametrize("name", NAMES)
def test_a_workflow_may_only_read_but_where_it_publishes(name: str) -> None:
    workflow = read(name)
    assert workflow["permissions"] == {"contents": "read"}
    rights = {job: steps["permissions"] for job, steps in workflow["jobs"].items() if "permissions" in steps}
    assert rights == (
        {"publish": {"id-token": "write"}, "release": {"contents": "write"}} if name == "release.yml" else {}
    )


def test_a_tag_is_published_after_the_release_check_and_released_after_that() -> None:
    jobs = read("release.yml")["jobs"]
    assert jobs["publish"]["needs"] == "build"
    assert jobs["publish"]["environment"]
    assert jobs["release"]["needs"] == "publish"
    assert any("make release-check" in step.get("run", "") and "TAG=" in step["run"] for step in jobs["build"]["steps"])


def test_every_python_is_tested() -> None:
    (setup,) = (step for step in read("ci.yml")["jobs"]["ci"]["steps"] if "setup-python" in step.get("uses", ""))
    assert sorted(setup["with"]["python-version"].split()) == sorted(PYTHONS)
