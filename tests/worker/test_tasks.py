"""`run_tile` with planted processes: which worker computes what, and the problem when that fails."""

from __future__ import annotations

import numpy as np
import pytest
from planted import BUSY_SECONDS, NUMERICS, planted

from grazemap.codec import Document, decode_npz
from grazemap.wire import GrazingCurvesRequest, Job, UnfoldingMapsRequest, canonical
from grazemap_core.errors import ParameterError
from grazemap_worker import tasks
from grazemap_worker.planning import Plan
from grazemap_worker.processes import Process
from grazemap_worker.processes.conversion import Report
from grazemap_worker.store import ASSEMBLY, Store, core_version
from tests import parsing

REQUEST = UnfoldingMapsRequest(omega=[1, 2, 3], clearance=[1, 2])
TWO = Plan(rows=2, columns=3, tile_rows=1, tile_columns=3)
ONE = Plan(rows=2, columns=3, tile_rows=2, tile_columns=3)


@pytest.fixture
def worker(store: Store, monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """This process as a worker of planted maps."""
    monkeypatch.setattr(tasks, "_context", tasks.Context(store, "w", NUMERICS))
    monkeypatch.setattr(tasks, "PROCESSES", {"unfolding-maps": planted("fast")})
    return monkeypatch


def submit(store: Store, plan: Plan = TWO) -> Job:
    return store.jobs.submit("unfolding-maps", REQUEST, core_version(), plan, 100)[0]


def whole(store: Store, identity: str) -> bytes:
    data = store.results.data(identity)
    assert data is not None
    return data


def test_the_last_tile_starts_the_assembly_of_the_map(worker: object, store: Store) -> None:
    job = submit(store)
    tasks.run_tile(job.id, 1)
    assert store.results.data(job.id) is None
    tile, meta = decode_npz(store.tiles.data(job.id, 1) or b"")
    np.testing.assert_array_equal(tile["product"], [[2, 4, 6]])
    assert meta["tile"] == {"index": 1, "rows": [1, 2], "columns": [0, 3]}
    tasks.run_tile(job.id, 0)
    document, meta = decode_npz(whole(store, job.id))
    np.testing.assert_array_equal(document["product"], [[1, 2, 3], [2, 4, 6]])
    assert meta["request"]["max_periods"] == 1000
    assert "tile" not in meta


def test_a_result_has_the_deprecated_names_of_its_fields_too(worker: pytest.MonkeyPatch, store: Store) -> None:
    def whole_map(request: UnfoldingMapsRequest, report: Report) -> Document:
        return {"verified": np.array([[True, False, True]]), "period": np.array([[1, 2, 3]])}

    worker.setattr(tasks, "PROCESSES", {"unfolding-maps": Process(whole=whole_map)})
    job = submit(store, ONE)
    tasks.run_tile(job.id, 0)
    document, _ = decode_npz(whole(store, job.id))
    assert set(document) == {"verified", "certified", "period"}
    np.testing.assert_array_equal(document["certified"], document["verified"])


@pytest.mark.parametrize("mode", ["busy", "slow"])
def test_processor_time_of_tiles_and_assembly_is_counted(worker: pytest.MonkeyPatch, store: Store, mode: str) -> None:
    worker.setattr(tasks, "PROCESSES", {"unfolding-maps": planted(mode)})
    job = submit(store)
    for tile in (0, 1):
        tasks.run_tile(job.id, tile)
    done = store.jobs.get(job.id)
    assert done is not None
    assert done.status == "successful"
    assert done.cpu_seconds is not None
    busy = 3 * BUSY_SECONDS if mode == "busy" else 0.0  # one that sleeps computes nothing
    assert busy <= done.cpu_seconds < busy + 0.5 * BUSY_SECONDS


def test_the_bytes_do_not_depend_on_the_cut(worker: object, store: Store) -> None:
    job = submit(store)
    for tile in (0, 1):
        tasks.run_tile(job.id, tile)
    cut_in_two = whole(store, job.id)
    store.redis.flushall()
    assert submit(store, ONE).id == job.id
    tasks.run_tile(job.id, 0)
    assert whole(store, job.id) == cut_in_two


def test_when_the_assembling_worker_dies_another_assembles(worker: object, store: Store) -> None:
    job = submit(store)
    tasks.run_tile(job.id, 0)
    assert store.tiles.claim(job.id, 1, "dead", "planted", 5)
    assert store.tiles.commit(job.id, 1, store.tiles.data(job.id, 0) or b"", "planted", 0.0) == 0
    assert store.tiles.claim(job.id, ASSEMBLY, "dead", "planted", 5)
    tasks.run_tile(job.id, ASSEMBLY)
    assert store.results.data(job.id) is None  # it is held
    store.workers.remove("dead")
    assert store.tiles.lost_claims() == [(job.id, ASSEMBLY, "dead")]
    tasks.run_tile(job.id, ASSEMBLY)
    assert whole(store, job.id)


def test_a_duplicate_entry_does_nothing(worker: pytest.MonkeyPatch, store: Store) -> None:
    job = submit(store)
    tasks.run_tile(job.id, 0)
    worker.setattr(tasks, "PROCESSES", {"unfolding-maps": planted("raises")})
    tasks.run_tile(job.id, 0)
    tasks.run_tile("0" * 64, 0)
    assert store.redis.exists(f"grazemap:2:job:{job.id}:failures") == 0


def test_an_error_of_the_core_is_a_problem_of_the_request(worker: pytest.MonkeyPatch, store: Store) -> None:
    def refuse(request: GrazingCurvesRequest, report: object) -> dict[str, object]:
        raise ParameterError("damping", "must be greater than 0 at a resonance")

    worker.setattr(tasks, "PROCESSES", {"grazing-curves": Process(whole=refuse)})
    job, _ = store.jobs.submit("grazing-curves", GrazingCurvesRequest(omega=[1, 2]), core_version(), Plan(), 100)
    tasks.run_tile(job.id, 0)
    failed = store.jobs.get(job.id)
    assert failed is not None
    assert failed.status == "failed"
    assert failed.problem is not None
    assert failed.problem.status == 422
    assert failed.problem.errors[0].pointer == "/oscillator/damping"


def test_steps_are_reported_while_a_process_counts_them(worker: pytest.MonkeyPatch, store: Store) -> None:
    def steps(request: GrazingCurvesRequest, report: object) -> dict[str, object]:
        assert callable(report)
        report(1, 4)
        return {"x": np.zeros(1)}

    worker.setattr(tasks, "PROCESSES", {"grazing-curves": Process(whole=steps)})
    job, _ = store.jobs.submit("grazing-curves", GrazingCurvesRequest(omega=[1, 2]), core_version(), Plan(), 100)
    tasks.run_tile(job.id, 0)
    reported = [event.data for event in store.jobs.events(job.id) if event.name == "progress"]
    assert [(data["done"], data["total"]) for data in reported if data["unit"] == "steps"] == [(1, 4), (4, 4)]


def counting(*said: tuple[int, int]) -> Process:
    """A map whose assembly says how far it is, and ends with an error if it is not stopped."""
    plain = planted("fast")

    def assembled(request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], report: Report) -> Document:
        for done, total in said:
            report(done, total)
        assert plain.assembled is not None
        return plain.assembled(request, plan, tiles, report)

    return Process(tile=plain.tile, assembled=assembled)


