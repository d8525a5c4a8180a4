"""Services in this process or on a real socket, a worker that is played, and clients that misbehave."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from starlette.testclient import TestClient

from grazemap.codec import encode_npz
from grazemap_service.app import create_app
from grazemap_service.connections import bounded_server
from grazemap_service.redis_server import RedisServer
from grazemap_service.result_schemas import NUMERICS
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import ASSEMBLY, Finished, Store, WorkerInfo, core_version
from tests.support.watching import until

CURVE = {"omega": {"start": 0.25, "stop": 0.35, "points": 5}}
MAP = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 64},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 64},
}
FINGERPRINT = "f00d"
WORKER = "played"


def client_of(redis_server: RedisServer, **settings: Any) -> TestClient:
    """Return a client of a service of its own."""
    app = create_app(ServiceSettings(**{"redis_url": redis_server.url, **settings}))
    return TestClient(app, base_url="http://127.0.0.1", client=("127.0.0.1", 50000), raise_server_exceptions=False)


@contextmanager
def running(settings: ServiceSettings, **bounds: Any) -> Iterator[str]:
    """Serve on a real socket and return the base URL."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = bounded_server(create_app(settings), listener, **bounds)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            until(lambda: server.started, 10)
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            server.should_exit = True
            thread.join(10)
        assert not thread.is_alive()


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


def problem_of(answer: Any, status: int, kind: str) -> dict[str, Any]:
    """Check that an answer is a problem of a kind, and return it."""
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = answer.json()
    assert (problem["type"], problem["status"]) == (f"urn:grazemap:problem:{kind}", status)
    return problem


def connect_to(url: str) -> socket.socket:
    address = urlsplit(url)
    return socket.create_connection((address.hostname or "", address.port or 80), timeout=10)


def is_closed(connection: socket.socket) -> bool:
    """Whether the service has closed a connection; what it has sent is read."""
    connection.setblocking(False)
    try:
        while connection.recv(4096):
            pass
    except BlockingIOError:
        return False
    except ConnectionResetError:
        pass
    return True


def stalled_reader(url: str, path: str) -> socket.socket:
    """A client that asks and does not read; its own buffer is small."""
    address = urlsplit(url)
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.connect((address.hostname, address.port))
    client.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    return client
