"""A client, a service and a worker in one process, to watch a request: only Redis is a process of its own."""

from __future__ import annotations

import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from unittest.mock import patch

import httpx2

from grazemap import AsyncClient
from grazemap.wire import Job
from grazemap_service import jobs
from grazemap_service.app import create_app
from grazemap_service.context import Context
from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import Settings
from grazemap_worker import tasks
from grazemap_worker.numerics import numerics
from grazemap_worker.store import Store, connect, core_version

WORKER = "here"


def _compute(context: Context, job: Job, tiles: int) -> None:
    """Compute what would be put into the queue."""
    for tile in range(tiles):
        tasks.run_tile(job.id, tile)


@asynccontextmanager
async def client() -> AsyncIterator[AsyncClient]:
    """Give a client whose requests are answered, and computed, in this process."""
    with tempfile.TemporaryDirectory() as folder, RedisServer(Path(folder)) as server:
        store = Store(connect(server.url))
        ours = numerics()
        store.workers.register(WORKER, ours.fingerprint, 600, core_version())
        tasks.enter(tasks.Context(store, WORKER, ours))
        transport = httpx2.ASGITransport(create_app(Settings(redis_url=server.url, allowed_hosts=("here",))))
        with patch.object(jobs, "_enqueue", _compute):
            async with AsyncClient("http://here", transport=transport, timeout=600.0) as made:
                yield made
