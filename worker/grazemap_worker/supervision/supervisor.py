"""The supervisor of one machine's workers.

It forks the workers from its main thread. The workers share the compiled code, so a new worker starts in 20 ms instead
of seconds. When more kernels are compiled, new workers that have them replace the others. The supervisor replaces
workers that end, and ends their leases, so that other workers compute their tiles. It runs the reconciler every second.
When the supervisor ends, even if it is killed, its workers end with it.
"""

from __future__ import annotations

import os
import secrets
import signal
import socket
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from types import FrameType

import structlog
from redis.exceptions import RedisError

from grazemap_worker import watchdog
from grazemap_worker.liveness import Liveness
from grazemap_worker.numerics import Numerics
from grazemap_worker.queue import clean_up
from grazemap_worker.restarts import Restarts
from grazemap_worker.settings import LEASE_SECONDS, WorkerSettings
from grazemap_worker.store import Store, WorkerInfo, core_version, trouble
from grazemap_worker.supervision.kernels import Kernels
from grazemap_worker.supervision.reconciler import INTERVAL_SECONDS, Reconciler
from grazemap_worker.supervision.watched import SharedWorkerState
from grazemap_worker.system import adopt_orphans, die_with_parent, limit_memory, orphaned, release_memory

_POLL_SECONDS = 0.1
# Maximum number of workers for small tiles. The service is one process: more workers would only wait for its requests.
MAX_SMALL_WORKERS = 4
# Limits of a small tile, which is expected to take milliseconds: of its processor time, and of the time that passes.
# The supervisor kills a worker whose small tile exceeds one of them, before the lease of the worker runs out. The tile
# is then computed again, in a compute process, which another worker forks for it.
SMALL_TILE_PROCESSOR_SECONDS = 2.0
SMALL_TILE_SECONDS = 0.7 * LEASE_SECONDS
# A worker gives a sign of life every few seconds. A worker that is silent for this long counts as hung.
_SILENT_SECONDS = 120.0
_STOP_SECONDS = 2.0
# Attempts of a Redis command of a worker; with pauses of 0.05, 0.1, ..., 1, 1 ... s they last about ten seconds.
_WORKER_TRIES = 14


@dataclass
class _Slot:
    """One place for a worker."""

    small: bool
    """Whether the worker computes small tiles only."""
    watched: SharedWorkerState = field(default_factory=SharedWorkerState.shared)
    """What the worker shares with the supervisor."""
    restarts: Restarts = field(default_factory=Restarts)
    """When the worker may be started again."""
    liveness: Liveness | None = None
    """Tells whether the worker hangs."""
    pid: int = 0
    """Process id of the worker; 0: none runs."""
    name: str = ""
    """Name of the worker."""
    overran: bool = False
    """Whether the worker was killed because its small tile took too long."""
    killed: bool = False
    """Whether the supervisor has killed the worker, which may end a moment later."""


