"""A full disk or memory of Redis: a problem of its own, reads go on, and it recovers without a restart."""

from __future__ import annotations

import contextlib
import resource
import shlex
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from grazemap_service.redis_server import RedisServer, find_redis_server
from grazemap_worker.store import Store, WorkerInfo, connect
from grazemap_worker.store.keys import PREFIX
from tests.support.service_running import CURVE
from tests.support.watching import until

OTHERS = ({"omega": {"start": 0.1, "stop": 1.0, "points": k}} for k in range(6, 10_000))


@dataclass
class Narrow:
    """A Redis whose disk or memory can be filled, and freed again."""

    server: RedisServer
    fill: Callable[[], object]
    free: Callable[[], object]


@contextlib.contextmanager
def small_file_system(folder: Path) -> Iterator[Narrow]:
    """A file system of 20 MB, which another file fills."""
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20m", "tmpfs", folder], check=False)
    if mounted.returncode != 0:
        pytest.skip("this user may not mount a file system")
    other = folder / "other"

    def fill() -> None:
        with other.open("wb", buffering=0) as stream, contextlib.suppress(OSError):
            while stream.write(bytes(1 << 16)):
                pass

    try:
        with RedisServer(folder / "redis") as server:
            yield Narrow(server, fill, other.unlink)
    finally:
        subprocess.run(["umount", folder], check=True)


@contextlib.contextmanager
def limited_file(folder: Path) -> Iterator[Narrow]:
    """A limit of the size of files, for any user: writes fail as on a full disk where its signal is ignored."""
    folder.mkdir()
    program = folder / "redis-server"
    program.write_text(f"#!/bin/sh\ntrap '' XFSZ\nexec {shlex.quote(str(find_redis_server()))} \"$@\"\n")
    program.chmod(0o700)
    with RedisServer(folder / "redis", program) as server:
        assert server.pid is not None
        limit = resource.prlimit(server.pid, resource.RLIMIT_FSIZE)

        def bound(size: int) -> None:
            assert server.pid is not None
            resource.prlimit(server.pid, resource.RLIMIT_FSIZE, (size, limit[1]))

        largest = folder / "redis" / "appendonlydir" / "appendonly.aof.1.incr.aof"
        yield Narrow(server, lambda: bound(largest.stat().st_size + 100), lambda: bound(limit[0]))


@contextlib.contextmanager
def limited_memory(folder: Path) -> Iterator[Narrow]:
    """A limit of memory, below what is used or none."""
    with RedisServer(folder) as server, contextlib.closing(connect(server.url)) as client:
        yield Narrow(server, lambda: client.config_set("maxmemory", 1), lambda: client.config_set("maxmemory", 0))


@pytest.fixture(params=[small_file_system, limited_file, limited_memory])
def narrow(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Narrow]:
    """A Redis that has room at first."""
    with request.param(tmp_path / "narrow") as server:
        yield server


def answered(client: TestClient, method: str, path: str, **options: Any) -> str:
    """How a request is answered: the status, and of a problem the title."""
    answer = client.request(method, path, **options)
    problem = answer.headers["content-type"] == "application/problem+json"
    return f"{answer.status_code} {answer.json()['title']}" if problem else str(answer.status_code)


def test_writes_are_507_reads_go_on_and_room_is_used_without_a_restart(serve: Any, worker: Any, narrow: Narrow) -> None:
    worker.store = Store(connect(narrow.server.url))
    worker.register()
    client, pid = serve(redis_url=narrow.server.url, hot_bytes=0), narrow.server.pid
    path = client.post("/v1/grazing-curves", json=CURVE).headers["location"]
    data = worker.finish(path.rpartition("/")[2])
    unfinished = client.post("/v1/grazing-curves", json=next(OTHERS)).headers["location"]
    assert answered(client, "GET", "/readyz") == "200"

    worker.store.workers.renew(WorkerInfo("ends", "f00d"), 2)
    narrow.fill()
    # the first writes are in memory before their file fails
    until(lambda: answered(client, "POST", "/v1/grazing-curves", json=next(OTHERS)) == "507 Storage full", 10)
    until(lambda: not worker.store.redis.exists(f"{PREFIX}worker:ends"), 10)
    for _ in range(2):
        assert answered(client, "GET", "/readyz") == "507 Storage full"
        assert client.get(f"{path}/result?f=npz").content == data
        assert answered(client, "GET", f"{path}/result") == "200"
        assert answered(client, "GET", path) == answered(client, "GET", unfinished) == "200"
        assert answered(client, "GET", "/v1/jobs") == "200"
        assert client.get(f"{path}/events").status_code == 200
        assert "grazemap_store_up 1.0" in client.get("/metrics").text

    narrow.free()
    until(lambda: answered(client, "GET", "/readyz") == "200", 10)
    assert answered(client, "POST", "/v1/grazing-curves", json=next(OTHERS)) == "201"
    assert narrow.server.pid == pid
    assert narrow.server.running
