"""A stack as a person starts it, in a process of its own."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import psutil

from tests.support.watching import living, until

# some three seconds of two cores
MAP = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 100},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 110},
}


class RunningStack:
    """A stack in a process of its own, and requests to it, each for `timeout` seconds at most."""

    timeout = 20.0

    def __init__(self, *options: str) -> None:
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "grazemap_service.stack", "--workers", "2", *options], stdout=subprocess.PIPE
        )
        assert self.popen.stdout is not None
        line = self.popen.stdout.readline()
        assert line, "the stack ended before it was ready"
        self.url: str = json.loads(line)["url"]
        assert json.loads(line)["pid"] == self.popen.pid
        self.popen.stdout.close()
        self.process = psutil.Process(self.popen.pid)

    def request(self, path: str, body: dict[str, Any] | None = None, method: str | None = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(
            self.url + path, data, {"Content-Type": "application/json"} if body else {}, method=method
        )
        with urllib.request.urlopen(request, timeout=self.timeout) as answer:
            content = answer.read()
            return json.loads(content) if "json" in answer.headers["Content-Type"] else content

    def job(self, identity: str) -> dict[str, Any]:
        """The job, asked again while the service is away."""
        for _ in range(100):
            try:
                document: dict[str, Any] = self.request(f"/v1/jobs/{identity}")
                return document
            except (urllib.error.URLError, ConnectionError, TimeoutError):
                time.sleep(0.1)
        raise AssertionError("the service did not come back")

    def child(self, word: str) -> psutil.Process:
        """The stack's child with a word in its command line, as soon as there is one."""
        children: list[psutil.Process] = []

        def look() -> list[psutil.Process]:
            for child in living(self.process.children()):
                with contextlib.suppress(psutil.NoSuchProcess):  # it may end while it is looked at
                    if word in " ".join(child.cmdline()):
                        children.append(child)
            return children

        until(look)
        return children[0]

    def busy_workers(self) -> list[tuple[psutil.Process, psutil.Process]]:
        """Workers with the work-compute_processes that they have at this moment."""
        pairs = []
        for worker in living(self.child("grazemap_worker").children()):
            with contextlib.suppress(psutil.NoSuchProcess):
                pairs += [(worker, process) for process in living(worker.children())]
        return pairs

    def a_busy_worker(self) -> tuple[psutil.Process, psutil.Process]:
        """A worker and its compute process, as soon as there are both."""
        pairs: list[tuple[psutil.Process, psutil.Process]] = []

        def look() -> list[tuple[psutil.Process, psutil.Process]]:
            pairs[:] = self.busy_workers()
            return pairs

        until(look)
        return pairs[0]

    def redis_socket(self) -> Path:
        """Where the embedded Redis listens, as it says in its own process title."""
        return Path(" ".join(self.child("unixsocket:").cmdline()).rpartition("unixsocket:")[2].strip())

    def wait_for(self, identity: str, seconds: float) -> bytes:
        until(lambda: self.job(identity)["status"] not in ("accepted", "running"), seconds)
        job = self.job(identity)
        assert job["status"] == "successful", job
        content = self.request(f"/v1/jobs/{identity}/result?f=npz")
        assert isinstance(content, bytes)
        return content

    def stop(self) -> None:
        everything = self.process.children(recursive=True)
        self.popen.terminate()
        assert self.popen.wait(60) == 0
        until(lambda: not living(everything))
