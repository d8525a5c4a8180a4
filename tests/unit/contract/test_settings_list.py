"""Every setting is described, listed by `grazemap up --help`, and suggested for a name that is nearly its own."""

from __future__ import annotations

import subprocess
import sys
from difflib import get_close_matches

import pytest

from grazemap import cli
from grazemap_service.settings import ServiceSettings, StackSettings
from grazemap_service.settings_list import help_text, settings
from grazemap_worker import redis_settings
from grazemap_worker.redis_settings import refusal_text, unknown_variables
from grazemap_worker.settings import WorkerSettings

FIELDS = {*ServiceSettings.model_fields, *StackSettings.model_fields}
LISTED = [*settings()]


def test_every_setting_is_listed_once_with_its_meaning() -> None:
    assert sorted(setting.variable for setting in LISTED) == sorted(f"GRAZEMAP_{name.upper()}" for name in FIELDS)
    assert not [setting.variable for setting in LISTED if not setting.meaning]
    assert {setting.readers for setting in LISTED} == {"both", "service", "worker", "`grazemap up`"}


def test_the_help_of_the_stack_has_every_setting(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    with pytest.raises(SystemExit):
        cli.main(["up", "--help"])
    printed = capsys.readouterr().out
    assert not [setting.variable for setting in LISTED if f"  {setting.variable}" not in printed]
    assert max(map(len, help_text(58).splitlines())) <= 74  # a name with its default stays on its line
    assert "GRAZEMAP_PORT (8000)" in printed


def test_other_help_loads_no_settings() -> None:
    code = (
        "import sys; from grazemap.cli import commands; commands.parser(['up']).format_help(); "
        "sys.exit('pydantic_settings' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_variables_that_are_no_setting_are_named_with_one_that_may_be_meant() -> None:
    environment = {
        "GRAZEMAP_WORKERZ": "3",
        "grazemap_max_pixles": "1",
        "GRAZEMAP_QQ": "1",
        "grazemap_port": "1",
        "GRAZEMAP_API_KEY": "of a client",
        "PATH": "",
    }
    texts = [*unknown_variables(environment, ServiceSettings, StackSettings)]
    assert [text.split()[0] for text in texts] == ["GRAZEMAP_QQ", "GRAZEMAP_WORKERZ", "grazemap_max_pixles"]
    assert [text.split()[-1] for text in texts[1:]] == ["GRAZEMAP_WORKERS", "GRAZEMAP_MAX_PIXELS"]
    # the workers know no settings of the service
    (text,) = unknown_variables(environment, WorkerSettings, near=True)
    assert text == texts[1]


def test_no_setting_of_the_service_is_taken_for_a_misspelt_one_by_the_workers() -> None:
    known = WorkerSettings.model_fields
    assert not [name for name in FIELDS - {*known} if get_close_matches(name, known, 1, redis_settings._NEARLY)]
    everything = {setting.variable: "" for setting in LISTED}
    assert not [*unknown_variables(everything, WorkerSettings, near=True)]


def test_a_refusal_names_no_setting_that_follows_from_the_one_that_is_wrong() -> None:
    with pytest.raises(ValueError, match="workers") as caught:
        WorkerSettings(workers=0)
    assert "GRAZEMAP_MEMORY_BYTES" not in refusal_text(caught.value)  # type: ignore[arg-type]
