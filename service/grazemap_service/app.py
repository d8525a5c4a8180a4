"""Creates the FastAPI app from settings. Neither importing this module nor creating the app imports core or numba."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from threading import Thread

from fastapi import FastAPI

from grazemap.version import __version__
from grazemap_service import middleware, openapi, problems
from grazemap_service.context import Context
from grazemap_service.hub import Hub
from grazemap_service.metrics import Metrics
from grazemap_service.representations import RepresentationCache
from grazemap_service.routers import batches, docs, events, health, jobs, processes, results, root
from grazemap_service.settings import ServiceSettings
from grazemap_worker import watchdog
from grazemap_worker.store import Store, core_version
from grazemap_worker.system import IdleMemory

# Timeout of a Redis command in seconds. It is short, so that an unavailable Redis gives errors soon, before all threads
# wait for it.
STORE_TIMEOUT_SECONDS = 1.0
# Seconds after the start at which the OpenAPI document is made, unless it is asked for before.
_DOCUMENT_AFTER_SECONDS = 0.5
_ROUTERS = (processes, batches, jobs, events, results, root, health)


def create_app(settings: ServiceSettings | None = None) -> FastAPI:
    """Return the service.

    Parameters
    ----------
    settings : ServiceSettings, optional
        Read from the environment when left out.

    Notes
    -----
    Redis is not contacted before the first request, and may be unavailable for a time.
    """
    settings = settings or ServiceSettings()
    connection = settings.connect(socket_timeout=STORE_TIMEOUT_SECONDS)
    store = Store(connection)
    representations = RepresentationCache(settings.hot_bytes, settings.sent_bytes)
    hub = Hub(settings.connect_async)
    context = Context(settings, core_version(), store, Metrics(store), representations, hub)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        beats = asyncio.create_task(_beat())
        # in a thread that neither the first answers nor an early end waits for
        making = Thread(target=make_document, daemon=True)
        later = asyncio.get_running_loop().call_later(_DOCUMENT_AFTER_SECONDS, making.start)
        try:
            yield
        finally:
            later.cancel()
            beats.cancel()
            await hub.close()
            connection.close()

    app = FastAPI(title="grazemap", version=__version__, openapi_url=None, lifespan=lifespan)
    app.state.context = context
    problems.install(app)
    middleware.install(app, settings, context.metrics)
    for module in _ROUTERS:
        app.include_router(module.router)
    docs.install(app, settings.frame_origins)
    make_document = openapi.install(app, keys=settings.needs_keys, masses=settings.max_masses)
    return app


async def _beat() -> None:
    """Send a sign of life every few seconds, as long as the event loop runs; release memory that is not needed."""
    memory = IdleMemory()
    while True:
        watchdog.beat()
        memory.look()
        await asyncio.sleep(watchdog.INTERVAL_SECONDS)
