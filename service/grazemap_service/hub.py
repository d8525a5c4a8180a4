"""Distributes the events of jobs: one reader of the event channel in Redis, on the event loop, serves all requests.

A listener misses events if it is too slow, or if the reader is disconnected from Redis. It then gets None, and reads
the events that the store has kept.
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
from grazemap_worker.store.records import JobEvent

T = TypeVar("T")

# Maximum number of events that wait for a listener.
_MAX_WAITING = 1000
# Maximum number of ended jobs that are remembered, or that wait for a listener of `listen_to_ends`.
_MAX_ENDED = 10_000
# Maximum seconds for which a request waits until the reader is subscribed to the events: at first, or after the reader
# has lost the connection to Redis.
_PATIENCE_SECONDS = 2.0
# Seconds between attempts to connect while Redis is unavailable.
_AWAY_SECONDS = 0.5
# Seconds for which requests share an answer of the store, from the time at which the store was asked.
_SHARED_SECONDS = 1.0
# Seconds between attempts to cancel the reader.
_CANCEL_SECONDS = 0.2


class EventListener:
    """The events of one job from now on."""

    def __init__(self) -> None:
        self._events: asyncio.Queue[JobEvent | None] = asyncio.Queue(_MAX_WAITING)

    async def next(self, seconds: float) -> list[JobEvent | None]:
        """Return the next events; a None means that events were missed. Raises TimeoutError if none comes in time."""
        events = [await asyncio.wait_for(self._events.get(), seconds)]
        while not self._events.empty():
            events.append(self._events.get_nowait())
        return events

    def put(self, event: JobEvent | None) -> None:
        """Pass on an event, or None if events were missed. If too many events wait, a None replaces all of them."""
        _put(self._events, event)


def _put(waiting: asyncio.Queue[T | None], item: T | None) -> None:
    """Put an item into a queue; if the queue is full, replace its items by a None."""
    if waiting.full():
        while not waiting.empty():
            waiting.get_nowait()
        item = None
    waiting.put_nowait(item)


def _has_failed(answer: asyncio.Future[Any]) -> bool:
    """Return whether an answer was cancelled or is an exception."""
    return answer.done() and (answer.cancelled() or answer.exception() is not None)


class Hub:
    """Passes the events of all jobs to their listeners.

    Parameters
    ----------
    connect : callable
        Returns a client of Redis.
    """

    def __init__(self, connect: Callable[[], redis.asyncio.Redis]) -> None:
        self._connect = connect
        self._listeners: dict[str, set[EventListener]] = {}
        self._end_queues: set[asyncio.Queue[str | None]] = set()
        self._task: asyncio.Task[None] | None = None
        # when the present subscription to the events began; infinite: there is none
        self._subscribed_at = math.inf
        self._subscribed = asyncio.Event()
        self._shared_answers: dict[Hashable, tuple[float, asyncio.Future[Any]]] = {}
        # the last jobs that ended, with time and status, for requests that begin to listen too late
        self._last_ended: OrderedDict[str, tuple[float, Status]] = OrderedDict()

    @contextmanager
    def listen(self, job_id: str) -> Iterator[EventListener]:
        """Listen to the events of a job within this block."""
        listener = EventListener()
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
    def listen_to_ends(self) -> Iterator[asyncio.Queue[str | None]]:
        """Give a queue of the ids of all jobs that end during this block; a None means that ids were missed."""
        queue: asyncio.Queue[str | None] = asyncio.Queue(_MAX_ENDED)
        self._start()
        self._end_queues.add(queue)
        try:
            yield queue
        finally:
            self._end_queues.discard(queue)

    def _start(self) -> None:
        if self._task is None or self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._read())

    async def ended_since(self, job_id: str, began: float, max_wait: float) -> tuple[bool, Status | None]:
        """Return two values about the time since `began` (monotonic seconds).

        The first value says whether all events since then were received. The second value is the status with which the
        job has ended since then, or None if no end of the job was received. If there is no subscription to the events,
        this waits for it, at most `max_wait` seconds.
        """
        if not self._subscribed.is_set():
            with suppress(TimeoutError):
                await asyncio.wait_for(self._subscribed.wait(), min(max_wait, _PATIENCE_SECONDS))
        when, status = self._last_ended.get(job_id, (-math.inf, None))
        return self._subscribed_at < began, status if when > began else None

    async def shared(self, key: Hashable, not_before: float, look: Callable[[], Awaitable[T]]) -> T:
        """Return what `look` returns; calls with the same key at about the same time share one call of `look`.

        An earlier call of `look` is shared only if it began after `not_before` (monotonic seconds), and after the
        present subscription to the events. While there is no subscription, no earlier call is shared.
        """
        subscribed_at = self._subscribed_at if math.isfinite(self._subscribed_at) else time.monotonic()
        began, answer = self._shared_answers.get(key, (-math.inf, None))
        if answer is None or began < max(not_before, subscribed_at) or _has_failed(answer):
            answer = asyncio.ensure_future(look())
            self._shared_answers[key] = (time.monotonic(), answer)
            asyncio.get_running_loop().call_later(_SHARED_SECONDS, self._forget, key, answer)
        return cast(T, await asyncio.shield(answer))

    def _forget(self, key: Hashable, answer: asyncio.Future[Any]) -> None:
        if self._shared_answers.get(key, (0.0, None))[1] is answer:
            del self._shared_answers[key]

    async def close(self) -> None:
        """Stop reading."""
        while self._task is not None and not self._task.done():
            # a cancellation may get lost when a reply or a timeout arrives at the same moment, so it is repeated
            self._task.cancel()
            await asyncio.wait([self._task], timeout=_CANCEL_SECONDS)

    async def _read(self) -> None:
        while True:
            client = self._connect()
            try:
                async with client.pubsub() as channel:
                    await channel.subscribe(EVENTS_CHANNEL)
                    self._subscribed_at = time.monotonic()
                    self._subscribed.set()
                    self._missed()
                    async for message in channel.listen():
                        if message["type"] == "message":
                            self._pass_on(message["data"])
            except redis.exceptions.RedisError:
                structlog.get_logger("grazemap_service").warning("events wait for the store")
            finally:
                self._subscribed.clear()
                self._subscribed_at = math.inf
                with suppress(redis.exceptions.RedisError):
                    await client.aclose()
            await asyncio.sleep(_AWAY_SECONDS)

    def _pass_on(self, data: bytes) -> None:
        try:
            job_id, number, name, text = data.decode().split("\n", 3)
            event = JobEvent(number, name, text)
            content = event.data
            if "\n" in text or "\r" in text:  # a line break would split it into several messages
                return
            ended = content["status"] if name == "done" else None
        except (ValueError, LookupError, TypeError):  # another program has published it
            return
        if ended is not None:
            self._last_ended[job_id] = (time.monotonic(), ended)
            self._last_ended.move_to_end(job_id)
            while len(self._last_ended) > _MAX_ENDED:
                self._last_ended.popitem(last=False)
            for queue in self._end_queues:
                _put(queue, job_id)
        for listener in self._listeners.get(job_id, ()):
            listener.put(event)

    def _missed(self) -> None:
        for queue in self._end_queues:
            _put(queue, None)
        for listeners in self._listeners.values():
            for listener in listeners:
                listener.put(None)
