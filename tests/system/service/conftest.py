"""Clients of the service: in-process, and one that goes through a real socket; and a worker that is played."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import structlog
from starlette.testclient import TestClient

from grazemap.codec import encode_npz
from grazemap_service import request_body
from grazemap_service.app import create_app
from grazemap_service.connections import bounded_server
from grazemap_service.redis_server import RedisServer
from grazemap_service.result_schemas import NUMERICS
from grazemap_service.settings import Settings
from grazemap_worker.store import ASSEMBLY, Finished, Store, WorkerInfo, core_version

CURVE = {"omega": {"start": 0.25, "stop": 0.35, "points": 5}}
MAP = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 64},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 64},
}
FINGERPRINT = "f00d"
WORKER = "played"

Serve = Callable[..., TestClient]


@pytest.fixture(autouse=True)
def logs() -> Iterator[list[MutableMapping[str, Any]]]:
    """What the service logs, instead of printing it."""
    with structlog.testing.capture_logs(processors=[structlog.contextvars.merge_contextvars]) as entries:
        yield entries


@pytest.fixture
def serve(redis_server: RedisServer, store: Store) -> Iterator[Serve]:
    """Make clients of services with settings of the test's choice, all on one empty store."""
    with ExitStack() as clients:
        yield lambda **settings: clients.enter_context(client_of(redis_server, **settings))


def client_of(redis_server: RedisServer, **settings: Any) -> TestClient:
    """Return a client of a service of its own."""
    app = create_app(Settings(**{"redis_url": redis_server.url, **settings}))
    return TestClient(app, base_url="http://127.0.0.1", client=("127.0.0.1", 50000), raise_server_exceptions=False)


@pytest.fixture
def client(serve: Serve) -> TestClient:
    """A client of a service with default settings."""
    return serve()


@pytest.fixture(scope="session")
def service(redis_server: RedisServer) -> Iterator[TestClient]:
    """A client of one service for many tests, as a service takes a tenth of a second for its first request."""
    with client_of(redis_server) as client:
        yield client


@pytest.fixture
def lasting(service: TestClient, store: Store) -> TestClient:
    """The client of that service, and an empty store; for tests that need nothing else of it to be new."""
    return service


@pytest.fixture(scope="session")
def described() -> dict[str, Any]:
    """The document of the API; do not change it."""
    document: dict[str, Any] = json.loads(json.dumps(create_app(Settings()).openapi()))
    return document


@contextmanager
def running(settings: Settings, **bounds: Any) -> Iterator[str]:
    """Serve on a real socket and return the base URL."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = bounded_server(create_app(settings), listener, **bounds)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            deadline = time.monotonic() + 10
            while not server.started and time.monotonic() < deadline:
                time.sleep(0.005)
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(10)
        assert not thread.is_alive()


@pytest.fixture
def live() -> Callable[..., AbstractContextManager[str]]:
    """`running`, for services of the test's own."""
    return running


@pytest.fixture
def live_url(redis_server: RedisServer, store: Store) -> Iterator[str]:
    with running(Settings(redis_url=redis_server.url)) as url:
        yield url


@pytest.fixture
def impatient_url(redis_server: RedisServer, store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A service that gives a body one second to arrive, reads one second more of it, and takes 20 connections."""
    monkeypatch.setattr(request_body, "REQUEST_SECONDS", 1.0)
    monkeypatch.setattr(request_body, "_DRAIN_SECONDS", 1.0)
    with running(Settings(redis_url=redis_server.url), most_connections=20) as url:
        yield url


@dataclass
class PlayedWorker:
    """Does to the store what a worker does, without computing anything."""

    store: Store

    def register(self) -> None:
        self.store.workers.renew(WorkerInfo(WORKER, FINGERPRINT, core_version()), 60)

    def begin(self, job_id: str, tile: int = 0) -> None:
        assert self.store.tiles.claim(job_id, tile, WORKER, FINGERPRINT, 60) is not None

    def commit(self, job_id: str, data: bytes, tile: int, whole: bool = False, store: Store | None = None) -> None:
        """Commit a tile, or the result."""
        claim = self.store.tiles.claim(job_id, tile, WORKER, FINGERPRINT, 60)
        assert claim is not None
        finished = Finished(claim, data, 0.0, whole=whole or tile == ASSEMBLY)
        assert (store or self.store).results.commit([finished])[0] >= 0

    def finish(self, job_id: str, document: dict[str, Any] | None = None, meta: dict[str, Any] | None = None) -> bytes:
        numerics = dict.fromkeys(NUMERICS, "played")
        full = {**meta, "numerics": numerics} if meta else {"process": "grazing-curves"}
        data = encode_npz(document or example_document(), full)
        claim = self.store.tiles.claim(job_id, 0, WORKER, FINGERPRINT, 60)
        assert claim is not None
        assert self.store.results.commit([Finished(claim, data, 0.0)]) == [0]
        return data


def example_document() -> dict[str, Any]:
    return {
        "omega": np.array([0.1, 0.2, 0.3]),
        "clearance": np.array([1.0, np.nan, 3.0]),
        "points": [{"kind": "resonant", "order": 2, "families": [{"case": 1, "n": 3}]}],
    }


@pytest.fixture
def worker(store: Store) -> PlayedWorker:
    """A live worker."""
    played = PlayedWorker(store)
    played.register()
    return played
