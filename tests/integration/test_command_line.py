"""`grazemap up` as a person uses it: three addresses, Ctrl-C, nothing left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import httpx2
import psutil


def test_up_prints_the_addresses_and_ctrl_c_ends_it_in_order() -> None:
    command = [sys.executable, "-m", "grazemap.cli", "up", "--port", "0", "--workers", "1"]
    # In a session of its own, so that the signal reaches the whole group as Ctrl-C in a terminal does.
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as up:
        assert up.stdout is not None
        addresses = dict(up.stdout.readline().split() for _ in range(3))
        assert list(addresses) == ["explorer", "docs", "metrics"]
        for address in addresses.values():
            assert httpx2.get(address, trust_env=False).status_code == 200
        below = psutil.Process(up.pid).children(recursive=True)
        assert len(below) >= 4
        os.killpg(up.pid, signal.SIGINT)
        assert up.wait(timeout=15) == 0
    _, left = psutil.wait_procs(below, timeout=5)
    assert left == []
