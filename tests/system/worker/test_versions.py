"""Releases side by side on one Redis: each computes its own jobs and no others."""

from __future__ import annotations

import pytest

from grazemap.wire import Job
from grazemap_worker import numerics as numerics_module
from grazemap_worker.store import Store
from tests.support.steps import problem_of, register
from tests.support.submitting import submit_curve

LEASE = 5.0


def a_minute_passes(store: Store, job: Job) -> None:
    """What is remembered of workers that are gone is forgotten, and the job is old."""
    for pattern in ("grazemap:4:fingerprint:*", "grazemap:4:version:*"):
        for key in store.redis.scan_iter(pattern):
            store.redis.delete(key)
    store.redis.hincrbyfloat(f"grazemap:4:job:{job.id}", "created", -61.0)


@pytest.mark.parametrize(
    ("part", "another"),
    [
        ("grazemap_worker.numerics.__version__", "another"),
        ("grazemap_core.compiled_ahead.source_fingerprint", lambda: "another"),
    ],
)
def test_another_core_is_another_fingerprint(part: str, another: object, monkeypatch: pytest.MonkeyPatch) -> None:
    numerics_module.numerics.cache_clear()
    here = numerics_module.numerics().fingerprint
    numerics_module.numerics.cache_clear()
    assert numerics_module.numerics().fingerprint == here
    numerics_module.numerics.cache_clear()
    monkeypatch.setattr(part, another)
    assert numerics_module.numerics().fingerprint != here
    numerics_module.numerics.cache_clear()


def test_a_job_of_a_version_without_workers_fails_after_a_minute(store: Store) -> None:
    register(store, "new", "y", LEASE, "2")
    job = submit_curve(store)
    assert store.jobs.bind("y", "2", [job.id]) == []
    assert [entry.status for entry in store.jobs.page()[0]] == ["accepted"]
    a_minute_passes(store, job)
    register(store, "old", "x", LEASE, "1")
    assert store.jobs.bind("y", "2", [job.id]) == []
    assert [entry.status for entry in store.jobs.page()[0]] == ["accepted"]  # its version lives again
    store.workers.remove("old")
    a_minute_passes(store, job)
    store.jobs.bind("y", "2", [job.id])
    problem = problem_of(store, job.id)
    assert problem.type == "urn:grazemap:problem:core-outdated"


def test_renewing_keeps_a_version_remembered(store: Store) -> None:
    register(store, "old", "x", LEASE, "1")
    job = submit_curve(store)
    a_minute_passes(store, job)
    register(store, "old", "x", LEASE, "1")
    store.jobs.bind("y", "2", [job.id])
    assert [entry.status for entry in store.jobs.page()[0]] == ["accepted"]


def test_equal_numerics_do_not_make_another_version_a_jobs_own(store: Store) -> None:
    register(store, "old", "f", LEASE, "1")
    job = submit_curve(store)
    store.workers.remove("old")
    a_minute_passes(store, job)
    register(store, "new", "f", LEASE, "2")
    store.jobs.bind("f", "2", [job.id])
    assert [entry.status for entry in store.jobs.page()[0]] == ["failed"]


def test_a_worker_whose_lease_expired_is_registered_again(store: Store) -> None:
    register(store, "w", "f", LEASE, "1")
    store.redis.delete("grazemap:4:worker:w")
    assert store.workers.live() == []
    register(store, "w", "f", LEASE, "1")
    assert [worker.name for worker in store.workers.live()] == ["w"]
