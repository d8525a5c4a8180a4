"""The time from a small question to its answer, and how many are answered in a second, through `grazemap up`.

`python -m tools.small_questions` (`make small-questions`) asks for grazing curves of ten points and short trajectories
that nobody has asked for before: on one kept connection, on eight, through the SDK, and a thousand in one batch; then
the same while two large maps are computed, and while a first start compiles its kernels. It prints each figure beside
its limit, with the processor time of client, service, workers and Redis for each question, and exits with 1 when a
limit is exceeded. With `--before FOLDER`, a checkout of an earlier version, that version is asked first, in the same
run. On a machine slower than the reference of `tools.pace` the limits are wider in proportion, which is said first.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import psutil

from grazemap import Client
from grazemap.errors import GrazemapError
from grazemap.module_command import module_command
from tools.first_start import started
from tools.pace import pace

CONNECTIONS = 8
QUESTIONS = 400
RATE_SECONDS = 6.0
IN_A_BATCH = 1000
# Beside two maps, and while kernels are compiled, everything may take this many times as long.
BESIDE_WORK = 3.0
_MAPS_BEGIN_SECONDS = 60.0
_JSON = {"Content-Type": "application/json"}
_PREFER = {**_JSON, "Prefer": "wait=10, return=representation", "Accept": "application/x-npz"}
_numbers = count(time.time_ns() % 10**9)

Question = tuple[str, dict[str, Any]]


def curve() -> Question:
    """Return the question for a grazing curve of ten points that was not asked before."""
    start = 0.27 + 1e-12 * next(_numbers)
    return "grazing-curves", {"omega": {"start": start, "stop": start + 0.01, "points": 10}}


def trajectory() -> Question:
    """Return the question for a short trajectory that was not asked before."""
    return "trajectories", {
        "omega": 0.27 + 1e-12 * next(_numbers),
        "clearance": 1.55,
        "periods": 10,
        "samples_per_period": 20,
    }


class Figure(NamedTuple):
    """What was measured: its name, the number, its unit, and what it must be below or above."""

    name: str
    value: float
    unit: str
    limit: float
    at_least: bool = False
    remark: str = ""

    @property
    def met(self) -> bool:
        """Whether the limit is met."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    def __str__(self) -> str:
        sign = ">=" if self.at_least else "<="
        text = f"{self.name:<44}{self.value:9.1f} {self.unit:<4}({sign} {self.limit:.0f})"
        return f"{text}{'' if self.met else ' MISSED'}  {self.remark}".rstrip()


def ask(connection: http.client.HTTPConnection, question: Question) -> float:
    """Return the seconds from a question to its result. An earlier version answers with the job, which is followed."""
    process, body = question
    began = time.perf_counter()
    answer, content = _exchange(connection, "POST", f"/v1/{process}", json.dumps(body), _PREFER)
    if answer.getheader("Content-Type") != "application/x-npz":
        job = json.loads(content)
        while job["status"] in ("accepted", "running"):
            time.sleep(0.01)
            job = json.loads(_exchange(connection, "GET", f"/v1/jobs/{job['id']}")[1])
        _exchange(connection, "GET", f"/v1/jobs/{job['id']}/result?f=npz")
    return time.perf_counter() - began


def _exchange(
    connection: http.client.HTTPConnection,
    method: str,
    path: str,
    body: str | None = None,
    headers: Mapping[str, str] = _JSON,
) -> tuple[http.client.HTTPResponse, bytes]:
    connection.request(method, path, body, dict(headers))
    answer = connection.getresponse()
    content = answer.read()
    if answer.status >= 300:
        raise RuntimeError(f"{method} {path} answers {answer.status}: {content[:300]!r}")
    return answer, content


def processor_seconds(stack: psutil.Process) -> dict[str, float]:
    """Return the processor time of this process, and of the service, the workers and Redis of a stack."""
    spent = {"client": sum(psutil.Process().cpu_times()[:2]), "service": 0.0, "workers": 0.0, "Redis": 0.0}
    for process in stack.children(recursive=True):
        try:
            command, times = " ".join(process.cmdline()), process.cpu_times()
        except psutil.NoSuchProcess:
            continue
        # a process that has ended counts for its parent
        total = times.user + times.system + times.children_user + times.children_system
        if "grazemap_worker" in command:
            spent["workers"] += total
        elif "grazemap_service" in command and "stack" not in command:
            spent["service"] += total
        elif "redis" in command or "valkey" in command:
            spent["Redis"] += total
    return spent


def _together(work: Callable[[Callable[[], bool]], int]) -> float:
    """Return the questions in a second of `CONNECTIONS` threads; `work` asks until it is told to stop."""
    with ThreadPoolExecutor(CONNECTIONS) as threads:
        began = time.perf_counter()
        asking = [threads.submit(work, lambda: time.perf_counter() - began < RATE_SECONDS) for _ in range(CONNECTIONS)]
        return sum(future.result() for future in asking) / (time.perf_counter() - began)


