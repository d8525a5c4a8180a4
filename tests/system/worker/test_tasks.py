"""`compute_waiting_tiles` with planted processes: what a worker computes, and the problem when that fails."""

from __future__ import annotations

import os
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import redis.exceptions

from grazemap.codec import Document, decode_npz
from grazemap.wire import Estimate, GrazingCurvesRequest, Job, UnfoldingMapsRequest, grid_values
from grazemap_core.errors import ParameterError
from grazemap_worker import computation, system, tasks
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes import Process
from grazemap_worker.processes.conversion import Report
from grazemap_worker.queue import compute_process
from grazemap_worker.queue.compute_process import Activity, ComputeProcess, ProcessEnd, SharedState
from grazemap_worker.queue.tile_worker import StopWorker
from grazemap_worker.store import ASSEMBLY, Finished, Store, WorkerInfo, core_version
from tests.support import parsing, submitting
from tests.support.planted import BUSY_SECONDS, INFO, NUMERICS, compute_for, planted
from tests.support.steps import commit_tile, job_of, problem_of

REQUEST = UnfoldingMapsRequest(omega=[1, 2, 3], clearance=[1, 2])
LONG = Plan(estimate=Estimate(seconds=1.0))
TWO = Plan(rows=2, columns=3, tile_rows=1, tile_columns=3, estimate=Estimate(seconds=1.0))
ONE = Plan(rows=2, columns=3, tile_rows=2, tile_columns=3, estimate=Estimate(seconds=1.0))


MEMORY_IS_LIMITED = pytest.mark.skipif(not system.LINUX, reason="memory is limited on Linux alone")
SMALL = replace(INFO, name="s", small=True)


@pytest.fixture
def worker(store: Store, monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """This process as a worker of planted maps."""
    store.workers.renew(INFO, 60)
    monkeypatch.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": planted("fast")})
    return monkeypatch


def compute_all(store: Store, info: WorkerInfo = INFO, tiles: int = 1000) -> None:
    """Compute what is to be claimed, or a number of tiles of it."""
    left = iter([False] * tiles)
    tasks.compute_waiting_tiles(tasks.WorkerContext(store, info, NUMERICS, stopping=lambda: next(left, True)))


def submit(store: Store, plan: Plan = TWO) -> Job:
    return submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 100)[0]


def submit_curve(store: Store, number: int = 0, plan: Plan = Plan()) -> Job:  # noqa: B008
    request = GrazingCurvesRequest(omega=[1, 2 + number])
    return submitting.submit(store, "grazing-curves", request, core_version(), plan, 100)[0]


def whole(store: Store, identity: str) -> bytes:
    data = store.results.data(identity)
    assert data is not None
    return data


def test_the_last_tile_starts_the_assembly_of_the_map(worker: object, store: Store) -> None:
    job = submit(store)
    compute_all(store, tiles=1)
    assert store.results.data(job.id) is None
    tile, meta = decode_npz(store.tiles.data(job.id, 0) or b"")
    np.testing.assert_array_equal(tile["product"], [[1, 2, 3]])
    assert meta["tile"] == {"index": 0, "rows": [0, 1], "columns": [0, 3]}
    compute_all(store, tiles=1)
    document, meta = decode_npz(whole(store, job.id))
    np.testing.assert_array_equal(document["product"], [[1, 2, 3], [2, 4, 6]])
    assert meta["request"]["max_periods"] == 1000
    assert "tile" not in meta


@pytest.mark.parametrize("mode", ["busy", "slow"])
def test_processor_time_of_tiles_and_assembly_is_counted(worker: pytest.MonkeyPatch, store: Store, mode: str) -> None:
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": planted(mode)})
    job = submit(store)
    compute_all(store)
    done = job_of(store, job.id)
    assert done.status == "successful"
    assert done.cpu_seconds is not None
    busy = 3 * BUSY_SECONDS if mode == "busy" else 0.0  # one that sleeps computes nothing
    assert busy <= done.cpu_seconds < busy + BUSY_SECONDS


