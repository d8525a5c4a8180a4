"""Both clients as one: every test of what a client does runs over the blocking and the asynchronous one."""

from __future__ import annotations

import asyncio
import inspect
import sys
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from grazemap import AsyncClient, Client, constants
from tests.support.sdk_fake_service import FakeService, served


class Awaited:
    """Calls a coroutine method like a plain one."""

    def __init__(self, target: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._target = target
        self._loop = loop

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._target, name)
        if not callable(value):
            return value

        def call(*arguments: Any, **keywords: Any) -> Any:
            outcome = value(*arguments, **keywords)
            if inspect.isasyncgen(outcome):
                return self._loop.run_until_complete(_collected(outcome))
            return self._wrap(self._loop.run_until_complete(outcome))

        return call

    def _wrap(self, outcome: Any) -> Any:
        if isinstance(outcome, list):
            return [self._wrap(item) for item in outcome]
        return Awaited(outcome, self._loop) if type(outcome).__name__ == "AsyncJobHandle" else outcome


async def _collected(items: Any) -> list[Any]:
    return [item async for item in items]


@pytest.fixture(autouse=True)
def closed_figures() -> Iterator[None]:
    """Close the figures of pyplot that a test has drawn."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def service() -> FakeService:
    return FakeService()


@pytest.fixture
def url(service: FakeService) -> Iterator[str]:
    """The address of the fake service on a real socket."""
    with served(service) as address:
        yield address


@pytest.fixture(params=["blocking", "async"])
def make_client(request: pytest.FixtureRequest, service: FakeService, monkeypatch: pytest.MonkeyPatch):
    """Gives `make_client(**keywords)`: a client of the fake service."""
    monkeypatch.setattr(constants, "BACKOFF_START", 0.001)
    monkeypatch.setattr(constants, "POLL_START", 0.001)
    transport = httpx2.MockTransport(service)
    loop = asyncio.new_event_loop()
    made: list[Any] = []

    def make(**keywords: Any) -> Any:
        kind = Client if request.param == "blocking" else AsyncClient
        client: Any = kind("http://fake:1", transport=transport, **keywords)
        made.append(client if request.param == "blocking" else Awaited(client, loop))
        return made[-1]

    yield make
    for client in made:
        client.close()
    loop.run_until_complete(_settled())
    loop.run_until_complete(loop.shutdown_asyncgens())
    loop.close()


async def _settled() -> None:
    """Wait for the ends of asynchronous generators that were left, which the loop has been asked to close."""
    await asyncio.sleep(0.0)
    while others := asyncio.all_tasks() - {asyncio.current_task()}:
        await asyncio.wait(others)


@pytest.fixture
def client(make_client: Any) -> Any:
    return make_client()
