"""Releases side by side on one Redis: each computes its own jobs and no others."""

from __future__ import annotations

import pytest

from grazemap.wire import GrazingCurvesRequest, Job
from grazemap_worker import numerics as numerics_module
from grazemap_worker.planning import Plan
from grazemap_worker.store import Store

LEASE = 5.0


def submit(store: Store, version: str) -> Job:
    return store.jobs.submit("grazing-curves", GrazingCurvesRequest(omega=[1, 2]), version, Plan(), 100)[0]


def a_minute_passes(store: Store, job: Job) -> None:
    """What is remembered of workers that are gone is forgotten, and the job is old."""
    for pattern in ("grazemap:2:fingerprint:*", "grazemap:2:version:*"):
        for key in store.redis.scan_iter(pattern):
            store.redis.delete(key)
    store.redis.hincrbyfloat(f"grazemap:2:job:{job.id}", "created", -61.0)


@pytest.mark.parametrize("part", ["core_version", "source_fingerprint"])
def test_another_core_is_another_fingerprint(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    numerics_module.numerics.cache_clear()
    here = numerics_module.numerics().fingerprint
    numerics_module.numerics.cache_clear()
    assert numerics_module.numerics().fingerprint == here
    numerics_module.numerics.cache_clear()
    target = "grazemap_core.kernel_folder" if part == "source_fingerprint" else "grazemap_worker.numerics"
    monkeypatch.setattr(f"{target}.{part}", lambda: "another")
    assert numerics_module.numerics().fingerprint != here
    numerics_module.numerics.cache_clear()


def test_a_worker_claims_only_jobs_of_its_own_version(store: Store) -> None:
    job = submit(store, "1")
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE, "2") is None
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE, "1")


def test_a_job_of_a_version_without_workers_fails_after_a_minute(store: Store) -> None:
    store.workers.register("new", "y", LEASE, "2")
    job = submit(store, "1")
    assert store.jobs.bind("y", "2") == []
    assert [found.status for found in store.jobs.page()[0]] == ["accepted"]
    a_minute_passes(store, job)
    store.workers.register("old", "x", LEASE, "1")
    assert store.jobs.bind("y", "2") == []
    assert [found.status for found in store.jobs.page()[0]] == ["accepted"]  # its version lives again
    store.workers.remove("old")
    a_minute_passes(store, job)
    store.jobs.bind("y", "2")
    failed = store.jobs.get(job.id)
    assert failed is not None
    assert failed.problem is not None
    assert failed.problem.type == "urn:grazemap:problem:core-outdated"


def test_renewing_keeps_a_version_remembered(store: Store) -> None:
    store.workers.register("old", "x", LEASE, "1")
    job = submit(store, "1")
    a_minute_passes(store, job)
    assert store.workers.renew("old", LEASE)
    store.jobs.bind("y", "2")
    assert [found.status for found in store.jobs.page()[0]] == ["accepted"]


def test_equal_numerics_do_not_make_another_version_a_jobs_own(store: Store) -> None:
    store.workers.register("old", "f", LEASE, "1")
    job = submit(store, "1")
    store.workers.remove("old")
    a_minute_passes(store, job)
    store.workers.register("new", "f", LEASE, "2")
    store.jobs.bind("f", "2")
    assert [found.status for found in store.jobs.page()[0]] == ["failed"]


def test_a_worker_whose_lease_expired_is_registered_again(store: Store) -> None:
    store.workers.register("w", "f", LEASE, "1")
    store.redis.delete("grazemap:2:worker:w")
    assert store.workers.live() == []
    job = submit(store, "1")
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE)  # which takes the lease again
    assert not store.workers.renew("w", LEASE)  # so that the worker registers