def test_the_bytes_do_not_depend_on_the_cut(worker: object, store: Store) -> None:
    job = submit(store)
    compute_all(store)
    cut_in_two = whole(store, job.id)
    store.redis.flushall()
    store.workers.renew(INFO, 60)
    assert submit(store, ONE).id == job.id
    compute_all(store)
    assert whole(store, job.id) == cut_in_two


def test_when_the_assembling_worker_dies_another_assembles(worker: object, store: Store) -> None:
    job = submit(store)
    compute_all(store, tiles=1)
    assert store.tiles.claim(job.id, 1, "dead", "planted", 5)
    assert commit_tile(store, job.id, 1, store.tiles.data(job.id, 0) or b"", "planted", 0.0) == 0
    assert store.tiles.claim(job.id, ASSEMBLY, "dead", "planted", 5)
    compute_all(store)
    assert store.results.data(job.id) is None  # it is held
    store.workers.remove("dead")
    assert store.tiles.claims_of() == [(job.id, ASSEMBLY, "dead")]
    store.tiles.record_failure(job.id, ASSEMBLY, "lost", "dead")
    compute_all(store)
    assert whole(store, job.id)


def test_small_tiles_are_computed_in_the_worker_and_committed_together(
    worker: pytest.MonkeyPatch, store: Store
) -> None:
    processes = []

    def compute(request: GrazingCurvesRequest, report: object) -> Document:
        processes.append(os.getpid())
        return {"x": np.zeros(1)}

    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=compute)})
    jobs = [submit_curve(store, number) for number in range(20)]
    store.redis.config_resetstat()
    watched: list[str] = []
    tasks.compute_waiting_tiles(tasks.WorkerContext(store, SMALL, NUMERICS, report_small_tile=watched.append))
    assert processes == [os.getpid()] * 20
    assert watched == [identity for job in jobs for identity in (job.id, "")]
    assert [store.jobs.status(job.id) for job in jobs] == ["successful"] * 20
    calls = store.redis.info("commandstats")["cmdstat_evalsha"]["calls"]
    assert calls < 20  # two commits, three visits for claims, renewals


@pytest.mark.parametrize("info", [INFO, SMALL], ids=["a process", "small"])
def test_tiles_of_a_claim_whose_answer_was_lost_are_computed(
    worker: pytest.MonkeyPatch, store: Store, info: WorkerInfo
) -> None:
    store.workers.renew(info, 60)
    if info.small:
        curves = Process(whole=lambda request, report: {"x": np.zeros(1)})
        worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": curves})
    job = submit_curve(store) if info.small else submit(store)
    claims, _ = store.tiles.claim_next(info, 60.0)
    assert claims
    compute_all(store, info)
    assert store.jobs.status(job.id) == "successful"


def noting(file: Path, compute: Callable[[int], None]) -> Process:
    """A map whose tiles call `compute` with their row, and append the row and their process to a file."""
    plain = planted("fast")

    def tile(request: UnfoldingMapsRequest, rectangle: Tile) -> Document:
        compute(rectangle[0])
        with file.open("a") as notes:
            notes.write(f"{rectangle[0]} {os.getpid()}\n")
        assert plain.tile is not None
        return plain.tile(request, rectangle)

    return Process(tile=tile, assembled=plain.assembled)


def noted(file: Path) -> list[list[int]]:
    """The rows of the tiles of every process, in the order in which these began."""
    rows: dict[str, list[int]] = {}
    for line in file.read_text().splitlines():
        row, process = line.split()
        rows.setdefault(process, []).append(int(row))
    return list(rows.values())


ROWS = Plan(rows=6, columns=3, tile_rows=1, tile_columns=3, estimate=Estimate(seconds=1.0))
SIX = UnfoldingMapsRequest(omega=[1, 2, 3], clearance=[1, 2, 3, 4, 5, 6])


