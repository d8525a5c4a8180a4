"""Signals at random to every process of a stack: `make chaos`.

`python -m tests.slow.signals_at_random SEEDS SIGNALS` takes other numbers of them.

A stack computes maps while its compute processes, workers, supervisor (also while it loads kernels), service, Redis and
parent get SIGKILL, or SIGSTOP that a SIGCONT follows after up to 12 s, or SIGSTOP alone; the parent is only stopped and
continued. Then every map must have the bytes that a stack without signals computes and every tile one commit, and no
process may be left that does not descend from the stack, and none after its end. A line for each seed says how many
signals there were of each kind, how often kernels were being loaded, and how long it took until a stopped process was
replaced.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import shutil
import sys
import tempfile
import time
import urllib.error
from collections import Counter
from http.client import HTTPException
from pathlib import Path
from typing import Any

import psutil

from grazemap_worker.store import Store, connect
from tests.support.running_stack import RunningStack
from tests.support.watching import living, until

SEEDS, SIGNALS = 5, 110
TARGETS = {"compute process": 5, "worker": 4, "supervisor": 2, "warm-up": 2, "service": 3, "redis": 1, "parent": 2}
KILL, STOP, PAUSE = "SIGKILL", "SIGSTOP", "SIGSTOP and SIGCONT"
LONGEST_PAUSE = 12.0
# A stopped process is replaced in half that time, but its own watcher may be stopped too; Redis is given more.
REPLACED_SECONDS = {"redis": 120.0}
OTHERS_REPLACED_SECONDS = 60.0
UNFINISHED = 2
_MARK = "SIGNALS_AT_RANDOM"
_AWAY = (urllib.error.URLError, HTTPException, OSError, json.JSONDecodeError)


# A map takes a few seconds of two cores.
ROWS, MOST_MAPS = 80, 10_000


def question(number: int) -> dict[str, Any]:
    """Return one of as many maps as are needed."""
    start = 0.26 + 1e-6 * number
    omega = {"start": start, "stop": start + 0.04, "points": 240}
    return {"omega": omega, "clearance": {"start": 1.3, "stop": 2.0, "points": ROWS}}


class Disturbed:
    """A stack that computes maps and gets signals."""

    def __init__(self, stack: RunningStack, mark: str, seed: int) -> None:
        self._stack, self._mark, self._random = stack, mark, random.Random(seed)
        self._stack.timeout = 3.0
        self.counts: Counter[tuple[str, str]] = Counter()
        self._paused: list[tuple[float, psutil.Process]] = []
        self._stopped: list[tuple[float, str, psutil.Process]] = []
        self.longest = 0.0
        self.identities: list[str] = []
        self.done: set[str] = set()

    def send(self, signals: int) -> None:
        """Send so many signals, while there is something to compute."""
        while self.counts.total() < signals:
            self._keep_busy()
            target = self._random.choices(list(TARGETS), list(TARGETS.values()))[0]
            process = self._warming_up() if target == "warm-up" else self._found(target)
            if process is not None:
                self._signal(target, process)
            self._wait(self._random.uniform(0.1, 1.0))
            if self._random.random() < 0.25:
                deadline = time.monotonic() + 10
                while time.monotonic() < deadline and self._found("compute process") is None:
                    self._wait(0.2)

    def finish(self) -> None:
        """Continue what is stopped, and wait for every map; no process may be left alone."""
        for _, process in self._paused:
            _resume(process)
        until(self._all_done, 900)
        while self._stopped:
            self._wait(0.5)
        until(lambda: not self._orphans(), 10)

    def _all_done(self) -> bool:
        self._wait(0.5)
        self._keep_busy(more=False)
        return len(self.done) == len(self.identities)

    def _keep_busy(self, more: bool = True) -> None:
        """Ask about the maps again, post those that a Redis has lost with its last second, and others."""
        for number, identity in enumerate(self.identities):
            if identity in self.done:
                continue
            try:
                job = self._stack.request(f"/v1/jobs/{identity}")
                assert job["status"] in ("accepted", "running", "successful"), job
                if job["status"] == "successful":
                    self.done.add(identity)
            except urllib.error.HTTPError as error:
                if error.code == 404:
                    self._post(number)
            except _AWAY:
                pass
        if more and len(self.identities) - len(self.done) < UNFINISHED and len(self.identities) < MOST_MAPS:
            self._post(len(self.identities))

    def _post(self, number: int) -> None:
        with contextlib.suppress(*_AWAY):
            identity = self._stack.request("/v1/unfolding-maps", question(number))["id"]
            if number == len(self.identities):
                self.identities.append(identity)

    def _wait(self, seconds: float) -> None:
        """Wait; continue what was paused long enough, and see to it that what is stopped is replaced."""
        deadline = time.monotonic() + seconds
        while True:
            now = time.monotonic()
            for due in [pair for pair in self._paused if pair[0] <= now]:
                self._paused.remove(due)
                _resume(due[1])
            for entry in list(self._stopped):
                since, target, process = entry
                if not living([process]):
                    self._stopped.remove(entry)
                    self.longest = max(self.longest, now - since)
                limit = REPLACED_SECONDS.get(target, OTHERS_REPLACED_SECONDS)
                assert now - since < limit, f"{target} is stopped and not replaced: {process}"
            if now >= deadline:
                return
            time.sleep(0.05)

    def _signal(self, target: str, process: psutil.Process) -> None:
        kind = self._random.choice((KILL, KILL, STOP, PAUSE)) if target != "parent" else PAUSE
        with contextlib.suppress(psutil.NoSuchProcess):
            if kind == KILL:
                process.kill()
            else:
                process.suspend()
                now = time.monotonic()
                if kind == PAUSE:
                    self._paused.append((now + self._random.uniform(0.1, LONGEST_PAUSE), process))
                else:
                    self._stopped.append((now, target, process))
            self.counts[target, kind] += 1

    def _found(self, target: str) -> psutil.Process | None:
        """Return a process of this kind, if there is one that runs."""
        processes = self._all(target)
        return self._random.choice(processes) if processes else None

    def _all(self, target: str) -> list[psutil.Process]:
        parent = self._stack.process
        if target == "parent":
            return _running([parent])
        if target in ("compute process", "worker"):
            return [
                child
                for above in self._all("worker" if target == "compute process" else "supervisor")
                for child in _running(_children(above))
                if target == "compute process" or "multiprocessing" not in _command(child)
            ]
        word = {"supervisor": "-m grazemap_worker", "service": "-m grazemap_service", "redis": "unixsocket:"}[target]
        return [child for child in _running(_children(parent)) if word in _command(child)]

    def _warming_up(self) -> psutil.Process | None:
        """Return a supervisor that loads its kernels; one that has done so is killed, which counts as a signal."""
        supervisor = self._found("supervisor")
        if supervisor is not None and self._all("worker"):
            with contextlib.suppress(psutil.NoSuchProcess):
                supervisor.kill()
                self.counts["supervisor", KILL] += 1
            deadline = time.monotonic() + 15
            while self._all("supervisor") in ([], [supervisor]) and time.monotonic() < deadline:
                self._wait(0.05)
            self._wait(self._random.uniform(0.2, 3.0))
            supervisor = self._found("supervisor")
        return None if self._all("worker") else supervisor

    def _orphans(self) -> list[psutil.Process]:
        """Return the processes of the stack that do not descend from it."""
        family = {self._stack.process, *self._stack.process.children(recursive=True)}
        return [process for process in marked(self._mark) if process not in family]


def marked(mark: str) -> list[psutil.Process]:
    """Return the living processes that were started by a stack, by a mark in their environment."""
    processes = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if process.environ().get(_MARK) == mark:
                processes.append(process)
    return living(processes)


def _children(process: psutil.Process) -> list[psutil.Process]:
    with contextlib.suppress(psutil.NoSuchProcess):
        return process.children()
    return []


def _command(process: psutil.Process) -> str:
    with contextlib.suppress(psutil.NoSuchProcess):
        return " ".join(process.cmdline())
    return ""


def _running(processes: list[psutil.Process]) -> list[psutil.Process]:
    """Return the processes that live and are not stopped."""
    running = []
    for process in living(processes):
        with contextlib.suppress(psutil.NoSuchProcess):
            if process.status() != psutil.STATUS_STOPPED:
                running.append(process)
    return running


def _resume(process: psutil.Process) -> None:
    with contextlib.suppress(psutil.NoSuchProcess):
        process.resume()


def assert_one_commit_a_tile(stack: RunningStack, identity: str) -> None:
    """Read the events of a job: each tile was committed, and once."""
    redis = connect(f"unix://{stack.redis_socket()}")
    store = Store(redis)
    plan = store.jobs.plan_of(identity)
    assert plan is not None
    committed = [json.dumps(event.data) for event in store.jobs.events(identity) if event.name == "tile"]
    assert len(committed) == plan.tile_count, f"{identity}: {len(committed)} commits of {plan.tile_count} tiles"
    assert len(set(committed)) == plan.tile_count, f"{identity}: a tile was committed twice"
    redis.close()


def disturbed(seed: int, signals: int, data: Path) -> tuple[list[bytes], str]:
    """Send signals to a stack of its own; return its maps, and what was done in a line.

    Raises
    ------
    AssertionError
        A map fails or does not end, a tile was committed twice, or a process is left.
    """
    mark = f"{os.getpid()}-{seed}"
    os.environ[_MARK] = mark
    stack = RunningStack("--data", str(data))
    del os.environ[_MARK]
    try:
        run = Disturbed(stack, mark, seed)
        began = time.monotonic()
        run.send(signals)
        run.finish()
        took = time.monotonic() - began
        stack.timeout = 20.0
        maps = [stack.wait_for(identity, 60) for identity in run.identities]
        for identity in run.identities:
            assert_one_commit_a_tile(stack, identity)
        stack.stop()
    finally:
        if stack.popen.poll() is None:
            stack.process.kill()
            stack.popen.wait()
    until(lambda: not marked(mark), 10)
    by_target = "; ".join(
        f"{target} " + ", ".join(f"{run.counts[target, kind]} {kind}" for kind in (KILL, STOP, PAUSE))
        for target in TARGETS
    )
    return maps, f"{by_target}; {len(maps)} maps, {took:.0f} s; stopped ones replaced after {run.longest:.0f} s at most"


def undisturbed(count: int, data: Path, known: list[bytes]) -> list[bytes]:
    """Return the first maps as a stack without signals computes them, those that are known already among them."""
    stack = RunningStack("--data", str(data))
    try:
        numbers = range(len(known), count)
        identities = [stack.request("/v1/unfolding-maps", question(number))["id"] for number in numbers]
        return known + [stack.wait_for(identity, 900) for identity in identities]
    finally:
        stack.stop()


def main() -> int:
    """Run all seeds; return 1 if one has failed."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    signals = int(sys.argv[2]) if len(sys.argv) > 2 else SIGNALS
    expected: list[bytes] = []
    good = 0
    with tempfile.TemporaryDirectory() as folder:
        # kernels of its own: warm-ups that are killed have them compiled again
        cache = Path(folder, "cache")
        shutil.copytree(os.environ["GRAZEMAP_CACHE_DIR"], cache)
        cache.chmod(0o700)
        os.environ["GRAZEMAP_CACHE_DIR"] = str(cache)
        for seed in range(1, seeds + 1):
            try:
                maps, report = disturbed(seed, signals, Path(folder, f"data-{seed}"))
                if len(maps) > len(expected):
                    expected = undisturbed(len(maps), Path(folder, f"undisturbed-{seed}"), expected)
                assert maps == expected[: len(maps)], "a map has other bytes"
                good += 1
            except AssertionError as error:
                report = f"FAILED: {error}"
            print(f"seed {seed}: {report}", flush=True)
    print(f"{good} of {seeds} seeds passed")
    return 0 if good == seeds else 1


if __name__ == "__main__":
    sys.exit(main())