def test_an_assembly_completes_the_steps_after_the_tiles(worker: pytest.MonkeyPatch, store: Store) -> None:
    said = [(k, 1000) for k in range(1000)]
    worker.setattr(tasks, "PROCESSES", {"unfolding-maps": counting(*said)})
    job = submit(store, TWO.model_copy(update={"after": 10}))
    for tile in (0, 1):
        tasks.run_tile(job.id, tile)
    told = [event.data["done"] for event in store.jobs.events(job.id) if event.name == "progress"]
    assert [one for one in told if one > 2] == list(range(3, 13))
    assert told == sorted(told)
    # whose plan has none is told of tiles alone
    store.redis.flushall()
    job = submit(store)
    for tile in (0, 1):
        tasks.run_tile(job.id, tile)
    units = {event.data["unit"] for event in store.jobs.events(job.id) if event.name == "progress"}
    assert units == {"tiles"}


def test_a_dismissed_job_is_not_computed_further(worker: pytest.MonkeyPatch, store: Store) -> None:
    reached: list[str] = []

    def steps(request: GrazingCurvesRequest, report: Report) -> Document:
        store.jobs.dismiss(job.id)
        report(1, 4)
        reached.append("behind")
        return {"x": np.zeros(1)}

    worker.setattr(tasks, "PROCESSES", {"grazing-curves": Process(whole=steps)})
    job, _ = store.jobs.submit("grazing-curves", GrazingCurvesRequest(omega=[1, 2]), core_version(), Plan(), 100)
    tasks.run_tile(job.id, 0)
    assert reached == []
    assert store.jobs.status(job.id) == "dismissed"
    assert store.redis.exists(f"grazemap:2:job:{job.id}:failures") == 0


def test_no_tile_without_a_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "_context", None)
    with pytest.raises(RuntimeError, match="worker"):
        tasks.run_tile("0" * 64, 0)


def test_a_request_is_parsed_once_per_claim_and_never_canonicalised(worker: pytest.MonkeyPatch, store: Store) -> None:
    job = submit(store)
    counts = parsing.count(worker)
    tasks.run_tile(job.id, 1)
    assert counts == {"parsed": 1, "canonicalised": 0}
    tasks.run_tile(job.id, 0)  # and the assembly
    assert counts == {"parsed": 3, "canonicalised": 0}
    assert decode_npz(whole(store, job.id))[1]["request"] == canonical(REQUEST)
