"""Steps of workers, played on a store: a lease, a finished tile, a result; and what the store has of jobs and tiles."""

from __future__ import annotations

from typing import Any

from grazemap.wire import GrazingCurvesRequest, Job, Problem
from grazemap_worker.planning import Plan
from grazemap_worker.store import Claim, Finished, Store, WorkerInfo
from grazemap_worker.store.keys import ASSEMBLY, PREFIX, job_key

_ANY = GrazingCurvesRequest(omega=[1, 2])


def register(store: Store, name: str, fingerprint: str, seconds: float, core_version: str = "") -> None:
    """Take a lease."""
    store.workers.renew(WorkerInfo(name, fingerprint, core_version), seconds)


def _claim(store: Store, identity: str, tile: int, fingerprint: str) -> Claim:
    """A claim that nobody made."""
    plan = store.jobs.plan_of(identity) or Plan()
    return Claim(identity, tile, "w", fingerprint, "grazing-curves", {}, _ANY, "1", plan)


def commit_tile(store: Store, identity: str, tile: int, data: bytes, fingerprint: str, seconds: float) -> int:
    """Commit a tile; return how many remain."""
    claim = _claim(store, identity, tile, fingerprint)
    return store.results.commit([Finished(claim, data, seconds, whole=False)])[0]


def commit_result(store: Store, identity: str, data: bytes, fingerprint: str, seconds: float) -> bool:
    """Commit a result; return whether this ended the job."""
    return store.results.commit([Finished(_claim(store, identity, 0, fingerprint), data, seconds)]) == [0]


def job_of(store: Store, identity: str) -> Job:
    """The job, which there must be."""
    job = store.jobs.get(identity)
    assert job is not None
    return job


def problem_of(store: Store, identity: str) -> Problem:
    """The problem with which a job has failed."""
    problem = job_of(store, identity).problem
    assert problem is not None
    return problem


def lane_of(store: Store, identity: str) -> str:
    """The lane in which the tiles of a job wait."""
    value = store.redis.hget(job_key(identity), "lane")
    assert isinstance(value, bytes)
    return value.decode()


def fingerprint_of(store: Store, identity: str) -> str | None:
    """The fingerprint that a job is bound to."""
    value: Any = store.redis.hget(job_key(identity), "fingerprint")
    return value.decode() or None if value else None


def unfinished(store: Store) -> dict[str, int]:
    """The tiles that remain, by job."""
    remaining: Any = store.redis.hgetall(f"{PREFIX}unfinished")
    return {identity.decode(): int(count) for identity, count in remaining.items()}


def pending(store: Store, fingerprint: str) -> list[tuple[str, int]]:
    """The tiles that workers can claim, by job, in the order in which the flows and their jobs are served."""
    redis: Any = store.redis
    entries = []
    for flow in redis.zrange(f"{PREFIX}flows:{fingerprint}", 0, -1):
        for member in redis.zrange(f"{PREFIX}flow:{fingerprint}:{flow.decode()}", 0, -1):
            identity = member.decode()
            key = job_key(identity)
            first, total = (int(value or 0) for value in redis.hmget(key, "next", "total"))
            tiles = {int(tile) for tile in redis.smembers(f"{key}:again")} | set(range(first, total))
            taken = {int(tile) for part in ("tiles", "claims") for tile in redis.hkeys(f"{key}:{part}")}
            entries += [(identity, tile) for tile in sorted(tiles - taken, key=lambda tile: (tile == ASSEMBLY, tile))]
    return entries