class Supervisor:
    """Keeps workers alive until it is asked to stop.

    There are `settings.workers` workers, and as many for small tiles, but at most `MAX_SMALL_WORKERS`.
    """

    def __init__(self, settings: WorkerSettings, numerics: Numerics, kernels: Kernels) -> None:
        self._settings = settings
        self._numerics = numerics
        self._name = f"{socket.gethostname()}-{secrets.token_hex(4)}"
        self._store = Store(settings.connect(), settings.result_bytes)
        self._reconciler = Reconciler(self._store, numerics, self._name)
        self._kernels = kernels
        small = min(settings.workers, MAX_SMALL_WORKERS)
        self._slots = [_Slot(small=True) for _ in range(small)] + [_Slot(small=False) for _ in range(settings.workers)]
        self._stopping = False
        self._log = structlog.get_logger("grazemap_worker")

    def run(self) -> None:
        """Run until SIGTERM or SIGINT; call it from the main thread."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._stop)
        adopt_orphans()
        release_memory()  # what loading needed, before workers are forked
        self._log.info("supervisor started", workers=self._settings.workers, fingerprint=self._numerics.fingerprint)
        next_round = 0.0
        redis_away = False
        while not self._stopping:
            self._reap()
            now = time.monotonic()
            for slot in self._slots:
                if not slot.pid and slot.restarts.due:
                    self._spawn(slot)
                elif slot.pid and not slot.killed:
                    self._kill_if_it_hangs(slot)
            if now >= next_round:
                next_round = now + INTERVAL_SECONDS
                try:
                    with watchdog.beating():  # a round may take longer than the time between two signs of life
                        self._round()
                    redis_away = False
                except RedisError as error:
                    if not redis_away:
                        self._log.warning(trouble(error), error=type(error).__name__)
                    redis_away = True
                except Exception:
                    # an exception, for example from data that another program wrote to Redis, must not end the workers
                    self._log.exception("a round of the reconciler failed")
            if self._kernels.advance():
                release_memory()
                for slot in self._slots:
                    slot.watched.asked_to_stop = True  # its successor has the new kernels too
                continue
            time.sleep(_POLL_SECONDS)
        self._kernels.stop()
        self._stop_workers()

    def _round(self) -> None:
        self._kernels.want(self._reconciler.reconcile())
        waits = self._kernels.waits()
        texts = self._kernels.status_texts(waits)
        for name, text in texts.items():
            self._store.workers.set_compiling(name, text)
        self._store.workers.set_starting(next(iter(texts.values()), ""))
        self._store.workers.set_waits(waits)

    def _kill_if_it_hangs(self, slot: _Slot) -> None:
        reason = self._hangs(slot)
        if reason:
            self._log.warning("worker killed", worker=slot.name, reason=reason)
            if not slot.overran:
                self._count("hung:worker")
            slot.killed = True
            os.kill(slot.pid, signal.SIGKILL)

    def _hangs(self, slot: _Slot) -> str:
        """Return why a worker must be killed; empty if it goes on."""
        if slot.liveness is not None and (reason := slot.liveness.hangs(heard=slot.watched.heard())):
            return reason
        if slot.watched.tile_began and (
            time.monotonic() - slot.watched.tile_began > SMALL_TILE_SECONDS
            or self._small_tile_seconds(slot) > SMALL_TILE_PROCESSOR_SECONDS
        ):
            slot.overran = True
            return "a small tile took too long"
        return ""

    @staticmethod
    def _small_tile_seconds(slot: _Slot) -> float:
        """Return the processor time that a worker has spent on its small tile."""
        return slot.liveness.cpu_seconds - slot.watched.processor_time_at_begin if slot.liveness is not None else 0.0

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self._stopping = True

    def _spawn(self, slot: _Slot) -> None:
        slot.name = f"{self._name}-{secrets.token_hex(4)}"
        slot.restarts.started()
        slot.watched.reset()
        slot.overran = slot.killed = False
        info = WorkerInfo(
            slot.name, self._numerics.fingerprint, core_version(), frozenset(self._kernels.ready), slot.small
        )
        parent = os.getpid()
        sys.stdout.flush()
        sys.stderr.flush()
        slot.pid = os.fork()
        if slot.pid == 0:
            status = 1
            try:
                _be_a_worker(self._settings, self._numerics, info, slot.watched, parent)
                status = 0
            except RedisError as error:
                self._log.warning("worker ended", reason=trouble(error), error=type(error).__name__)
            except BaseException:
                self._log.exception("worker ended")
            finally:
                os._exit(status)  # never return into the supervisor's code
        slot.liveness = Liveness(slot.pid, silent_seconds=_SILENT_SECONDS, first_seconds=_SILENT_SECONDS)

    def _reap(self) -> None:
        """Wait for every child that has ended: workers, compiling processes, and compute processes of dead workers."""
        by_pid = {slot.pid: slot for slot in self._slots if slot.pid}
        while (ended := _ended_child()) is not None:
            pid, status = ended
            slot = by_pid.get(pid)
            if slot is None:
                self._kernels.ended(pid, os.waitstatus_to_exitcode(status))
                continue
            slot.pid = 0
            if slot.watched.asked_to_stop and status == 0:
                continue
            slot.restarts.ended(blameless=slot.overran)
            self._log.warning("worker ended", worker=slot.name, status=os.waitstatus_to_exitcode(status))
            self._forget(slot.name, return_claims=self._blame(slot))
            if not slot.overran:
                self._count("ended:worker")

    def _blame(self, slot: _Slot) -> bool:
        """Free the small tile that an ended worker computed, if it computed one; return whether it did.

        A tile that took too long moves to the next lane; otherwise a failure of the tile is counted. Then the other
        claims of the worker are not to blame, and are given back without counting a failure.
        """
        if not slot.watched.tile_began:
            return False
        job_id = slot.watched.job.decode()
        try:  # a small job has one tile, 0
            if slot.overran:
                self._store.tiles.move_to_next_lane(job_id, 0, slot.name, self._small_tile_seconds(slot))
            else:
                self._store.tiles.record_failure(job_id, 0, "lost", slot.name)
        except RedisError:
            return False
        return True

    def _count(self, name: str) -> None:
        with suppress(RedisError):  # then only the log has it
            self._store.count(name)

    def _forget(self, name: str, *, return_claims: bool) -> None:
        """Remove a dead worker from the store; if Redis is unavailable, its lease runs out instead.

        With `return_claims` its tiles are free at once and no failure is counted. Without, they count as lost.
        """
        watchdog.beat()  # this may wait for Redis
        try:
            self._store.workers.remove(name, return_claims=return_claims)
            clean_up.forget_worker(self._store.redis, name, self._numerics.fingerprint)
        except RedisError as error:
            self._log.info("a worker's lease is left to run out", worker=name, error=type(error).__name__)

    def _stop_workers(self) -> None:
        """Let the workers finish within `_STOP_SECONDS`, kill those that have not ended, and give back their tiles."""
        alive = {slot.pid: slot for slot in self._slots if slot.pid}
        for pid in alive:
            os.kill(pid, signal.SIGTERM)
        deadline = time.monotonic() + _STOP_SECONDS
        killed = False
        while alive:
            while (ended := _ended_child()) is not None:
                slot = alive.pop(ended[0], None)
                if slot is not None:
                    self._forget(slot.name, return_claims=True)
            if alive and not killed and time.monotonic() > deadline:
                killed = True
                for pid in alive:
                    os.kill(pid, signal.SIGKILL)
            time.sleep(0.02)
        self._log.info("supervisor stopped")


def _ended_child() -> tuple[int, int] | None:
    """Return (process id, wait status) of a child that has ended, or None."""
    try:
        pid, status = os.waitpid(-1, os.WNOHANG)
    except ChildProcessError:
        return None
    return (pid, status) if pid else None


def _be_a_worker(
    settings: WorkerSettings, numerics: Numerics, info: WorkerInfo, watched: SharedWorkerState, parent: int
) -> None:
    """Turn this forked process into a worker, and work until asked to stop."""
    from grazemap_worker import tasks
    from grazemap_worker.queue.tile_worker import TileWorker

    die_with_parent(parent)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)  # until RQ installs the handlers of the worker
    os.setpgrp()  # an interrupt from the terminal is for the supervisor
    if info.small:
        limit_memory(settings.memory_bytes)

    def stopping() -> bool:
        return watched.asked_to_stop or orphaned()

    store = Store(settings.connect(_WORKER_TRIES), settings.result_bytes)
    memory, report = settings.memory_bytes, watched.report_small_tile

    def beat() -> None:
        watched.beat()
        worker.stay_shown()

    context = tasks.WorkerContext(store, info, numerics, memory, report, lambda job: worker.show(job), beat, stopping)
    worker = TileWorker(store, info, lambda: tasks.compute_waiting_tiles(context), watched.beat, stopping)
    worker.work(logging_level=None)
