"""Peak memory of requests at every limit: `make memory`, or `python -m tests.slow.limits_of_memory [SECONDS [NAME]]`.

Each request is one that the service takes. A child process computes it as a worker's compute process does, without
Redis: its tiles, each as npz, then what joins them. After SECONDS of processor time (120) it is dismissed, as by its
owner. The peak is what the child has had in memory. The program fails if one is over MOST_BYTES, or ends otherwise than
with a result, a refusal of the core or its dismissal.

Then a stack gets all of them at once. Those that are unfinished after SECONDS are dismissed; the program fails if a
DELETE takes more than a second, if a compute process is over MOST_BYTES or goes on, or if a job ends in any other way.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
import time
import urllib.error
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import psutil

from grazemap_worker.environment import one_thread
from tests.support.running_stack import RunningStack
from tests.support.watching import until

one_thread()

from grazemap.codec import Document, decode_npz, encode_npz  # noqa: E402 - after the environment is set
from grazemap.wire import ProcessRequest, parse_request  # noqa: E402
from grazemap_core.errors import CoreError  # noqa: E402
from grazemap_service.limits import checked_plan  # noqa: E402
from grazemap_service.problems import ProblemException  # noqa: E402
from grazemap_service.settings import ServiceSettings  # noqa: E402
from grazemap_worker.planning import Plan  # noqa: E402
from grazemap_worker.planning.limits import MAX_RESULT_BYTES  # noqa: E402
from grazemap_worker.processes import IMPLEMENTATIONS  # noqa: E402

MOST_BYTES = 2 << 30
SECONDS = 120
MOST_DELETE_SECONDS = 1.0
RESULT, REFUSED = 0, 3
POINT = {"omega": 0.29, "clearance": 1.6}
WINDOW = {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}
# thousands of impacts a period, for ever
CLOSE = {"omega": 0.29, "clearance": 1e-4, "oscillator": {"restitution": 1.0}}


def chain(masses: int, **body: Any) -> dict[str, Any]:
    """Return a question about a chain of equal masses."""
    lists = {"masses": [1.0] * masses, "stiffnesses": [1.0] * masses, "forcing": [1.0] + [0.0] * (masses - 1)}
    return {"oscillator": {**lists, "damping": 0.05}, **body}


def grid(rows: int, columns: int, **body: Any) -> dict[str, Any]:
    """Return a question over the window."""
    sides = {"omega": columns, "clearance": rows}
    return {name: {**WINDOW[name], "points": points} for name, points in sides.items()} | body


def rectangle(points: int) -> dict[str, Any]:
    """Return a question about basins."""
    values = {"start": -1.3, "stop": 1.3, "points": points}
    horizontal, vertical = ({"quantity": name, "values": values} for name in ("displacement", "velocity"))
    return {"omega": 0.29, "clearance": 1.35, "horizontal": horizontal, "vertical": vertical}


IMPACTS = {"stops": [1, -1] * 128, "phases": [0.01 * k for k in range(256)], "velocities": [0.1, -0.1] * 128}
QUESTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "impacts of a trajectory": ("trajectories", {**CLOSE, "periods": 990_000, "samples_per_period": 1}),
    "transient": ("trajectories", {**CLOSE, "periods": 1, "transient_periods": 900_000}),
    "impacts of 1000 trajectories": (
        "trajectories",
        {**CLOSE, "periods": 990, "initial": [{}] * 1000, "samples_per_period": 1},
    ),
    "64 masses": (
        "trajectories",
        chain(64, **POINT | {"clearance": 1e-3}, periods=260_000, samples_per_period=1)
        | {"oscillator": {**chain(64)["oscillator"], "restitution": 1.0}},
    ),
    "1e6 samples": ("trajectories", {**POINT, "periods": 100_000, "samples_per_period": 10}),
    "orbit between close stops": ("periodic-orbits", {**CLOSE, "transient_periods": 990_000, "max_period": 256}),
    "motion between close stops": ("periodic-orbits", {**CLOSE, "motion": {"period": 1, "stops": [1, 1, -1]}}),
    "impacts of a diagram": (
        "bifurcation-diagrams",
        {
            "vary": "clearance",
            "range": {"start": 1e-4, "stop": 2e-4, "points": 1000},
            "omega": 0.29,
            "oscillator": {"restitution": 1.0},
            "periods": 690,
        },
    ),
    "values of a diagram": (
        "bifurcation-diagrams",
        {
            "vary": "clearance",
            "range": {"start": 1.3, "stop": 2.0, "points": 400_000},
            "omega": 0.29,
            "periods": 1,
            "transient_periods": 1,
        },
    ),
    "1e6 points of a curve": (
        "grazing-curves",
        chain(64, omega={"start": 0.2, "stop": 0.5, "points": 1_000_000}, max_order=200),
    ),
    "sequences of a curve": (
        "grazing-curves",
        {"omega": {"start": 0.2, "stop": 0.5, "points": 167_000}, "max_order": 200, "sequence": True},
    ),
    "codimension-two points": (
        "codimension-two-points",
        chain(64, omega={"start": 0.2, "stop": 2.0}, max_order=200, max_multiple=100),
    ),
    "discontinuity mapping": (
        "discontinuity-mappings",
        chain(64, omega=0.29, overshoot=[1e-9 * (k + 1) for k in range(1000)], returns=100),
    ),
    "curves of 100 periods": (
        "bifurcation-curves",
        {**WINDOW, "points": 100_000, "max_multiple": 100},
    ),
    "branch of 256 impacts": (
        "orbit-branches",
        {**POINT, "motion": {"period": 256, **IMPACTS}, "range": {"start": 1.0, "stop": 2.0}, "max_points": 20_000},
    ),
    "map, 4 million points": ("unfolding-maps", grid(2048, 2048, max_periods=2)),
    "adaptive map, 4096 x 4096": ("unfolding-maps", grid(4096, 4096, adaptive=True, max_periods=200)),
    "ensemble of 1000": ("unfolding-maps", grid(64, 64, policy="ensemble", initial_conditions=1000)),
    "ensemble, 64 masses": (
        "unfolding-maps",
        chain(64, **grid(32, 32), policy="ensemble", initial_conditions=1000, max_periods=200),
    ),
    "sweep": ("unfolding-maps", grid(1_000_000, 4, policy="sweep-up", max_periods=10)),
    "basins, 4 million states": ("basins", {**rectangle(2048), "max_periods": 2}),
    "basin fractions, 64 masses": (
        "basin-fractions",
        chain(64, vary="clearance", range=[1.3, 1.4], omega=0.29, states=100_000, max_periods=2),
    ),
    "borders": ("unfolding-diagrams", grid(547, 547, borders=True, max_periods=200)),
}


def computed(process: str, request: ProcessRequest, planned: Plan) -> int:
    """Compute a request as a worker does; return RESULT or REFUSED."""
    how = IMPLEMENTATIONS[process]
    try:
        if how.whole is not None:
            encoded(how.whole(request, silent))
        elif how.tile is not None and how.assembled is not None:
            tiles = [encoded(how.tile(request, tile)) for tile in planned.tiles]
            encoded(how.assembled(request, planned, [decode_npz(data)[0] for data in tiles], silent))
    except (CoreError, OverflowError):
        return REFUSED
    return RESULT


def encoded(document: Document) -> bytes:
    """Return a result or a tile as npz. Raises OverflowError where the store would not take it."""
    data = encode_npz(document, {})
    if len(data) > MAX_RESULT_BYTES:
        raise OverflowError
    return data


def silent(done: int, total: int) -> None:
    """Nobody waits."""


def measured(name: str, seconds: int) -> bool:
    """Compute a question in a child process, print a line, and return whether it stayed within its memory."""
    process, body = QUESTIONS[name]
    request = parse_request(process, body)
    planned, refusal = IMPLEMENTATIONS[process].plan(request), ""
    try:
        checked_plan(process, request, ServiceSettings())
    except ProblemException as problem:
        refusal = f"; refused: {problem.problem.detail}"
    child = os.fork()
    if not child:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        os._exit(computed(process, request, planned))
    began = time.monotonic()
    _, status, usage = os.wait4(child, 0)
    spent = usage.ru_utime + usage.ru_stime
    ended = {RESULT: "result", REFUSED: "refused"}.get(os.waitstatus_to_exitcode(status))
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL and spent >= 0.9 * seconds:
        ended = "dismissed"
    megabytes = usage.ru_maxrss / 1024
    print(f"{name:<30}{ended or 'FAILED':<10}{megabytes:6.0f} MiB{spent:8.1f} s of processor time", end="")
    print(f", plan {planned.estimate.seconds:.1f} s, {time.monotonic() - began:.0f} s in all{refusal}", flush=True)
    return ended is not None and usage.ru_maxrss << 10 <= MOST_BYTES


def together(names: Sequence[str], seconds: int) -> bool:
    """Ask a stack for all of them, dismiss the unfinished, print a line, and return whether all went well."""
    stack, jobs, refused, peak, longest = RunningStack(), [], 0, 0, 0.0
    try:
        for name in names:
            process, body = QUESTIONS[name]
            try:
                jobs.append(stack.request(f"/v1/{process}", body)["id"])
            except urllib.error.HTTPError as error:
                refused += error.code == 422
        ends = time.monotonic() + seconds
        while time.monotonic() < ends:
            for _, compute_process in stack.busy_workers():
                with suppress(psutil.NoSuchProcess):
                    peak = max(peak, compute_process.memory_info().rss)
            time.sleep(0.2)
        for job in jobs:
            began = time.monotonic()
            stack.request(f"/v1/jobs/{job}", method="DELETE")
            longest = max(longest, time.monotonic() - began)
        until(lambda: not stack.busy_workers(), 2)
        ended = Counter(stack.job(job)["status"] for job in jobs)
    finally:
        stack.stop()
    print(
        f"together in a stack: {refused} refused, {', '.join(f'{n} {status}' for status, n in ended.items())}", end=""
    )
    print(f"; {peak >> 20} MiB at most; a DELETE took {longest:.3f} s at most", flush=True)
    all_ended = refused + ended["successful"] + ended["failed"] + ended["dismissed"] == len(names)
    return all_ended and peak <= MOST_BYTES and longest < MOST_DELETE_SECONDS


def main() -> int:
    """Compute all questions, or those named; return 1 if one is over its memory."""
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    names = sys.argv[2:] or [*QUESTIONS]
    within = [measured(name, seconds) for name in names]
    print(f"{sum(within)} of {len(within)} within {MOST_BYTES >> 20} MiB")
    return 0 if together(names, seconds) and all(within) else 1


if __name__ == "__main__":
    sys.exit(main())
