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
    # An operator's settings hold for it: what is asked without the key is refused, and it comes up all the same.
    environment = {**os.environ, "GRAZEMAP_API_KEYS": "secret"}
    # In a session of its own, so that the signal reaches the whole group as Ctrl-C in a terminal does.
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True, env=environment) as up:
        assert up.stdout is not None
        addresses = dict(up.stdout.readline().split() for _ in range(3))
        assert list(addresses) == ["explorer", "docs", "metrics"]
        for address in addresses.values():
            key = {"authorization": "Bearer secret"}
            assert httpx2.get(address, headers=key, trust_env=False).status_code == 200
        assert httpx2.get(addresses["metrics"], trust_env=False).status_code == 401
        below = psutil.Process(up.pid).children(recursive=True)
        assert len(below) >= 4
        os.killpg(up.pid, signal.SIGINT)
        assert up.wait(timeout=15) == 0
    _, left = psutil.wait_procs(below, timeout=5)
    assert left == []