def submit_six(store: Store, request: UnfoldingMapsRequest = SIX) -> Job:
    return submitting.submit(store, "unfolding-maps", request, core_version(), ROWS, 100)[0]


def test_a_long_tile_outlives_an_outage_that_ends_a_short_one(worker: pytest.MonkeyPatch, store: Store) -> None:
    long, short = submit_curve(store, plan=Plan(estimate=Estimate(seconds=60.0))), submit(store)
    held = [(long.id, 0, INFO.name)]
    assert store.tiles.claim(long.id, 0, INFO.name, INFO.fingerprint, 60)

    def fail(*_: object) -> None:
        raise redis.exceptions.ConnectionError

    worker.setattr(tasks, "STOPPED_AFTER_SECONDS", 0.0)
    worker.setattr(tasks, "WAITED_SECONDS", 0.0)
    worker.setattr(tasks, "_compute_in_process", fail)
    interruptions = tasks._Interruptions(tasks.WorkerContext(store, INFO, NUMERICS))
    activity = Activity(long.id, True, 0.0, 100.0, False)
    action = interruptions.next(activity)
    assert action is not None
    action()  # the paused process would end with an exception
    assert len(store.tiles.claims_of(INFO.name)) == 2
    interruptions._not_before = 0.0
    again = interruptions.next(activity)  # the tile of the short job was freed, and is claimed again
    assert again is not None
    assert sorted(store.tiles.claims_of(INFO.name)) == sorted([*held, (short.id, 0, INFO.name)])


def test_tiles_share_a_process_until_it_has_worked_for_a_while(
    worker: pytest.MonkeyPatch, store: Store, tmp_path: Path
) -> None:
    worker.setattr(tasks, "TILE_SECONDS", 2.9 * 2 * BUSY_SECONDS)  # fewer than three tiles, commits included
    maps = noting(tmp_path / "notes", lambda row: compute_for(2 * BUSY_SECONDS))
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": maps})
    job = submit_six(store)
    compute_all(store)
    assert store.jobs.status(job.id) == "successful"
    assert noted(tmp_path / "notes") == [[0, 1, 2], [3, 4, 5]]


def test_a_process_goes_on_with_the_next_job(worker: pytest.MonkeyPatch, store: Store, tmp_path: Path) -> None:
    worker.setattr(tasks, "_RENEW_SECONDS", 0.0)  # whether the job is wanted is asked all the time
    worker.setattr(compute_process, "_LOOK_SECONDS", 0.001)
    maps = noting(tmp_path / "notes", lambda row: time.sleep(0.02))
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": maps})
    jobs = [submit_six(store, SIX.model_copy(update={"max_periods": 10 + k})) for k in range(3)]
    compute_all(store)
    assert [store.jobs.status(job.id) for job in jobs] == ["successful"] * 3
    (rows,) = noted(tmp_path / "notes")
    assert sorted(rows) == sorted(3 * list(range(6)))
    assert store.counts().events.get("failures:lost", 0) == 0


def test_a_tile_after_others_in_its_process_fails_alone(
    worker: pytest.MonkeyPatch, store: Store, tmp_path: Path
) -> None:
    def die_once(row: int) -> None:
        if row == 2 and not (tmp_path / "died").exists():
            (tmp_path / "died").touch()
            os.kill(os.getpid(), signal.SIGKILL)

    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": noting(tmp_path / "notes", die_once)})
    job = submit_six(store)
    compute_all(store)
    assert store.jobs.status(job.id) == "successful"
    first, second = noted(tmp_path / "notes")
    assert first == [0, 1]
    assert sorted(second) == [2, 3, 4, 5]
    assert store.counts().events["failures:lost"] == 1


