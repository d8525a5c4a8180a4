"""Performs a flow's effects on an asyncio event loop."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, aclosing
from typing import Any, TypeVar

import httpx2

from grazemap.client.io_effects import (
    CloseStream,
    Effect,
    Event,
    Flow,
    LinkBroken,
    NextLine,
    Now,
    OpenStream,
    Reply,
    Send,
    Sleep,
)
from grazemap.client.sync_io import failure_of, reply_of, stream_timeout
from grazemap.errors import ProtocolError

T = TypeVar("T")


class AsyncDriver:
    """Runs flows over one `httpx2.AsyncClient`."""

    def __init__(self, http: httpx2.AsyncClient) -> None:
        self._http = http

    async def run(self, flow: Flow[T], listen: Callable[[Event], None] | None = None) -> T:
        """Run a flow to its end, hand each of its events to `listen`, and return its value."""
        value: list[T] = []
        async with aclosing(self.events(flow, value.append)) as events:
            async for event in events:
                if listen is not None:
                    listen(event)
        return value[0]

    async def events(self, flow: Flow[T], finish: Callable[[T], None]) -> AsyncGenerator[Event]:
        """Run a flow, yielding its events as they come; its value is handed to `finish`."""
        stream = _Stream(self._http)
        outcome: Any = None
        broken: LinkBroken | ProtocolError | None = None
        try:
            while True:
                try:
                    effect = flow.send(outcome) if broken is None else flow.throw(broken)
                except StopIteration as end:
                    finish(end.value)
                    return
                outcome, broken = None, None
                if isinstance(effect, Event):
                    yield effect
                    continue
                try:
                    outcome = await self._perform(effect, stream)
                except httpx2.RequestError as error:
                    broken = failure_of(error)
        finally:
            flow.close()
            await stream.close()

    async def _perform(self, effect: Effect, stream: _Stream) -> Any:
        match effect:
            case Send():
                response = await self._http.request(
                    effect.method, effect.path, params=effect.params, headers=effect.headers, content=effect.body
                )
                return reply_of(response, response.content)
            case OpenStream():
                return await stream.open(effect)
            case NextLine():
                return await anext(stream.lines, None) if stream.lines is not None else None
            case CloseStream():
                return await stream.close()
            case Sleep():
                return await asyncio.sleep(effect.seconds)
            case Now():
                return time.monotonic()
            case _:
                raise TypeError(f"no such effect: {type(effect).__name__}")


class _Stream:
    """The one streamed answer that a flow may have open."""

    def __init__(self, http: httpx2.AsyncClient) -> None:
        self._http = http
        self._context: AbstractAsyncContextManager[httpx2.Response] | None = None
        self.lines: AsyncIterator[str] | None = None

    async def open(self, effect: OpenStream) -> Reply:
        await self.close()
        context = self._http.stream(
            "GET", effect.path, headers=effect.headers, timeout=stream_timeout(self._http.timeout, effect)
        )
        response = await context.__aenter__()
        self._context = context
        if response.status_code != 200:
            return reply_of(response, await response.aread())
        self.lines = response.aiter_lines()
        return reply_of(response, b"")

    async def close(self) -> None:
        context, self._context, self.lines = self._context, None, None
        if context is not None:
            await context.__aexit__(None, None, None)
