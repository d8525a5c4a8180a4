"""Processes that grazemap starts take no modules from the current folder."""

from __future__ import annotations

import subprocess
from pathlib import Path

from grazemap.module_command import module_command

ROOT = Path(__file__).parents[3]
PACKAGES = ("sdk/grazemap", "core/grazemap_core", "worker/grazemap_worker", "service/grazemap_service")


def test_a_module_of_the_current_folder_is_not_imported(tmp_path: Path) -> None:
    for planted in ("json", "argparse", "numpy"):
        (tmp_path / f"{planted}.py").write_text(f"raise SystemExit('{planted} of this folder')")

    def errors_of(command: list[str]) -> str:
        done = subprocess.run(command, cwd=tmp_path, input="", capture_output=True, text=True, timeout=60, check=False)
        return done.stderr

    command = module_command("grazemap.checker", "--help")
    assert "of this folder" not in errors_of(command)
    assert "of this folder" in errors_of([word for word in command if word != "-P"])  # as it would be


def test_every_process_of_python_is_started_so() -> None:
    beside = [
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        if "sys.executable" in path.read_text("utf-8")
    ]
    assert beside == ["sdk/grazemap/module_command.py"]
