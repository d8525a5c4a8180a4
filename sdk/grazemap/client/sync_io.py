"""Performs a flow's effects with blocking calls."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager
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
from grazemap.errors import ProtocolError

T = TypeVar("T")


class Driver:
    """Runs flows over one `httpx2.Client`."""

    def __init__(self, http: httpx2.Client) -> None:
        self._http = http

    def run(self, flow: Flow[T], listen: Callable[[Event], None] | None = None) -> T:
        """Run a flow to its end, hand each of its events to `listen`, and return its value."""
        events = self.events(flow)
        while True:
            try:
                event = next(events)
            except StopIteration as end:
                value: T = end.value
                return value
            if listen is not None:
                listen(event)

    def events(self, flow: Flow[T]) -> Generator[Event, None, T]:
        """Run a flow, yielding its events as they come; its value is the generator's."""
        stream = _Stream(self._http)
        outcome: Any = None
        broken: LinkBroken | ProtocolError | None = None
        try:
            while True:
                try:
                    effect = flow.send(outcome) if broken is None else flow.throw(broken)
                except StopIteration as end:
                    value: T = end.value
                    return value
                outcome, broken = None, None
                if isinstance(effect, Event):
                    yield effect
                    continue
                try:
                    outcome = self._perform(effect, stream)
                except httpx2.RequestError as error:
                    broken = failure_of(error)
        finally:
            stream.close()
            flow.close()

    def _perform(self, effect: Effect, stream: _Stream) -> Any:
        match effect:
            case Send():
                response = self._http.request(
                    effect.method, effect.path, params=effect.params, headers=effect.headers, content=effect.body
                )
                return reply_of(response, response.content)
            case OpenStream():
                return stream.open(effect)
            case NextLine():
                return next(stream.lines, None)
            case CloseStream():
                return stream.close()
            case Sleep():
                return time.sleep(effect.seconds)
            case Now():
                return time.monotonic()
            case _:
                raise TypeError(f"no such effect: {type(effect).__name__}")


class _Stream:
    """The one streamed answer that a flow may have open."""

    def __init__(self, http: httpx2.Client) -> None:
        self._http = http
        self._context: AbstractContextManager[httpx2.Response] | None = None
        self.lines: Iterator[str] = iter(())

    def open(self, effect: OpenStream) -> Reply:
        self.close()
        context = self._http.stream(
            "GET", effect.path, headers=effect.headers, timeout=stream_timeout(self._http.timeout, effect)
        )
        response = context.__enter__()
        self._context = context
        if response.status_code != 200:
            return reply_of(response, response.read())
        self.lines = response.iter_lines()
        return reply_of(response, b"")

    def close(self) -> None:
        context, self._context, self.lines = self._context, None, iter(())
        if context is not None:
            context.__exit__(None, None, None)


def reply_of(response: httpx2.Response, content: bytes) -> Reply:
    """Return an answer as the flows see it."""
    return Reply(response.status_code, {name.lower(): value for name, value in response.headers.items()}, content)


def failure_of(error: httpx2.RequestError) -> LinkBroken | ProtocolError:
    """Return what the flows are told of an error on the way; a wrong kind of address is not tried twice."""
    if not isinstance(error, httpx2.TransportError):
        return ProtocolError(f"the answer cannot be read: {error}")
    url = error.request.url
    reason = f"{url.scheme}://{url.netloc.decode('ascii')}: {error or type(error).__name__}"
    return LinkBroken(reason, retryable=not isinstance(error, httpx2.UnsupportedProtocol))


def stream_timeout(usual: httpx2.Timeout, effect: OpenStream) -> httpx2.Timeout:
    """Return the client's timeouts, except that a stream may be silent for its own time."""
    return httpx2.Timeout(connect=usual.connect, read=effect.silence, write=usual.write, pool=usual.pool)
