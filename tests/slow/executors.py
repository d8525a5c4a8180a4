"""The same results by a service and without one: `make executors`.

A map, an adaptive map, a diagram with borders and basins are computed by a service, by a pool of this machine, by
Dask (two processes), by mpi4py (two ranks) and as an array of tasks that share a folder. The bytes must be equal, also
where a process is killed once the first tile is finished: in the service, in the pool and in Dask. Then a map of
512 x 512 points is timed by a pool of one process, and by a loop over its tiles in one process; the pool may take
MOST_OVERHEAD more.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

import grazemap
from grazemap import cli
from grazemap.module_command import module_command
from grazemap.wire import parse_request
from grazemap_worker.direct import Direct

MOST_OVERHEAD = 0.05
_WINDOW = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 64},
    "clearance": {"start": 1.5, "stop": 1.9, "points": 64},
}
REQUESTS: dict[str, tuple[str, dict[str, Any]]] = {
    "map": ("unfolding-maps", _WINDOW),
    "adaptive map": ("unfolding-maps", {**_WINDOW, "adaptive": True}),
    "diagram": ("unfolding-diagrams", {**_WINDOW, "borders": True}),
    "basins": (
        "basins",
        {
            "omega": 0.29,
            "clearance": 1.9927,
            "horizontal": {"vary": "displacement[1]", "values": {"start": -1.9, "stop": 1.9, "points": 96}},
            "vertical": {"vary": "velocity[1]", "values": {"start": -1.0, "stop": 1.0, "points": 96}},
        },
    ),
}
LARGE = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 512},
    "clearance": {"start": 1.5, "stop": 1.9, "points": 512},
}
Results = dict[str, bytes]


def by_service(kill: bool = False) -> Results:
    """Return the results of a stack of its own; with `kill`, what computes is killed at each first tile."""
    with grazemap.local(workers=2) as client:
        results = {}
        for name, (process, body) in REQUESTS.items():
            job = client.submit(process, body)
            if kill:
                for event in job.events():
                    if event.name == "progress" and event.data["done"] > 0:
                        _kill_compute_processes(client._stack._process.pid)  # type: ignore[union-attr]
                        break
            results[name] = _bytes_of(job.wait(progress=False).result())
        return results


def _kill_compute_processes(stack: int) -> None:
    """Kill the processes that workers have forked for tiles: the grandchildren of the supervisor."""
    for child in psutil.Process(stack).children():
        if "grazemap_worker" in child.cmdline():
            for worker in child.children():
                for process in worker.children():
                    process.send_signal(signal.SIGKILL)


def by(executor: Executor | None, at_first_tile: Callable[[Direct], object] | None = None) -> Results:
    """Return the results of an executor, None for a pool of this machine; something may happen at each first tile."""
    results = {}
    with Direct(executor) as direct:
        for name, (process, body) in REQUESTS.items():
            happened: list[bool] = []

            def listen(event: str, _: dict[str, Any], happened: list[bool] = happened) -> None:
                if event == "progress" and at_first_tile is not None and not happened:
                    happened.append(True)
                    at_first_tile(direct)

            data = direct.compute(parse_request(process, body), listen)
            assert isinstance(data, bytes), data
            results[name] = data
    return results


def kill_pool(direct: Direct) -> None:
    """Kill one process of a pool."""
    if direct._pool is not None:
        os.kill(direct._pool.pids[0], signal.SIGKILL)


@contextmanager
def dask() -> Iterator[tuple[Executor, Callable[[Direct], None]]]:
    """Start a cluster of Dask with two processes; yield its executor, and a function that kills one of them."""
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:

        def kill(_: Direct) -> None:
            pid = next(iter(client.run(os.getpid).values()))
            os.kill(pid, signal.SIGKILL)

        yield client.get_executor(), kill


def by_mpi(folder: Path) -> Results:
    """Return the results of two ranks of MPI, one of which computes."""
    mpiexec = Path(sys.executable).with_name("mpiexec")
    # without -P, as these tests are found in the current folder only
    ranks = [sys.executable, "-m", "mpi4py.futures", "-m", "tests.slow.executors", str(folder)]
    command = [str(mpiexec), "-n", "3", *ranks]
    if os.getuid() == 0:
        command[1:1] = ["--allow-run-as-root"]
    command[1:1] = ["--oversubscribe"]
    subprocess.run(command, check=True, timeout=1200)
    return {name: (folder / f"{name}.npz").read_bytes() for name in REQUESTS}


def of_rank(folder: Path) -> None:
    """Compute all requests by the ranks of MPI, into a folder."""
    from mpi4py.futures import MPIPoolExecutor

    with MPIPoolExecutor() as executor:
        for name, data in by(executor).items():
            (folder / f"{name}.npz").write_bytes(data)


def by_array(folder: Path, tasks: int = 3) -> Results:
    """Return the results of an array of tasks: of Slurm where it runs, else of processes with its variables."""
    results = {}
    has_slurm = shutil.which("sinfo") is not None and subprocess.run(["sinfo"], capture_output=True).returncode == 0
    for name, (process, body) in REQUESTS.items():
        sweep, request = folder / name.replace(" ", "-"), folder / "request.json"
        request.write_text(json.dumps(body))
        assert cli.main(["plan", process, "--json", str(request), "-o", str(sweep)]) == 0
        tile = module_command("grazemap.cli", "tile", str(sweep))
        if has_slurm:
            submit = ["sbatch", "--wait", f"--array=0-{tasks - 1}", "--output=/dev/null", "--wrap", " ".join(tile)]
            subprocess.run(submit, check=True, timeout=1200)
        else:
            for task in range(tasks):
                array = {"ID": task, "MIN": 0, "MAX": tasks - 1, "COUNT": tasks, "STEP": 1}
                slurm = {f"SLURM_ARRAY_TASK_{key}": str(value) for key, value in array.items()}
                subprocess.run(tile, check=True, env={**os.environ, **slurm}, timeout=1200)
        result = folder / f"{sweep.name}.npz"
        assert cli.main(["assemble", str(sweep), "-o", str(result), "--quiet"]) == 0
        results[name] = result.read_bytes()
    return results


def overhead() -> float:
    """Return by how much a pool of one process is slower than a loop over the tiles, for a large map."""
    from grazemap_worker import direct as module

    request = parse_request("unfolding-maps", LARGE)
    module.available_cores = lambda: 1  # type: ignore[assignment]
    with Direct() as direct:
        direct.compute(parse_request(*REQUESTS["map"]), lambda *_: None)  # both load the kernels before
        began = time.monotonic()
        direct.compute(request, lambda *_: None)
        pool = time.monotonic() - began
    computation = module._computation(*module._as_text(request))
    module._load_kernels("maps")
    began = time.monotonic()
    tiles = [computation.tile(index).data for index in range(computation.plan.tile_count)]
    computation.result(tiles, lambda *_: None)
    loop = time.monotonic() - began
    print(f"512 x 512: {computation.plan.tile_count} tiles, a pool of one {pool:.1f} s, a loop {loop:.1f} s")
    return pool / loop - 1.0


def _bytes_of(result: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        result.save(Path(folder) / "result.npz")
        return (Path(folder) / "result.npz").read_bytes()


def main() -> int:
    """Print a line for each way; return 1 if bytes differ, or the overhead is too large."""
    expected, failed = by_service(), 0

    def compare(way: str, results: Results, took: float) -> None:
        nonlocal failed
        differ = [name for name in REQUESTS if results[name] != expected[name]]
        failed += bool(differ)
        print(f"{way:<28} {f'differ: {differ}' if differ else 'the same bytes'}, {took:.0f} s", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        ways: dict[str, Callable[[], Results]] = {
            "a service, killed": lambda: by_service(kill=True),
            "a pool": lambda: by(None),
            "a pool, killed": lambda: by(None, kill_pool),
            "Dask": lambda: _by_dask(False),
            "Dask, killed": lambda: _by_dask(True),
            "mpi4py": lambda: by_mpi(Path(folder)),
            "an array of Slurm": lambda: by_array(Path(folder)),
        }
        for way, compute in ways.items():
            began = time.monotonic()
            compare(way, compute(), time.monotonic() - began)
    share = overhead()
    print(f"overhead {100.0 * share:.1f} % (at most {100.0 * MOST_OVERHEAD:.0f} %)")
    return int(failed > 0 or share > MOST_OVERHEAD)


def _by_dask(killed: bool) -> Results:
    with dask() as (executor, kill):
        return by(executor, kill if killed else None)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        of_rank(Path(sys.argv[1]))
    else:
        sys.exit(main())
