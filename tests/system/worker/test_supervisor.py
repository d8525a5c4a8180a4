"""Real workers, supervisor and Redis: the work of killed processes is done again, and stopped processes end.

The tiles are planted (`planted.py`), so that nothing is compiled here.
"""

from __future__ import annotations

import json
import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import psutil
import pytest

from grazemap.codec import decode_npz
from grazemap.wire import Estimate, Job, UnfoldingMapsRequest, grid_values
from grazemap_service.redis_server import RedisServer
from grazemap_worker import system
from grazemap_worker.planning import Plan
from grazemap_worker.queue import wake_ups
from grazemap_worker.restarts import Restarts
from grazemap_worker.settings import LEASE_SECONDS, WorkerSettings
from grazemap_worker.store import Requester, Store, WaitingJob, connect, core_version
from grazemap_worker.store.keys import job_key
from grazemap_worker.supervision.kernels import Kernels
from grazemap_worker.supervision.watched import SharedWorkerState
from tests.support import submitting
from tests.support.hostile import hostile_entries
from tests.support.planted import NUMERICS, supervise
from tests.support.steps import job_of, lane_of, pending
from tests.support.watching import living, until

# supervisors are forked from a process that has loaded what they need, which takes seconds
FORKED = multiprocessing.get_context("forkserver")
FORKED.set_forkserver_preload(["pytest", "tests.support.planted"])
REQUEST = UnfoldingMapsRequest.model_validate(
    {"omega": {"start": 1, "stop": 2, "points": 6}, "clearance": {"start": 1, "stop": 3, "points": 4}}
)
SIX = Plan(rows=4, columns=6, tile_rows=2, tile_columns=2, estimate=Estimate(seconds=3.0))
ONE = Plan(rows=4, columns=6, tile_rows=4, tile_columns=6, estimate=Estimate(seconds=3.0))

NO_PROCESS = 1 << 22  # more than the id of any process

Start = Callable[..., psutil.Process]

HUNG_SECONDS = 3.0
HANGS_SOON = {"liveness.HUNG_SECONDS": HUNG_SECONDS}


def compute_processes(supervisor: psutil.Process) -> list[psutil.Process]:
    """The processes that compute tiles: grandchildren of the supervisor."""
    grandchildren: list[psutil.Process] = []
    for worker in supervisor.children():
        try:
            grandchildren += worker.children()
        except psutil.NoSuchProcess:
            continue
    return living(grandchildren)


@pytest.fixture
def start(redis_server: RedisServer, store: Store) -> Iterator[Start]:
    """Start supervisors, which end in order if nobody kills them; at the end nothing of them may be left."""
    started: list[BaseProcess] = []

    def begin(
        mode: str,
        workers: int = 2,
        limits: Mapping[str, float] | None = None,
        url: str = redis_server.url,
        log: str = "",
    ) -> psutil.Process:
        process = FORKED.Process(target=supervise, args=(url, workers, mode, limits, log))
        process.start()
        started.append(process)
        # as many for small tiles
        until(lambda: len(psutil.Process(process.pid).children()) == 2 * workers)
        return psutil.Process(process.pid)

    yield begin
    everything = [child for process in started if process.is_alive() for child in descendants(process.pid)]
    for process in started:
        process.terminate()
    for process in started:
        process.join(60)
        assert process.exitcode in (0, -signal.SIGKILL)
        process.close()
    until(lambda: not living(everything), 10)  # a killed process ends a moment later


def descendants(pid: int | None) -> list[psutil.Process]:
    return psutil.Process(pid).children(recursive=True)


def submit(store: Store, plan: Plan = SIX) -> Job:
    job, queue = submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 1000)
    assert queue is not None
    if queue.fingerprint:
        wake_ups.wake_worker(store.redis, queue.fingerprint, WaitingJob("unfolding-maps", job.id), small=queue.small)
    return job


def status(store: Store, identity: str) -> str:
    return job_of(store, identity).status


def assert_whole(store: Store, identity: str, tiles: int = SIX.tile_count) -> None:
    until(lambda: status(store, identity) not in ("accepted", "running"))
    job = job_of(store, identity)
    assert job.status == "successful", job.problem
    data = store.results.data(identity)
    assert data is not None
    document, meta = decode_npz(data)
    expected = grid_values(REQUEST.vertical.grid)[:, None] * grid_values(REQUEST.horizontal.grid)
    np.testing.assert_array_equal(document["product"], expected)
    assert meta["numerics"]["fingerprint"] == "planted"
    assert [event.name for event in store.jobs.events(identity)].count("tile") == tiles


