"""The Makefile: it works in a folder whose name has blanks, and finds a Python that really runs."""

from __future__ import annotations

import os
import subprocess
import tomllib
from pathlib import Path

import pytest

from tools.first_start import PYTHONS

ROOT = Path(__file__).parents[3]
# what stands in for Python: it makes environments of itself, and otherwise does nothing
PLAYED_PYTHON = """#!/bin/sh
[ "$2" = venv ] && mkdir -p "$3/bin" && cp "$0" "$3/bin/python"
[ "$2" = hatchling ] && mkdir -p "$6" && touch "$6/grazemap.whl"
exit 0
"""
# as a shim of pyenv, for a version that is not installed
SHIM = "#!/bin/sh\necho 'pyenv: command not found' >&2\nexit 127\n"


def program(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


def make(folder: Path, *arguments: str, path: str = "") -> subprocess.CompletedProcess[str]:
    environment = {"PATH": path + os.defpath, "HOME": str(folder)}
    command = ["make", "--no-print-directory", "-f", "Makefile", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A folder with the Makefile, and with environments that count as installed."""
    folder = tmp_path / "a folder's clone"
    program(folder / ".venv/bin/python", PLAYED_PYTHON)
    for name in ("Makefile", "pyproject.toml"):
        (folder / name).write_text((ROOT / name).read_text())
    for name in ("requirements.lock", ".venv/.run-stamp", ".venv/.stamp"):
        (folder / name).touch()
    return folder


def test_the_newest_dependencies_are_tested_in_a_folder_whose_name_has_blanks(clone: Path) -> None:
    of_others = [clone.parent / "a", clone / "folder's", clone / "clone"]
    for folder in of_others:
        folder.mkdir()
    stale = clone / ".cache/newest/stale"
    stale.mkdir(parents=True)
    done = make(clone, "test-newest", "PYTHON=.venv/bin/python")
    assert all(folder.is_dir() for folder in of_others)
    assert done.returncode == 0, done.stderr
    assert not stale.exists()
    assert (clone / ".cache/newest/venv/bin/python").exists()


@pytest.mark.parametrize("target", ["kernels", "general", "estimates", "schemathesis"])
def test_other_targets_make_their_folders_there_too(clone: Path, target: str) -> None:
    program(clone / ".cache/schemathesis/bin/python", PLAYED_PYTHON)
    before = {path.name for path in clone.iterdir()}
    done = make(clone, target, "PYTHON=.venv/bin/python")
    assert done.returncode == 0, done.stderr
    assert {path.name for path in clone.iterdir()} == before | {".cache"}
    assert [path.name for path in clone.parent.iterdir()] == [clone.name]


def test_kernels_are_compiled_into_the_folder_of_the_clone(clone: Path) -> None:
    program(clone / ".venv/bin/python", '#!/bin/sh\necho "$GRAZEMAP_CACHE_DIR"\n')
    assert make(clone, "digests").stdout.splitlines()[-1] == f"{clone}/.cache/grazemap"


@pytest.mark.parametrize("version", PYTHONS)
def test_the_newest_python_that_runs_makes_the_environment(clone: Path, version: str) -> None:
    for other in PYTHONS:
        text = PLAYED_PYTHON + f"# {other}\n" if other <= version else SHIM
        program(clone / f"bin/python{other}", text)
    for name in (".venv/.run-stamp", ".venv/.stamp", ".venv/bin/python"):
        (clone / name).unlink()
    done = make(clone, ".venv/.run-stamp", path=f"{clone}/bin:")
    assert done.returncode == 0, done.stderr
    assert (clone / ".venv/bin/python").read_text().endswith(f"# {version}\n")


def test_the_oldest_and_the_newest_python_are_the_same_in_every_file() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    oldest, newest = PYTHONS[0], PYTHONS[-1]
    assert project["project"]["requires-python"] == f">={oldest}"
    assert f"Python {oldest} to {newest}" in (ROOT / "README.md").read_text()


def test_without_such_a_python_the_reason_is_given(clone: Path) -> None:
    (clone / ".venv/.run-stamp").unlink()
    for version in PYTHONS:
        program(clone / f"bin/python{version}", SHIM)
    done = make(clone, ".venv/.run-stamp", path=f"{clone}/bin:")
    assert done.returncode != 0
    assert "PYTHON=" in done.stderr
    assert not (clone / ".venv/.run-stamp").exists()


def test_a_python_that_is_named_is_taken(clone: Path) -> None:
    program(clone / "bin/python3.11", SHIM)
    program(clone / "bin/own", PLAYED_PYTHON)
    (clone / ".venv/.run-stamp").unlink()
    done = make(clone, ".venv/.run-stamp", "PYTHON=bin/own", path=f"{clone}/bin:")
    assert done.returncode == 0, done.stderr
