"""A supervisor whose maps are products of their axes: real workers, queues and store, no core.

Run as `python planted.py REDIS_URL WORKERS MODE`, or `supervise` in a process of its own. What a tile does besides
depends on MODE: "fast"; "slow" (computes for two ticks of the clock of processor time, so that it is seen to make
progress, and sleeps 0.6 s); "long" (sleeps for longer than a lease); "busy" (computes for
BUSY_SECONDS); "asked" (computes for as many milliseconds as `max_periods` says); "endless" (sleeps a minute); "raises";
"dies" (kills its own process).
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Mapping
from importlib import import_module

import numba.core.event  # noqa: F401 - loaded before the workers are forked, as by the compiling of kernels
from numba.core.registry import cpu_target

import grazemap_core.errors  # noqa: F401 - which a tile would load
from grazemap.codec import Document
from grazemap.wire import UnfoldingMapsRequest, grid_values
from grazemap_worker import computation, logs
from grazemap_worker.numerics import Numerics
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes import Process
from grazemap_worker.processes.conversion import Report, join_tiles
from grazemap_worker.queue import tile_worker  # noqa: F401
from grazemap_worker.settings import LEASE_SECONDS, WorkerSettings
from grazemap_worker.store import WaitingJob, WorkerInfo, core_version
from grazemap_worker.supervision.kernels import Kernels
from grazemap_worker.supervision.supervisor import Supervisor

# what the first call of a kernel loads, too
cpu_target.typing_context.refresh()
cpu_target.target_context.refresh()

BUSY_SECONDS = 0.1
LONG_SECONDS = LEASE_SECONDS + 0.5

NUMERICS = Numerics("0", "0", "0", "0", "planted", "none", "planted")
INFO = WorkerInfo("w", NUMERICS.fingerprint, core_version(), frozenset({"curves", "trajectories", "maps"}))
WAITING = WaitingJob("unfolding-maps", "a1")


def product_tile(request: UnfoldingMapsRequest, tile: Tile) -> Document:
    """The rectangle of clearance times omega."""
    row_start, row_stop, column_start, column_stop = tile
    omega = grid_values(request.horizontal.grid)[column_start:column_stop]
    clearance = grid_values(request.vertical.grid)[row_start:row_stop]
    return {"product": clearance[:, None] * omega}


def compute_for(seconds: float) -> None:
    """Keep the processor busy."""
    began = time.thread_time()
    while time.thread_time() < began + seconds:
        pass


def planted(mode: str) -> Process:
    """The process that `mode` asks for."""

    def tile(request: UnfoldingMapsRequest, rectangle: Tile) -> Document:
        if mode == "slow":
            compute_for(2.0 / os.sysconf("SC_CLK_TCK"))
            time.sleep(0.6)
        elif mode == "long":
            time.sleep(LONG_SECONDS)
        elif mode == "busy":
            compute_for(BUSY_SECONDS)
        elif mode == "asked":
            compute_for(1e-3 * request.max_periods)
        elif mode == "endless":
            time.sleep(60)
        elif mode == "raises":
            raise ZeroDivisionError("a secret of the worker")
        elif mode == "dies":
            os.kill(os.getpid(), signal.SIGKILL)
        return product_tile(request, rectangle)

    def assembled(request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], report: Report) -> Document:
        if mode == "busy":
            compute_for(BUSY_SECONDS)
        return join_tiles(plan, tiles)

    return Process(tile=tile, assembled=assembled)


def supervise(
    redis_url: str, workers: int, mode: str, limits: Mapping[str, float] | None = None, log: str = ""
) -> None:
    """Run a supervisor until it is asked to stop.

    Parameters
    ----------
    redis_url, workers, mode : str, int, str
        Its store, its workers, and what their tiles do.
    limits : mapping, optional
        Other values of constants of `grazemap_worker`, by module and name, as "liveness.HUNG_SECONDS".
    log : str
        A file for its log, instead of stderr.
    """
    if log:
        os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT), sys.stderr.fileno())
    for place, value in (limits or {}).items():
        module, _, name = place.rpartition(".")
        assert hasattr(import_module(f"grazemap_worker.{module}"), name)
        setattr(import_module(f"grazemap_worker.{module}"), name, value)
    logs.configure("INFO")
    computation.IMPLEMENTATIONS = {"unfolding-maps": planted(mode)}
    settings = WorkerSettings(redis_url=redis_url, workers=workers, result_bytes=1 << 20)
    kernels = Kernels(())
    kernels.ready |= INFO.kernels
    kernels.advance()
    Supervisor(settings, NUMERICS, kernels).run()


if __name__ == "__main__":
    supervise(sys.argv[1], int(sys.argv[2]), sys.argv[3])