def test_a_job_submitted_before_any_worker_is_found(start: Start, store: Store) -> None:
    job = submit(store)
    start("fast")
    assert_whole(store, job.id)


def test_a_tile_that_takes_longer_than_a_lease_is_computed_at_the_first_attempt(
    start: Start, store: Store, tmp_path: Path
) -> None:
    """The worker renews its lease meanwhile."""
    supervisor = start("long", workers=1, log=str(tmp_path / "log"))
    workers = supervisor.children()
    job = submit(store, ONE)
    assert_whole(store, job.id, ONE.tile_count)
    assert supervisor.children() == workers
    assert store.counts().events == {}
    records = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert [record["event"] for record in records] == ["supervisor started"]


def a_compute_process(supervisor: psutil.Process) -> tuple[psutil.Process, psutil.Process]:
    """A process that computes a tile, as soon as there is one, and its worker."""
    until(lambda: compute_processes(supervisor))
    process = compute_processes(supervisor)[0]
    worker = process.parent()
    assert worker is not None
    return process, worker


def test_a_killed_compute_process_loses_only_its_attempt(start: Start, store: Store) -> None:
    supervisor = start("slow")
    job = submit(store)
    a_compute_process(supervisor)[0].kill()
    assert_whole(store, job.id)


def test_the_compute_process_of_a_killed_worker_ends_and_its_tile_runs_again(start: Start, store: Store) -> None:
    supervisor = start("slow")
    job = submit(store)
    process, worker = a_compute_process(supervisor)
    worker.kill()
    until(lambda: not living([process]))
    until(lambda: len(supervisor.children()) == 4)
    assert_whole(store, job.id)


def test_a_worker_that_computes_ends_soon_at_sigterm_and_gives_its_tile_back(start: Start, store: Store) -> None:
    supervisor = start("endless", workers=1)
    job = submit(store)
    process, worker = a_compute_process(supervisor)
    worker.send_signal(signal.SIGTERM)
    until(lambda: not living([process, worker]), 5)
    a_compute_process(supervisor)  # of the worker that replaces it
    assert store.redis.exists(f"{job_key(job.id)}:failures") == 0
    store.jobs.dismiss(job.id)


@pytest.mark.skipif(not system.LINUX, reason="elsewhere a process does not end at once with its parent")
def test_tiles_of_a_machine_that_is_lost_are_computed_elsewhere(start: Start, store: Store) -> None:
    first = start("endless")
    job = submit(store)
    until(lambda: len(compute_processes(first)) == 2)
    start("fast")
    until(lambda: len(store.tiles.finished(job.id)) == SIX.tile_count - 2)
    everything = descendants(first.pid)
    first.kill()  # and with it, at once, all that it started
    assert len(everything) == 6
    until(lambda: not living(everything))
    assert_whole(store, job.id)


def test_dismissing_stops_the_work(start: Start, store: Store) -> None:
    supervisor = start("endless")
    job = submit(store)
    until(lambda: len(compute_processes(supervisor)) == 2)
    store.jobs.dismiss(job.id)
    until(lambda: not compute_processes(supervisor), 20)  # of a minute
    assert len(supervisor.children()) == 4
    assert store.counts().events == {}


def test_a_stopped_process_hands_its_tile_to_another(start: Start, store: Store) -> None:
    supervisor = start("slow", limits=HANGS_SOON)
    job = submit(store)
    stopped, _ = a_compute_process(supervisor)
    stopped.suspend()
    assert until(lambda: not living([stopped])) >= HUNG_SECONDS - 1
    assert_whole(store, job.id)
    assert store.counts().events == {"failures:hung": 1}


def test_stopped_workers_are_replaced(start: Start, store: Store) -> None:
    supervisor = start("slow", limits=HANGS_SOON)
    job = submit(store)
    a_compute_process(supervisor)
    stopped = [supervisor.children()[place] for place in (0, 2)]  # for small tiles, and for others
    for worker in stopped:
        worker.suspend()
    until(lambda: not living(stopped))
    until(lambda: len(supervisor.children()) == 4)
    assert_whole(store, job.id)


