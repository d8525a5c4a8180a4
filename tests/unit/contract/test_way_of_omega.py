"""The way of a map's omega from the client to the kernel and back."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.thorough
def test_omega_passes_the_files_of_the_page_in_its_order_and_few_others() -> None:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-W", "ignore", "-m", "tools.way_of_omega"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    modules = done.stdout.partition("\n\n")[0].splitlines()
    passed = [line.split()[1].replace(".", "/") for line in modules]
    page = (ROOT / "docs" / "way.md").read_text("utf-8")
    listed = re.findall(r"^\| \d+ \| .*\(\.\./\w+/(.+)\.py\)", page, re.MULTILINE)
    assert [path for path in passed if path in listed] == [path for path in listed if path in passed]
    # a wake-up passes no omega on, and the way ends before the lanes
    assert set(listed) - set(passed) <= {path for path in listed if path.endswith(("wake_ups", "lockstep"))}
