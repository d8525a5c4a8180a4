"""`grazemap up` as a person uses it: what it waits for, three addresses, Ctrl-C, nothing left."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx2
import psutil
import pytest

from grazemap_service.routers.docs import GUIDE
from tests.support.watching import living, until

KEY = "0123456789-of-the-tests-KEY"


def test_up_prints_the_addresses_and_ctrl_c_ends_it_in_order(tmp_path: Path) -> None:
    # with modules of a user in the folder where he types this
    for module in ("numpy", "redis", "numba", "uvicorn", "grazemap_core", "queue"):
        (tmp_path / f"{module}.py").write_text(f"raise SystemExit('{module} of this folder')")
    command = [Path(sys.executable).with_name("grazemap"), "up", "--port", "0", "--workers", "1"]
    # An operator's settings hold for it: what is asked without the key is refused, and it comes up all the same.
    environment = {**os.environ, "GRAZEMAP_API_KEYS": KEY}
    # In a session of its own, so that the signal reaches the whole group as Ctrl-C in a terminal does.
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True, env=environment, cwd=tmp_path
    ) as up:
        assert up.stdout is not None
        try:
            addresses = dict(up.stdout.readline().split() for _ in range(4))
            assert list(addresses) == ["explorer", "guide", "docs", "metrics"]
            for name, address in addresses.items():
                key = {"authorization": f"Bearer {KEY}"}
                answer = httpx2.get(address, headers=key, trust_env=False)
                assert answer.status_code == (200 if name != "guide" or GUIDE.is_built else 404)
            assert httpx2.get(addresses["metrics"], trust_env=False).status_code == 401
            below = psutil.Process(up.pid).children(recursive=True)
            assert len(below) >= 4
            informed = [process for process in below if KEY in process.environ().values()]
            assert {"grazemap_service"} >= {
                process.cmdline()[-1] for process in informed if "--port" not in process.cmdline()
            }
        finally:
            os.killpg(up.pid, signal.SIGINT)
        assert up.wait(timeout=60) == 0
    until(lambda: not living(below))


@pytest.mark.thorough
def test_up_waits_at_sigterm_for_what_it_started() -> None:
    command = [sys.executable, "-m", "grazemap.cli", "up", "--port", "0", "--workers", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as up:
        assert up.stdout is not None
        assert up.stdout.readline().startswith(b"explorer")
        below = psutil.Process(up.pid).children(recursive=True)
        up.terminate()
        assert up.wait(timeout=60) == 0
        assert len(below) >= 4
        assert living(below) == []


def test_up_ends_at_sigterm_while_it_starts(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "grazemap.cli", "up", "--port", "0", "--data", str(tmp_path)]
    with (tmp_path / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # of another stack
        with subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True) as up:
            assert up.stderr is not None
            assert any(b"another stack" in line for line in up.stderr)
            below = psutil.Process(up.pid).children(recursive=True)
            up.terminate()
            assert up.wait(timeout=60) == 0
    assert living(below) == []