def test_a_hung_worker_that_ends_late_is_killed_and_counted_once(
    redis_server: RedisServer, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    from grazemap_worker.supervision import supervisor

    def next_round(self: supervisor.Supervisor) -> None:
        rounds.append(None)
        self._stopping = len(rounds) == 3

    def spawn(self: supervisor.Supervisor, slot: supervisor._Slot) -> None:
        slot.pid = NO_PROCESS

    rounds: list[None] = []
    kills: list[int] = []
    for name, value in {
        "_round": next_round,
        "_spawn": spawn,
        "_hangs": lambda self, slot: "" if slot.small else "it does not answer",
        "_reap": lambda self: None,
        "_stop_workers": lambda self: None,
    }.items():
        monkeypatch.setattr(supervisor.Supervisor, name, value)
    monkeypatch.setattr(supervisor, "INTERVAL_SECONDS", 0.0)
    monkeypatch.setattr(supervisor, "adopt_orphans", lambda: None)
    monkeypatch.setattr(signal, "signal", lambda number, handler: None)
    monkeypatch.setattr("os.kill", lambda pid, number: kills.append(pid))
    settings = WorkerSettings(redis_url=redis_server.url, workers=1)
    supervisor.Supervisor(settings, NUMERICS, Kernels(())).run()
    assert len(rounds) == 3
    assert kills == [NO_PROCESS]
    assert store.counts().events == {"hung:worker": 1}


def test_a_worker_that_continues_after_its_tile_was_computed_elsewhere_changes_nothing(
    start: Start, store: Store
) -> None:
    supervisor = start("slow")
    job = submit(store)
    pair = process, _ = a_compute_process(supervisor)
    for suspended in pair:
        suspended.suspend()
    until(lambda: store.counts().events == {"failures:lost": 1})
    until(lambda: len(store.tiles.finished(job.id)) == SIX.tile_count)
    for suspended in pair:
        suspended.resume()
    until(lambda: not living([process]))
    assert_whole(store, job.id)


SMALL = Plan(rows=4, columns=6, tile_rows=4, tile_columns=6)
MINUTES = SMALL.model_copy(update={"estimate": Estimate(seconds=344.0)})


def test_a_small_tile_that_does_not_end_is_computed_in_a_process_of_its_own(start: Start, store: Store) -> None:
    start("endless", workers=1, limits={"supervision.supervisor.SMALL_TILE_SECONDS": 1.0})
    assert SMALL.lane == "small"
    submit(store, SMALL)
    until(lambda: store.counts().events.get("overran:small") == 1)
    assert set(store.tiles.waiting("planted")) <= {("short", "maps")}


def asked(store: Store, name: str, milliseconds: int, plan: Plan, *, wake: bool = True) -> Job:
    """A job of a client whose tiles each compute for so long in the mode "asked"."""
    request = REQUEST.model_copy(update={"max_periods": milliseconds})
    requester = Requester(f"client:{name}")
    job, _ = submitting.submit(store, "unfolding-maps", request, core_version(), plan, 1000, requester)
    if wake:
        wake_ups.wake_worker(store.redis, "planted", WaitingJob("unfolding-maps", job.id), small=plan.lane == "small")
    return job


def test_innocent_small_tiles_stay_small_and_are_answered_beside_unfair_ones(start: Start, store: Store) -> None:
    unfair = [asked(store, "unfair", 60_000 + k, SMALL, wake=False) for k in range(3)]
    innocent = [asked(store, "unfair", 1 + k, SMALL, wake=False) for k in range(3)]
    start("asked", workers=2, limits={"supervision.supervisor.SMALL_TILE_PROCESSOR_SECONDS": 0.5})
    until(lambda: store.counts().jobs["running"] > 0)
    others = [asked(store, "fair", 10 + k, SMALL) for k in range(3)]
    until(lambda: all(status(store, job.id) == "successful" for job in others))
    until(lambda: store.counts().events.get("overran:small") == len(unfair))
    until(lambda: all(status(store, job.id) == "successful" for job in innocent))
    assert [lane_of(store, job.id) for job in innocent + others] == ["small"] * 6
    assert [lane_of(store, job.id) for job in unfair] == ["short"] * 3
    assert set(store.counts().events) == {"overran:small"}
    for job in unfair:
        store.jobs.dismiss(job.id, everyone=True)


def test_one_worker_stops_a_long_tile_for_a_short_job_and_continues_it(start: Start, store: Store) -> None:
    supervisor = start("asked", workers=1, limits={"tasks.STOPPED_AFTER_SECONDS": 0.5})
    long = asked(store, "first", 600_000, MINUTES)
    process, _ = a_compute_process(supervisor)
    short = asked(store, "other", 100, SIX)
    until(lambda: process.status() == psutil.STATUS_STOPPED)
    until(lambda: status(store, short.id) == "successful")
    until(lambda: process.status() != psutil.STATUS_STOPPED)
    assert status(store, long.id) == "running"
    assert compute_processes(supervisor) == [process]
    store.jobs.dismiss(long.id, everyone=True)
    assert store.counts().events == {}


@pytest.fixture
def own(own_redis_server: RedisServer) -> Iterator[Store]:
    """An empty store on a Redis that the test may stop or fill."""
    client = connect(own_redis_server.url)
    yield Store(client)
    client.close()


TRIES = [0, *(pytest.param(k, marks=pytest.mark.thorough) for k in range(1, 10))]


@pytest.mark.parametrize("attempt", TRIES)
def test_a_full_redis_loses_no_tile(start: Start, own_redis_server: RedisServer, own: Store, attempt: int) -> None:
    start("slow", url=own_redis_server.url)
    job = submit(own)
    until(lambda: own.tiles.finished(job.id))
    own.redis.config_set("maxmemory", 1)
    time.sleep(LEASE_SECONDS + 1.0 + 0.1 * attempt)
    assert own.tiles.finished(job.id) != []
    own.redis.config_set("maxmemory", 0)
    assert_whole(own, job.id)
    assert {kind for kind in own.counts().events if kind.startswith("failures")} == set()


def test_a_tile_that_raises_fails_the_job_after_three_tries(start: Start, store: Store) -> None:
    start("raises")
    job = submit(store)
    until(lambda: status(store, job.id) == "failed")
    failed = job_of(store, job.id)
    assert failed.problem is not None
    assert failed.problem.type == "urn:grazemap:problem:computation-failed"
    assert "secret" not in failed.model_dump_json()


def test_a_tile_that_kills_its_worker_is_tried_again_and_counted_as_lost(start: Start, store: Store) -> None:
    start("dies")
    job = submit(store)

    def lost() -> int:
        failures = store.redis.hgetall(f"{job_key(job.id)}:failures")
        assert isinstance(failures, dict)
        assert not any(b"exception" in name for name in failures)
        return max((int(count) for count in failures.values()), default=0)

    until(lambda: lost() >= 2)
    assert status(store, job.id) == "running"
    store.jobs.dismiss(job.id)


def test_redis_may_restart_under_a_running_map(start: Start, own_redis_server: RedisServer, own: Store) -> None:
    supervisor = start("slow", url=own_redis_server.url)
    job = submit(own)
    until(lambda: own.tiles.finished(job.id))
    own_redis_server.stop()
    time.sleep(0.5)
    own_redis_server.start()
    own_redis_server.wait()
    assert_whole(own, job.id)
    assert supervisor.is_running()


def test_a_supervisor_that_is_stopped_gives_its_tiles_back(start: Start, store: Store) -> None:
    supervisor = start("endless")
    job = submit(store)
    until(lambda: len(compute_processes(supervisor)) == 2)
    everything = descendants(supervisor.pid)
    supervisor.send_signal(signal.SIGTERM)
    until(lambda: not living([supervisor]), 30)
    until(lambda: not living(everything), 10)  # a killed process ends a moment later
    assert store.workers.live() == []
    assert len(pending(store, "planted")) == SIX.tile_count
    assert store.redis.exists(f"{job_key(job.id)}:failures") == 0


def test_entries_of_other_programs_are_not_executed(start: Start, store: Store, tmp_path: Path) -> None:
    queue = wake_ups.queue(store.redis, "planted", small=False)
    hostile = [entry for entry, _ in hostile_entries(tmp_path, queue)]
    for entry in hostile:
        queue.enqueue_job(entry)
    store.redis.hset(f"rq:job:{hostile[-1].id}", "rate_limit_concurrency", "not a number")
    supervisor = start("fast", workers=1)
    workers = supervisor.children()
    job = submit(store)
    assert_whole(store, job.id)
    assert supervisor.children() == workers
    assert list(tmp_path.iterdir()) == []
    until(lambda: not any(store.redis.exists(f"rq:job:{entry.id}") for entry in hostile))
    ids = {entry.id.encode() for entry in hostile}
    until(lambda: ids.isdisjoint(store.redis.lrange(queue.intermediate_queue_key, 0, -1)))


def test_signs_of_life_of_the_worker_before_do_not_count() -> None:
    state = SharedWorkerState.shared()
    state.beat()
    state.reset()
    assert not state.heard()
    state.beat()
    assert state.heard()
    assert not state.heard()


def test_a_process_that_ends_again_and_again_is_started_without_end() -> None:
    restarts = Restarts()
    for _ in range(5000):
        restarts.started()
        restarts.ended()
    assert not restarts.due
