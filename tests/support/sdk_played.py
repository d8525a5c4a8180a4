"""Both clients' connections with a clock that only pauses move, and answers from a function instead of a network."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import httpx2

from grazemap import constants
from grazemap.client.blocking import run
from grazemap.client.connection import AsyncConnection, Connection
from grazemap.client.events import Event
from grazemap.client.http import ConnectionSettings
from grazemap.client.watch import Follower


class Lines(httpx2.SyncByteStream, httpx2.AsyncByteStream):
    """A streamed body whose lines are taken from a generator one by one."""

    def __init__(self, lines: Iterator[str], closed: Callable[[], None]) -> None:
        self._lines = lines
        self._closed = closed

    def close(self) -> None:
        self._closed()

    async def aclose(self) -> None:
        self._closed()

    def __iter__(self) -> Iterator[bytes]:
        for line in self._lines:
            yield f"{line}\n".encode()

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for line in self._lines:
            yield f"{line}\n".encode()


class Played:
    """`answer` gives the response to a request, or an exception to be raised."""

    def __init__(self, kind: str, answer: Callable[[httpx2.Request], httpx2.Response | Exception]) -> None:
        self.now = 1000.0
        self.slept: list[float] = []
        self.events: list[Event] = []
        self.listen: Callable[[Event], None] = self.events.append
        self.requests: list[httpx2.Request] = []
        self._answer = answer
        self._awaited = kind == "async"

    def _handle_class(self, request: httpx2.Request) -> httpx2.Response:
        self.requests.append(request)
        assert len(self.requests) < 10_000, "it does not come to an end"
        outcome = self._answer(request)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    async def _sleep(self, seconds: float) -> None:
        assert seconds >= 0
        self.now += seconds
        self.slept.append(seconds)

    def _connection(self, retries: int) -> Any:
        settings = ConnectionSettings("http://fake:1", None, None, constants.DEFAULT_TIMEOUT, retries)
        transport = httpx2.MockTransport(self._handle_class)
        connection: Any = AsyncConnection(settings, transport) if self._awaited else Connection(settings, transport)
        connection.now = lambda: self.now
        connection.sleep = self._sleep
        return connection

    def _run(self, retries: int, call: Callable[[Any], Any]) -> Any:
        connection = self._connection(retries)

        async def awaited() -> Any:
            try:
                return await call(connection)
            finally:
                await connection.close()

        return asyncio.run(awaited()) if self._awaited else run(awaited())

    def send(self, retries: int, deadline: float | None = None) -> httpx2.Response:
        return self._run(retries, lambda connection: connection.send("GET", "/v1", deadline=deadline))

    def follow(self, path: str, timeout: float | None = None, **keywords: Any) -> Any:
        return self._run(5, lambda connection: Follower(connection, path, timeout, **keywords).run(self.listen))