def figures(url: str, stack: psutil.Process, slower: float, batches: bool = True) -> Iterator[Figure]:
    """Measure a service and yield the figures; its limits are `slower` times those of an idle machine."""
    address = urlsplit(url).netloc
    for question in (curve, trajectory):
        with closing(http.client.HTTPConnection(address, timeout=60)) as connection:
            for _ in range(20):
                ask(connection, question())
            times = [1000 * ask(connection, question()) for _ in range(QUESTIONS)]
        name = question.__name__
        yield Figure(f"a {name}, one connection: median", statistics.median(times), "ms", 15 * slower)
        yield Figure(f"a {name}, one connection: 99 %", statistics.quantiles(times, n=100)[98], "ms", 40 * slower)

    def raw(go_on: Callable[[], bool]) -> int:
        asked = 0
        with closing(http.client.HTTPConnection(address, timeout=60)) as connection:
            while go_on():
                ask(connection, curve())
                asked += 1
        return asked

    def through_sdk(go_on: Callable[[], bool]) -> int:
        asked = 0
        with Client(url) as client:
            while go_on():
                body = curve()[1]["omega"]
                client.grazing_curve(omega=(body["start"], body["stop"]), points=10, progress=False)
                asked += 1
        return asked

    for name, work, limit in (("HTTP", raw, 150.0), ("the SDK", through_sdk, 100.0)):
        before = processor_seconds(stack)
        rate = _together(work)
        spent = {key: 1000 * (value - before[key]) / (rate * RATE_SECONDS) for key, value in
                 processor_seconds(stack).items()}  # fmt: skip
        remark = "CPU a question: " + ", ".join(f"{key} {value:.1f}" for key, value in spent.items()) + " ms"
        yield Figure(f"curves, eight connections, {name}", rate, "/s", limit / slower, True, remark)
    if batches:
        with Client(url) as client:
            began = time.perf_counter()
            results = list(client.map("grazing-curves", [curve()[1] for _ in range(IN_A_BATCH)]))
            took = time.perf_counter() - began
        assert len(results) == IN_A_BATCH
        yield Figure(f"{IN_A_BATCH} curves in a batch", took, "s", 2 * slower)


def _maps(client: Client) -> list[Any]:
    """Start two large maps and return them when their tiles are being computed."""
    ranges = {"start": 0.26, "stop": 0.30, "points": 1000}
    maps = [
        client.submit(
            "unfolding-maps", {"omega": ranges, "clearance": {"start": 1.3, "stop": 2.0 + 0.01 * k, "points": 1000}}
        )
        for k in range(2)
    ]
    deadline = time.monotonic() + _MAPS_BEGIN_SECONDS
    while not all(job.refresh().status == "running" for job in maps):
        if time.monotonic() > deadline:
            raise RuntimeError("the maps do not begin")
        time.sleep(0.2)
    return maps


@contextmanager
def _stack(environment: Mapping[str, str]) -> Iterator[tuple[str, psutil.Process]]:
    """Start a stack; its address and its process."""
    up = module_command("grazemap.cli", "up", "--port", "0")
    with tempfile.TemporaryDirectory() as folder, started(up, environment, Path(folder)) as start:
        children = psutil.Process().children(recursive=True)
        yield start.url, next(child for child in children if "grazemap_service.stack" in " ".join(child.cmdline()))


def _met(name: str, measured: Iterable[Figure]) -> bool:
    """Print figures under a name, and return whether all limits are met."""
    print(name, flush=True)
    met = True
    for figure in measured:
        met &= figure.met
        print(f"  {figure}", flush=True)
    return met


def measure(name: str, environment: Mapping[str, str], times: float, batches: bool = True) -> bool:
    """Start a stack, measure it idle and beside maps, print the figures, and return whether all limits are met."""
    with _stack(environment) as (url, stack):
        met = _met(f"{name}, idle", figures(url, stack, times, batches))
        with Client(url) as client:
            maps = _maps(client)
            try:
                met &= _met(f"{name}, beside two maps", figures(url, stack, times * BESIDE_WORK, batches))
            finally:
                for job in maps:
                    job.cancel()
    return met


def measure_first_start(environment: Mapping[str, str], times: float) -> bool:
    """Measure a stack as soon as it has the kernels of the questions, while it compiles those of maps.

    Raises
    ------
    RuntimeError
        The kernels of maps were compiled before the end.
    """
    with ExitStack() as opened:
        folder = opened.enter_context(tempfile.TemporaryDirectory())
        url, stack = opened.enter_context(_stack({**environment, "GRAZEMAP_CACHE_DIR": folder}))
        with closing(http.client.HTTPConnection(urlsplit(url).netloc, timeout=300)) as connection:
            for question in (curve, trajectory):
                ask(connection, question())
        met = _met("now, while kernels are compiled", figures(url, stack, times * BESIDE_WORK))
        if not any("grazemap_core.warmup" in " ".join(child.cmdline()) for child in stack.children(True)):
            raise RuntimeError("the kernels of maps were compiled before the end")
    return met


def main() -> int:
    """Measure this version, after an earlier one if it is given; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.small_questions")
    parser.add_argument("--before", type=Path, help="folder of a checkout of an earlier version")
    arguments = parser.parse_args()
    load, times = os.getloadavg()[0], pace()
    print(f"{os.cpu_count()} cores, load {load:.1f}; limits {times:.2f} times those of the reference")
    if arguments.before is not None:
        packages = [str(arguments.before.resolve() / name) for name in ("sdk", "core", "worker", "service")]
        try:
            measure("before", {**os.environ, "PYTHONPATH": os.pathsep.join(packages)}, times, batches=False)
        except (RuntimeError, GrazemapError) as error:
            print(f"  {error}")
    met = measure("now", os.environ, times)
    return 0 if measure_first_start(os.environ, times) and met else 1


if __name__ == "__main__":
    sys.exit(main())
