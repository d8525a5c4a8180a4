"""Fixtures that more than one part needs: an embedded Redis, and a store on it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from grazemap_service import app
from grazemap_service.redis_server import RedisServer
from grazemap_worker.store import Store, connect


@pytest.fixture(scope="session", autouse=True)
def _document_of_the_api_on_request() -> Iterator[None]:
    """Services in this process make the API's document when it is asked for, and in no thread beside other tests.

    FastAPI makes it under filters of warnings, which are those of all threads.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "_DOCUMENT_AFTER_SECONDS", 1e6)
        yield


@pytest.fixture(scope="session")
def redis_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RedisServer]:
    """One Redis for the whole session; do not stop it: take `own_redis_server` for that."""
    with RedisServer(Path(tmp_path_factory.mktemp("redis"))) as server:
        yield server


@pytest.fixture
def own_redis_server(tmp_path: Path) -> Iterator[RedisServer]:
    """A Redis of the test's own, which it may stop and start again."""
    with RedisServer(tmp_path / "redis") as server:
        yield server


@pytest.fixture
def store(redis_server: RedisServer) -> Iterator[Store]:
    """An empty store."""
    client = connect(redis_server.url)
    client.flushall()
    yield Store(client)
    client.close()