def test_the_limit_of_a_tile_counts_from_its_own_start(
    worker: pytest.MonkeyPatch, store: Store, tmp_path: Path
) -> None:
    worker.setattr(tasks, "EXTRA_CPU_SECONDS", 0.3)
    worker.setattr(tasks, "CPU_FACTOR", 0.0)
    worker.setattr(compute_process, "_LOOK_SECONDS", 0.01)
    maps = noting(tmp_path / "notes", lambda row: compute_for(1.0 if row == 5 else 0.1))
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": maps})
    job = submit_six(store)
    compute_all(store)
    problem = problem_of(store, job.id)
    assert problem.type == "urn:grazemap:problem:computation-too-long"
    assert "tile 5" in problem.detail.lower()
    assert noted(tmp_path / "notes") == [[0, 1, 2, 3, 4]]


def test_one_that_fails_among_small_tiles_fails_alone(worker: pytest.MonkeyPatch, store: Store) -> None:
    def compute(request: GrazingCurvesRequest, report: object) -> Document:
        if float(np.max(grid_values(request.axis.values))) == 4.0:
            raise ZeroDivisionError
        return {"x": np.zeros(1)}

    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=compute)})
    jobs = [submit_curve(store, number) for number in range(5)]
    compute_all(store, SMALL)
    assert [store.jobs.status(job.id) for job in jobs] == ["successful"] * 2 + ["running"] + ["successful"] * 2
    compute_all(store)  # in a process of its own
    assert store.jobs.status(jobs[2].id) == "failed"


def aborted_near_the_limit() -> None:
    keep = bytearray(b"1" * (160 << 20))
    os.abort()
    del keep


@pytest.mark.parametrize(
    ("compute", "limits", "megabytes", "kind", "events"),
    [
        pytest.param(
            lambda: bytearray(300 << 20), {}, 200, "too-much-memory", {"failures:memory": 1}, marks=MEMORY_IS_LIMITED
        ),
        (aborted_near_the_limit, {}, 200, "too-much-memory", {"failures:memory": 1}),
        (os.abort, {}, 4000, "worker-lost", {"failures:lost": 10}),
        (
            lambda: compute_for(30.0),
            {"tasks.EXTRA_CPU_SECONDS": 0.3, "tasks.CPU_FACTOR": 0.1},
            200,
            "computation-too-long",
            {"failures:timeout": 1},
        ),
        (
            lambda: os.kill(os.getpid(), signal.SIGSTOP),
            {"liveness.HUNG_SECONDS": 0.5},
            200,
            "computation-hung",
            {"failures:hung": 3},
        ),
        (lambda: time.sleep(60), {"liveness.HUNG_SECONDS": 0.5}, 200, "computation-hung", {"failures:hung": 3}),
    ],
    ids=["allocates", "aborts with much memory", "aborts", "computes for too long", "is stopped", "waits for ever"],
)
def test_a_process_that_cannot_go_on_is_tried_again_and_ends_with_a_problem(
    worker: pytest.MonkeyPatch,
    store: Store,
    compute: Callable[[], object],
    limits: dict[str, float],
    megabytes: int,
    kind: str,
    events: dict[str, int],
) -> None:
    for name, value in limits.items():
        worker.setattr(f"grazemap_worker.{name}", value)

    def whole_map(request: UnfoldingMapsRequest, report: Report) -> Document:
        compute()
        return {"x": np.zeros(1)}

    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": Process(whole=whole_map)})
    job = submit(store, ONE)
    tasks.compute_waiting_tiles(tasks.WorkerContext(store, INFO, NUMERICS, megabytes << 20))
    problem = problem_of(store, job.id)
    assert problem.type == f"urn:grazemap:problem:{kind}"
    assert ("200 MiB" in problem.detail) == (kind == "too-much-memory")
    assert store.counts().events == events


