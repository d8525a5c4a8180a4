"""From the first start of `grazemap up` to the first curve, trajectory and map.

`python -m tools.cold_start` (`make cold-start`) installs the wheel with the newest dependencies and starts
`grazemap up` with a fresh user folder. All questions are asked as soon as it listens, and the seconds from the start to
each answer are printed beside their limits, with the wait that the estimate said: for a first start, for one with the
kernels that it has compiled, and for a first start with `grazemap-kernels`. The limits are for the reference machine of
`tools.pace`; on a slower one they are longer in proportion, which is said first. Then two stacks are started at once
with one fresh folder, one of which is killed twice while it compiles: the other one has to answer, and what it has
compiled has to be loaded by the next start. It exits with 1 when a limit is exceeded.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil

from tools.first_start import PYTHONS, ROOT, installed, interpreter, started, user
from tools.pace import pace

_RANGE = {"start": 0.26, "stop": 0.30, "points": 20}
_ORBIT = {"omega": 0.27, "clearance": 1.85, "motion": {"period": 1, "stops": [1]}}
_WINDOW = {"omega": _RANGE, "clearance": {"start": 1.3, "stop": 2.0, "points": 20}}
# Matrices without a structure that could be used.
_DENSE = {
    "matrices": {
        "mass": [[2.0, 0.1, 0.2, 0.1], [0.1, 1.5, 0.1, 0.2], [0.2, 0.1, 1.0, 0.1], [0.1, 0.2, 0.1, 1.2]],
        "stiffness": [
            [2.0, -0.5, -0.2, -0.1],
            [-0.5, 2.0, -0.5, -0.2],
            [-0.2, -0.5, 2.0, -0.5],
            [-0.1, -0.2, -0.5, 2.0],
        ],
        "damping": [
            [0.2, -0.03, 0.0, -0.01],
            [-0.03, 0.2, -0.04, 0.0],
            [0.0, -0.04, 0.2, -0.02],
            [-0.01, 0.0, -0.02, 0.2],
        ],
    },
    "forcing": [1.0, 0.0, 0.0, 0.0],
}
QUESTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "a curve": ("grazing-curves", {"omega": _RANGE}),
    "codimension-two points": ("codimension-two-points", {"omega": {"start": 0.25, "stop": 0.35}}),
    "a trajectory": ("trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 20, "samples_per_period": 20}),
    "a map": ("unfolding-maps", {**_WINDOW, "max_periods": 200}),
    **{
        f"a map of {masses} masses": (
            "unfolding-maps",
            {**_WINDOW, "max_periods": 200, "oscillator": {"masses": [1.0] * masses, "stiffnesses": [1.0] * masses}},
        )
        for masses in (1, 2, 5, 8)
    },
    "a map of 4 masses, dense": ("unfolding-maps", {**_WINDOW, "max_periods": 200, "oscillator": _DENSE}),
    "a map over damping": (
        "unfolding-maps",
        {
            "horizontal": {"vary": "omega", "values": _RANGE},
            "vertical": {"vary": "damping", "values": {"start": 0.05, "stop": 0.2, "points": 20}},
            "clearance": 1.6,
            "max_periods": 200,
        },
    ),
    "a map with observables": (
        "unfolding-maps",
        {**_WINDOW, "max_periods": 200, "observables": ["rms_displacement"]},
    ),
    "a branch": ("orbit-branches", {**_ORBIT, "range": {"start": 1.8, "stop": 1.9}}),
    "a diagram": ("unfolding-diagrams", {**_WINDOW, "max_periods": 200}),
}
COLD = {"a curve": 10.0, "codimension-two points": 10.0, "a trajectory": 20.0, "a map": 45.0}
COLD |= dict.fromkeys([name for name in QUESTIONS if name not in COLD], 49.0)
COLD |= {"a map over damping": 90.0, "a map with observables": 90.0}
WARM = dict.fromkeys(QUESTIONS, 4.0)
AHEAD = dict.fromkeys(QUESTIONS, 5.0)
_ANSWER_SECONDS = 600.0
# Seconds after which the second stack is killed: it compiles then.
_KILLED_AFTER = 8.0


def said(url: str, name: str) -> str:
    """Return what the estimate of a question says about the compilation of its kernels, empty if it says nothing."""
    process, body = QUESTIONS[name]
    headers = {"Content-Type": "application/json"}
    request = urllib.request.Request(f"{url}/v1/{process}/estimate", json.dumps(body).encode(), headers)
    with urllib.request.urlopen(request, timeout=60) as answer:
        notes = json.load(answer)["notes"]
    seconds = [re.search(r"about (\d+) s", note["detail"]) for note in notes if note["code"] == "compiles-first"]
    return f"  said: {seconds[0][1]} s" if seconds and seconds[0] else ""


def answered(url: str, name: str, began: float) -> float:
    """Ask a question and return the seconds from `began` to its result."""
    process, body = QUESTIONS[name]
    headers = {"Content-Type": "application/json", "Prefer": "wait=30, return=representation"}
    while time.monotonic() - began < _ANSWER_SECONDS:
        request = urllib.request.Request(f"{url}/v1/{process}", json.dumps(body).encode(), headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            if "Content-Location" in answer.headers:
                answer.read()
                return time.monotonic() - began
            job = json.load(answer)
        if job["status"] in ("failed", "dismissed"):
            raise RuntimeError(f"{name}: {job['problem']}")
    return float("inf")


def timed(title: str, grazemap: Path, home: str, limits: Mapping[str, float], times: float) -> bool:
    """Start a stack, print when each question is answered, and return whether all limits, `times` as long, are met."""
    began = time.monotonic()
    with started([str(grazemap), "up", "--port", "0"], user(home), Path(home)) as start:
        print(f"{title}: listens after {start.seconds[-1]:.1f} s", flush=True)
        waits = {name: said(start.url, name) for name in QUESTIONS}
        with ThreadPoolExecutor(len(QUESTIONS)) as threads:
            delays = dict(
                zip(QUESTIONS, threads.map(lambda name: answered(start.url, name, began), QUESTIONS), strict=True)
            )
    for name, seconds in delays.items():
        limit = times * limits[name]
        over = "" if seconds <= limit else "  TOO LATE"
        print(f"  {name:<26}{seconds:8.1f} s (<= {limit:.0f} s){waits[name]}{over}", flush=True)
    return all(seconds <= times * limits[name] for name, seconds in delays.items())


def killed(grazemap: Path, home: str) -> None:
    """Start a stack and kill all its processes while it compiles."""
    up = subprocess.Popen([grazemap, "up", "--port", "0"], env=user(home), cwd=home, stdout=subprocess.DEVNULL)
    time.sleep(_KILLED_AFTER)
    processes = psutil.Process(up.pid).children(recursive=True)
    compiling = sum("grazemap_core.warmup" in process.cmdline() for process in processes)
    for process in [psutil.Process(up.pid), *processes]:
        process.send_signal(signal.SIGKILL)
    up.wait()
    print(f"  killed a stack beside it, of which {compiling} processes compiled", flush=True)


def beside_one_that_is_killed(grazemap: Path, home: str, times: float) -> bool:
    """Start two stacks with one folder, kill one of them twice, and return whether the other one's kernels stay."""
    print("two stacks at once, one of them killed twice", flush=True)
    with ThreadPoolExecutor(1) as threads:
        other = threads.submit(timed, "  the other one", grazemap, home, dict.fromkeys(QUESTIONS, _ANSWER_SECONDS), 1.0)
        for _ in range(2):
            killed(grazemap, home)
        held = other.result()
    return timed("its kernels, loaded", grazemap, home, WARM, times) and held


def main() -> int:
    """Measure every start; return the exit status."""
    python = interpreter(PYTHONS[0])
    assert python is not None
    times = pace()
    print(
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; limits {times:.2f} times as long as on the reference"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", name]
        subprocess.run(build, cwd=ROOT, check=True)
        (wheel,) = folder.glob("*.whl")
        grazemap = installed(python, wheel, folder / "environment")
        homes = [tempfile.mkdtemp(dir=folder) for _ in range(3)]
        met = timed("first start", grazemap, homes[0], COLD, times)
        met &= timed("second start", grazemap, homes[0], WARM, times)
        met &= beside_one_that_is_killed(grazemap, homes[1], times)
        own = grazemap.with_name("python")
        pip: list[str | Path] = [own, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "hatchling"], check=True)
        subprocess.run([own, ROOT / "tools" / "kernels_wheel.py", folder / "kernels"], check=True, env=user(homes[2]))
        (kernels,) = (folder / "kernels").glob("*.whl")
        subprocess.run([*pip, kernels], check=True)
        met &= timed("first start with grazemap-kernels", grazemap, homes[2], AHEAD, times)
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
