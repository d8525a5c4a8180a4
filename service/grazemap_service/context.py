"""The objects of one app, which its routes depend on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import anyio
from fastapi import Depends, Request

from grazemap_service.hub import Hub
from grazemap_service.keys import Key
from grazemap_service.metrics import Metrics
from grazemap_service.representations import Renderings
from grazemap_service.settings import Settings
from grazemap_worker.store import Store

_STORE_THREADS = 40


@dataclass(frozen=True)
class Context:
    """The objects of one app.

    Routes call the store in threads, limited by `threads`. These are not the framework's threads, so that a Redis that
    does not respond does not delay other pages.
    """

    settings: Settings
    core_version: str
    store: Store
    metrics: Metrics
    renderings: Renderings
    hub: Hub
    threads: anyio.CapacityLimiter = field(default_factory=lambda: anyio.CapacityLimiter(_STORE_THREADS))


async def get_context(request: Request) -> Context:
    """Return the context of the app that serves a request."""
    context: Context = request.app.state.context
    return context


CurrentContext = Annotated[Context, Depends(get_context)]


async def get_key(request: Request) -> Key | None:
    """Return the key that a request was sent with; None where the service needs none."""
    key: Key | None = getattr(request.state, "key", None)
    return key


CurrentKey = Annotated[Key | None, Depends(get_key)]