@pytest.mark.parametrize(("estimate", "limit", "stopped"), [(0.02, 0.06, True), (1.0, 0.06, False), (0.02, 1.0, False)])
def test_a_job_is_stopped_at_its_limit_and_at_four_times_its_estimate(
    worker: pytest.MonkeyPatch, store: Store, estimate: float, limit: float, stopped: bool
) -> None:
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": planted("busy")})
    plan = TWO.model_copy(update={"estimate": Estimate(seconds=estimate)})
    # a tile ends before it is looked at, so it is the commit that notices
    worker.setattr(compute_process, "_LOOK_SECONDS", 60.0)
    job, _ = submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 100, max_seconds=limit)
    compute_all(store)
    stored = job_of(store, job.id)
    assert stored.status == ("failed" if stopped else "successful")
    if stopped:
        assert store.tiles.finished(job.id) == [0]
        assert stored.problem is not None
        assert stored.problem.type == "urn:grazemap:problem:too-much-time"
        assert "0.02 s" in stored.problem.detail
        assert "0.08 s" in stored.problem.detail
        assert f"{stored.cpu_seconds:.3g} s" in stored.problem.detail
        # another request goes on from there, with the same time again
        submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 100, max_seconds=1.0)
        compute_all(store)
        assert job_of(store, job.id).status == "successful"


def test_a_running_tile_is_stopped_at_the_limit_of_its_job(worker: pytest.MonkeyPatch, store: Store) -> None:
    process = Process(whole=lambda request, report: compute_for(30.0) or {"x": np.zeros(1)})
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": process})
    plan = ONE.model_copy(update={"estimate": Estimate(seconds=0.1)})
    job, _ = submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 100, max_seconds=0.3)
    compute_all(store)
    problem = problem_of(store, job.id)
    assert problem.type == "urn:grazemap:problem:too-much-time"
    assert "its limit is 0.4 s" in problem.detail


def test_an_error_of_the_core_is_a_problem_of_the_request(worker: pytest.MonkeyPatch, store: Store) -> None:
    def refuse(request: GrazingCurvesRequest, report: object) -> dict[str, object]:
        raise ParameterError("damping", "must be greater than 0 at a resonance")

    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=refuse)})
    job = submit_curve(store)
    compute_all(store, SMALL)
    failed = job_of(store, job.id)
    assert failed.status == "failed"
    assert failed.problem is not None
    assert failed.problem.status == 422
    assert failed.problem.errors[0].pointer == "/oscillator/damping"


def test_steps_are_reported_while_a_process_counts_them(worker: pytest.MonkeyPatch, store: Store) -> None:
    def steps(request: GrazingCurvesRequest, report: object) -> dict[str, object]:
        assert callable(report)
        report(1, 4)
        return {"x": np.zeros(1)}

    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=steps)})
    job = submit_curve(store, plan=LONG)
    compute_all(store)
    reported = [event.data for event in store.jobs.events(job.id) if event.name == "progress"]
    assert [(data["done"], data["total"]) for data in reported if data["unit"] == "steps"] == [(1, 4), (4, 4)]


def counting(*steps: tuple[int, int]) -> Process:
    """A map whose assembly says how far it is, and ends with an error if it is not stopped."""
    plain = planted("fast")

    def assembled(request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], report: Report) -> Document:
        for done, total in steps:
            report(done, total)
        assert plain.assembled is not None
        return plain.assembled(request, plan, tiles, report)

    return Process(tile=plain.tile, assembled=assembled)


def test_an_assembly_completes_the_steps_after_the_tiles(worker: pytest.MonkeyPatch, store: Store) -> None:
    steps = [(k, 1000) for k in range(1000)]
    worker.setattr(computation, "IMPLEMENTATIONS", {"unfolding-maps": counting(*steps)})
    job = submit(store, TWO.model_copy(update={"after": 10}))
    compute_all(store)
    told = [event.data["done"] for event in store.jobs.events(job.id) if event.name == "progress"]
    assert [done for done in told if done > 2] == list(range(3, 13))
    assert told == sorted(told)
    # whose plan has none is told of tiles alone
    store.redis.flushall()
    job = submit(store)
    compute_all(store)
    units = {event.data["unit"] for event in store.jobs.events(job.id) if event.name == "progress"}
    assert units == {"tiles"}


