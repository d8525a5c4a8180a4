"""What happens to jobs, as it happens: one reader of Redis' channel of events, on the event loop, for all requests.

A listener that is too slow misses events, and so does a reader that was disconnected: the listener then gets None, and
reads what the store has kept.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar, cast

import redis.asyncio
import redis.exceptions
import structlog

from grazemap.wire import Status
from grazemap_worker.store.keys import EVENTS_CHANNEL
from grazemap_worker.store.records import Event

T = TypeVar("T")

_MOST_WAITING = 1000
_MOST_ENDED = 10_000
# Seconds to wait for the first connection.
_PATIENCE_SECONDS = 2.0
# Seconds between attempts while Redis is unavailable.
_AWAY_SECONDS = 0.5
# Seconds for which an answer of the store is shared.
_SHARED_SECONDS = 1.0
# Seconds between requests to stop reading.
_CANCEL_SECONDS = 0.2


class Listener:
    """The events of one job from now on."""

    def __init__(self) -> None:
        self._events: asyncio.Queue[Event | None] = asyncio.Queue(_MOST_WAITING)

    async def next(self, seconds: float) -> list[Event | None]:
        """Return the next events, None where some were missed. Raises TimeoutError after so many seconds."""
        heard = [await asyncio.wait_for(self._events.get(), seconds)]
        while not self._events.empty():
            heard.append(self._events.get_nowait())
        return heard

    def put(self, event: Event | None) -> None:
        """Pass an event on; None: some were missed. One that is too slow misses everything that waits."""
        _put(self._events, event)


def _put(waiting: asyncio.Queue[T | None], item: T | None) -> None:
    """Put an item into a queue, or None in place of everything where the queue is full."""
    if waiting.full():
        while not waiting.empty():
            waiting.get_nowait()
        item = None
    waiting.put_nowait(item)


class Hub:
    """Passes the events of all jobs to those who listen.

    Parameters
    ----------
    connect : callable
        Returns a client of Redis.
    """

    def __init__(self, connect: Callable[[], redis.asyncio.Redis]) -> None:
        self._connect = connect
        self._listeners: dict[str, set[Listener]] = {}
        self._ends: set[asyncio.Queue[str | None]] = set()
        self._task: asyncio.Task[None] | None = None
        self._since = math.inf
        self._subscribed = asyncio.Event()
        self._looks: dict[Hashable, tuple[float, asyncio.Future[Any]]] = {}
        # the last jobs that ended, by when, for those who listen a moment too late
        self._ended: OrderedDict[str, tuple[float, Status]] = OrderedDict()

    @contextmanager
    def listen(self, job_id: str) -> Iterator[Listener]:
        """Listen to the events of a job within this block."""
        listener = Listener()
        self._start()
        self._listeners.setdefault(job_id, set()).add(listener)
        try:
            yield listener
        finally:
            remaining = self._listeners[job_id]
            remaining.discard(listener)
            if not remaining:
                del self._listeners[job_id]

    @contextmanager
    def ends(self) -> Iterator[asyncio.Queue[str | None]]:
        """Give the ids of all jobs that end within this block; None: some were missed."""
        ended: asyncio.Queue[str | None] = asyncio.Queue(_MOST_ENDED)
        self._start()
        self._ends.add(ended)
        try:
            yield ended
        finally:
            self._ends.discard(ended)

    def _start(self) -> None:
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._read())

    async def ended_since(self, job_id: str, began: float) -> tuple[bool, Status | None]:
        """Return whether events have arrived since `began` (monotonic seconds), and how the job has ended since."""
        if not self._subscribed.is_set():
            with suppress(TimeoutError):
                await asyncio.wait_for(self._subscribed.wait(), _PATIENCE_SECONDS)
        when, status = self._ended.get(job_id, (-math.inf, None))
        return self._since < began, status if when > began else None

    async def shared(self, key: Hashable, not_before: float, look: Callable[[], Awaitable[T]]) -> T:
        """Return what `look` returns for a key, once for all who ask for it at about the same time.

        An answer that was begun before `not_before` (monotonic seconds), or before events were last missed, is not
        given.
        """
        not_before = max(not_before, self._since if math.isfinite(self._since) else time.monotonic())
        began, found = self._looks.get(key, (-math.inf, None))
        if found is None or began < not_before or (found.done() and found.exception() is not None):
            found = asyncio.ensure_future(look())
            self._looks[key] = (time.monotonic(), found)
            asyncio.get_running_loop().call_later(_SHARED_SECONDS, self._forget, key, found)
        return cast(T, await asyncio.shield(found))

    def _forget(self, key: Hashable, found: asyncio.Future[Any]) -> None:
        if self._looks.get(key, (0.0, None))[1] is found:
            del self._looks[key]

    async def close(self) -> None:
        """Stop reading."""
        while self._task is not None and not self._task.done():
            # what is awaited in there may lose a cancellation to a reply or a timeout of the same moment
            self._task.cancel()
            await asyncio.wait([self._task], timeout=_CANCEL_SECONDS)

    async def _read(self) -> None:
        while True:
            client = self._connect()
            try:
                async with client.pubsub() as channel:
                    await channel.subscribe(EVENTS_CHANNEL)
                    self._since = time.monotonic()
                    self._subscribed.set()
                    self._missed()
                    async for message in channel.listen():
                        if message["type"] == "message":
                            self._pass_on(message["data"])
            except redis.exceptions.RedisError:
                structlog.get_logger("grazemap_service").warning("events wait for the store")
            finally:
                self._subscribed.clear()
                self._since = math.inf
                with suppress(redis.exceptions.RedisError):
                    await client.aclose()
            await asyncio.sleep(_AWAY_SECONDS)

    def _pass_on(self, data: bytes) -> None:
        try:
            job_id, number, name, text = data.decode().split("\n", 3)
            event = Event(number, name, text)
            told = event.data
            if "\n" in text or "\r" in text:  # it would be more than one message
                return
            ended = told["status"] if name == "done" else None
        except (ValueError, LookupError, TypeError):  # not of ours
            return
        if ended is not None:
            self._ended[job_id] = (time.monotonic(), ended)
            self._ended.move_to_end(job_id)
            while len(self._ended) > _MOST_ENDED:
                self._ended.popitem(last=False)
            for ids in self._ends:
                _put(ids, job_id)
        for listener in self._listeners.get(job_id, ()):
            listener.put(event)

    def _missed(self) -> None:
        for ids in self._ends:
            _put(ids, None)
        for listeners in self._listeners.values():
            for listener in listeners:
                listener.put(None)
