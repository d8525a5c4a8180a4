"""The blocking client is the one that the generator makes from the asynchronous client."""

from __future__ import annotations

import inspect
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import grazemap

ROOT = Path(__file__).parents[2]
SDK = ROOT / "sdk"
MODULES = ("client.py", "connection.py", "jobs.py", "watch.py")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the client and its generator."""
    shutil.copytree(SDK / "grazemap" / "client", tmp_path / "sdk" / "grazemap" / "client")
    (tmp_path / "tools").mkdir()
    shutil.copy(ROOT / "tools" / "generate_client.py", tmp_path / "tools")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path / "sdk"


def stale(sdk: Path) -> list[str]:
    """Return the modules that are not what the generator makes."""
    made = sdk.parent / "made"
    made.mkdir()
    subprocess.run([sys.executable, sdk.parent / "tools" / "generate_client.py", made], check=True, timeout=60)
    assert sorted(path.name for path in made.iterdir()) == list(MODULES)
    return [name for name in MODULES if (made / name).read_text() != (sdk / "grazemap" / "client" / name).read_text()]


def test_the_blocking_client_is_up_to_date(copy: Path) -> None:
    assert stale(copy) == [], "run `make client`"


@pytest.mark.parametrize("name", ["async_watch.py", "watch.py"])
def test_an_edit_of_one_client_is_detected(copy: Path, name: str) -> None:
    target = copy / "grazemap" / "client" / name
    target.write_text(target.read_text() + "\n\ndef planted() -> None:\n    pass\n")
    assert stale(copy) == ["watch.py"]


@pytest.mark.parametrize("name", MODULES)
def test_no_documentation_of_the_blocking_client_mentions_await(name: str) -> None:
    header, _, text = (SDK / "grazemap" / "client" / name).read_text().partition("\n")
    assert header == f"# Generated from async_{name} by `make client`: do not edit."
    assert "async" not in text.lower()
    assert "await" not in text


@pytest.mark.parametrize(
    ("blocking", "awaited"),
    [(grazemap.Client, grazemap.AsyncClient), (grazemap.JobHandle, grazemap.AsyncJobHandle)],
)
def test_both_clients_have_the_same_documentation(blocking: type, awaited: type) -> None:
    for name, method in inspect.getmembers(awaited, inspect.isfunction):
        if name[0] != "_":
            expected = (inspect.getdoc(method) or "").replace("await client.", "client.")
            assert inspect.getdoc(getattr(blocking, name)) == expected