def test_a_process_that_stores_a_tile_finishes_though_its_worker_is_to_stop(
    worker: pytest.MonkeyPatch, store: Store, tmp_path: Path
) -> None:
    commit, storing, asked = tasks._commit, tmp_path / "storing", []

    def commit_slowly(finished: list[Finished], context: tasks.WorkerContext) -> list[int]:
        time.sleep(0.2)  # the worker may have looked just before, when the process computed
        storing.touch()
        time.sleep(1.5)
        storing.unlink()
        return commit(finished, context)

    def beat() -> None:
        if storing.exists():
            asked.append(True)
            raise StopWorker

    worker.setattr(tasks, "_commit", commit_slowly)
    job = submit(store, ONE)
    tasks.compute_waiting_tiles(tasks.WorkerContext(store, INFO, NUMERICS, beat=beat))
    assert asked
    assert job_of(store, job.id).status == "successful"


def test_a_dismissed_job_is_not_computed_further(worker: pytest.MonkeyPatch, store: Store, tmp_path: Path) -> None:
    def steps(request: GrazingCurvesRequest, report: Report) -> Document:
        store.jobs.dismiss(job.id)
        report(1, 4)
        (tmp_path / "reached").touch()
        return {"x": np.zeros(1)}

    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=steps)})
    job = submit_curve(store, plan=LONG)
    compute_all(store)
    assert list(tmp_path.iterdir()) == []
    assert store.jobs.status(job.id) == "dismissed"
    assert store.redis.exists(f"grazemap:4:job:{job.id}:failures") == 0


ACTIVITY = Activity("a" * 64, True, 0.0, 60.0, False)


@pytest.mark.parametrize("has_descriptors", [True, False])
def test_a_process_is_looked_at_at_intervals_whatever_the_system_has(
    monkeypatch: pytest.MonkeyPatch, has_descriptors: bool
) -> None:
    if not has_descriptors:  # as on macOS
        monkeypatch.delattr(os, "pidfd_open", raising=False)
    monkeypatch.setattr(compute_process, "_LOOK_SECONDS", 0.2)
    looks: list[str] = []

    def is_wanted(job_id: str) -> bool:
        looks.append(job_id)
        return True

    process = ComputeProcess(lambda: time.sleep(1.0) or 0, 1 << 30, SharedState(ACTIVITY))
    assert process.watch(is_wanted) == ProcessEnd(0)
    assert 1 <= len(looks) <= 20


def test_a_process_that_ended_before_it_was_killed_is_not_said_to_be_killed() -> None:
    process = ComputeProcess(lambda: 0, 1 << 30, SharedState(ACTIVITY))
    assert process.watch(lambda _: True) == ProcessEnd(0)
    killed, usage = ProcessEnd(-signal.SIGKILL, "hung", "each time for 10 s"), resource.getrusage(resource.RUSAGE_SELF)
    assert process._outcome(signal.SIGKILL, usage, killed) == killed
    assert process._outcome(0, usage, killed) == ProcessEnd(0)
    assert process._outcome(signal.SIGKILL, usage, None) == ProcessEnd(-signal.SIGKILL, "lost")


class Here:
    """A `ComputeProcess` in this process, so that what it calls can be counted."""

    def __init__(self, run: Callable[[], int], memory_bytes: int, state: SharedState) -> None:
        run()

    def watch(self, wanted: Callable[[str], bool], beside: object = None) -> ProcessEnd:
        return ProcessEnd(0)


def test_a_request_is_parsed_once_per_claim_and_never_canonicalised(worker: pytest.MonkeyPatch, store: Store) -> None:
    job = submit(store)
    worker.setattr(tasks, "ComputeProcess", Here)
    counts = parsing.count(worker)
    compute_all(store, tiles=1)
    assert counts == {"parsed": 1, "canonicalised": 0}
    compute_all(store, tiles=1)  # and the assembly
    assert counts == {"parsed": 3, "canonicalised": 0}
    assert decode_npz(whole(store, job.id))[1]["request"] == REQUEST.canonical()
