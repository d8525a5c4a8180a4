"""The objects that the routes of one app share, as dependencies of FastAPI."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import anyio
from fastapi import Depends, Request

from grazemap_service.hub import Hub
from grazemap_service.keys import Key
from grazemap_service.metrics import Metrics
from grazemap_service.representations import RepresentationCache
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store

_STORE_THREADS = 40


@dataclass(frozen=True)
class Context:
    """The objects of one app."""

    settings: ServiceSettings
    """Settings of the service, from environment variables."""
    core_version: str
    """Version of the core whose results are served."""
    store: Store
    """Jobs, tiles and results in Redis."""
    metrics: Metrics
    """Metrics for Prometheus."""
    representations: RepresentationCache
    """Results as JSON or npz."""
    hub: Hub
    """Distributes the events of jobs to the requests that follow them."""
    threads: anyio.CapacityLimiter = field(default_factory=lambda: anyio.CapacityLimiter(_STORE_THREADS))
    """Limits the number of threads in which routes call the store. These are not the threads of the framework, so
    other pages are not delayed when Redis does not respond."""


async def get_context(request: Request) -> Context:
    """Return the context of the app that serves a request."""
    context: Context = request.app.state.context
    return context


CurrentContext = Annotated[Context, Depends(get_context)]


async def get_key(request: Request) -> Key | None:
    """Return the API key of a request; None if the service needs no keys."""
    key: Key | None = getattr(request.state, "key", None)
    return key


CurrentKey = Annotated[Key | None, Depends(get_key)]
