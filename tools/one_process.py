"""A client, a service and a worker in one process, to watch a request: only Redis is a process of its own."""

from __future__ import annotations

import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from unittest.mock import patch

import httpx2

from grazemap import AsyncClient
from grazemap_service import jobs
from grazemap_service.app import create_app
from grazemap_service.context import Context
from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import ServiceSettings
from grazemap_worker import tasks
from grazemap_worker.numerics import numerics
from grazemap_worker.planning import LANE_WEIGHTS
from grazemap_worker.planning.kernel_steps import FIRST_STEPS
from grazemap_worker.store import Store, WaitingJob, WorkerInfo, WorkerQueue, connect, core_version
from grazemap_worker.store.ledger import LANES


@asynccontextmanager
async def client() -> AsyncIterator[AsyncClient]:
    """Give a client whose requests are answered, and computed, in this process."""
    with tempfile.TemporaryDirectory() as folder, RedisServer(Path(folder)) as server:
        store = Store(connect(server.url))
        ours = numerics()
        worker = WorkerInfo("here", ours.fingerprint, core_version(), frozenset(FIRST_STEPS), small=True)
        store.workers.renew(worker, 600)

        def compute_tiles(_context: Context, _queue: WorkerQueue, _job: WaitingJob) -> None:
            """Compute what a worker would be woken for, as if all of it were small."""
            tasks.compute_waiting_tiles(tasks.WorkerContext(store, worker, ours))

        transport = httpx2.ASGITransport(create_app(ServiceSettings(redis_url=server.url, allowed_hosts=("here",))))
        with patch.object(jobs, "_wake_worker", compute_tiles), patch.dict(LANES, {True: list(LANE_WEIGHTS)}):
            async with AsyncClient("http://here", transport=transport, timeout=600.0) as made:
                yield made
