"""The way of a map's omega from the client to the kernel and back."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.thorough
def test_omega_passes_the_modules_that_the_page_lists_and_no_more_than_allowed() -> None:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-W", "ignore", "-m", "tools.way_of_omega"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    modules = [line.split()[1].partition(".")[2] for line in done.stdout.splitlines()]
    paths = [f"`{module.replace('.', '/')}.py`" for module in modules]
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    listed = " ".join(page.split(f"There are {len(paths)}:")[1].split("###")[0].split())
    assert listed == ", ".join(paths[:-1]) + f" and {paths[-1]}."
