"""Clients of the service: in-process, and one that goes through a real socket; and a worker that is played."""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableMapping
from contextlib import ExitStack
from typing import Any

import pytest
import structlog
from starlette.testclient import TestClient

from grazemap_service import request_body
from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store
from tests.support.service_running import PlayedWorker, client_of, running

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


@pytest.fixture
def fresh_client(serve: Serve) -> TestClient:
    """A client of a service of the test's own, which has counted and kept nothing."""
    return serve()


@pytest.fixture(scope="session")
def service(redis_server: RedisServer) -> Iterator[TestClient]:
    """A client of one service for many tests, as a service takes a tenth of a second for its first request."""
    with client_of(redis_server) as client:
        yield client


@pytest.fixture
def client(service: TestClient, store: Store) -> TestClient:
    """A client of a service with default settings, and an empty store."""
    return service


@pytest.fixture(scope="session")
def described(service: TestClient) -> dict[str, Any]:
    """The document of the API; do not change it."""
    document: dict[str, Any] = service.get("/openapi.json").json()
    return document


@pytest.fixture
def live_url(redis_server: RedisServer, store: Store) -> Iterator[str]:
    with running(ServiceSettings(redis_url=redis_server.url)) as url:
        yield url


@pytest.fixture
def impatient_url(redis_server: RedisServer, store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A service that gives a body one second to arrive, reads one second more of it, and takes 20 connections."""
    monkeypatch.setattr(request_body, "REQUEST_SECONDS", 1.0)
    monkeypatch.setattr(request_body, "_REST_SECONDS", 1.0)
    with running(ServiceSettings(redis_url=redis_server.url), max_connections=20) as url:
        yield url


@pytest.fixture
def worker(store: Store) -> PlayedWorker:
    """A live worker."""
    played = PlayedWorker(store)
    played.register()
    return played
