"""The one reader of the events of Redis."""

from __future__ import annotations

import asyncio
import time
from contextlib import nullcontext
from types import SimpleNamespace, TracebackType
from typing import Any, cast

import pytest
import redis.exceptions

from grazemap_service.app import create_app
from grazemap_service.hub import EventListener, Hub
from grazemap_service.routers.events import _messages
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store.records import JobEvent


class LosesACancellation:
    """A client of Redis whose subscription ends with a timeout at the moment at which it is cancelled."""

    cancelled = 0

    def pubsub(self) -> LosesACancellation:
        return self

    async def __aenter__(self) -> LosesACancellation:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None: ...

    async def subscribe(self, _channel: str) -> None:
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            self.cancelled += 1
            raise redis.exceptions.TimeoutError from None

    async def aclose(self) -> None: ...


def test_it_closes_where_a_cancellation_is_lost() -> None:
    client: Any = LosesACancellation()

    async def run() -> None:
        hub = Hub(lambda: client)
        with hub.listen("job"):
            await asyncio.sleep(0.05)
        await asyncio.wait_for(hub.close(), 5.0)

    asyncio.run(run())
    assert client.cancelled == 1


def test_an_answer_of_the_store_is_shared_unless_it_is_too_old_or_events_were_missed() -> None:
    asked = 0

    async def look() -> int:
        nonlocal asked
        asked += 1
        await asyncio.sleep(0.01)
        return asked

    async def run() -> None:
        client: Any = None
        hub = Hub(lambda: client)
        hub._subscribed_at = began = time.monotonic()
        assert await asyncio.gather(*(hub.shared("job", began, look) for _ in range(3))) == [1, 1, 1]
        assert await hub.shared("job", began, look) == 1
        assert await hub.shared("other", began, look) == 2
        assert await hub.shared("job", time.monotonic(), look) == 3
        hub._subscribed_at = time.monotonic()
        assert await hub.shared("job", began, look) == 4

    asyncio.run(run())


def test_an_answer_that_was_cancelled_is_asked_for_again() -> None:
    async def hang() -> int:
        await asyncio.sleep(60)
        return 0

    async def look() -> int:
        return 1

    async def run() -> None:
        client: Any = None
        hub = Hub(lambda: client)
        hub._subscribed_at = began = time.monotonic()
        first = asyncio.ensure_future(hub.shared("job", began, hang))
        await asyncio.sleep(0.01)
        hub._shared_answers["job"][1].cancel()
        with pytest.raises(asyncio.CancelledError):
            await first
        assert await hub.shared("job", began, look) == 1

    asyncio.run(run())


def test_a_subscription_is_not_waited_for_longer_than_asked() -> None:
    async def run() -> None:
        hub = Hub(lambda: cast(Any, LosesACancellation()))
        with hub.listen("job"):
            began = time.monotonic()
            assert await hub.ended_since("job", began, 0.05) == (False, None)
            assert time.monotonic() - began < 1.5
        await hub.close()

    asyncio.run(run())


def test_a_lifespan_that_is_left_by_an_error_closes_the_hub(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[Hub] = []

    async def close(self: Hub) -> None:
        closed.append(self)

    async def run() -> None:
        app = create_app(ServiceSettings(redis_url="redis://127.0.0.1:9"))
        async with app.router.lifespan_context(app):
            raise ZeroDivisionError

    monkeypatch.setattr(Hub, "close", close)
    with pytest.raises(ZeroDivisionError):
        asyncio.run(run())
    assert len(closed) == 1


def test_a_listener_gets_all_that_waits_at_once_and_is_told_what_it_missed() -> None:
    async def run() -> None:
        listener = EventListener()
        events = [JobEvent(f"{k}-0", "tile", "{}") for k in range(1001)]
        for event in events[:3]:
            listener.put(event)
        assert await listener.next(1.0) == events[:3]
        for event in events:
            listener.put(event)
        assert await listener.next(1.0) == [None]

    asyncio.run(run())


def test_the_ends_that_nobody_takes_are_not_kept_without_end() -> None:
    """A client that does not read its batch; the ends of all jobs come to it."""

    async def run() -> int:
        hub = Hub(lambda: cast(Any, LosesACancellation()))
        with hub.listen_to_ends() as ended:
            for number in range(25_000):
                hub._pass_on(f'{number}\n1-0\ndone\n{{"status": "successful"}}'.encode())
            most, items = ended.qsize(), [ended.get_nowait() for _ in range(ended.qsize())]
        await hub.close()
        assert None in items  # some were missed, so all are looked at
        assert items[-1] == "24999"
        return most

    assert asyncio.run(run()) <= 10_000


def test_what_comes_after_a_gap_waits_for_what_the_gap_has() -> None:
    tile, done = JobEvent("5-0", "tile", "{}"), JobEvent("9-0", "done", "{}")
    looks = iter([("running", [], None), ("successful", [tile, done], None)])

    async def shared(*_: Any) -> Any:
        return next(looks)

    async def behind_a_gap(_seconds: float) -> list[JobEvent | None]:
        return [None, done]

    listener = SimpleNamespace(next=behind_a_gap)
    hub = SimpleNamespace(shared=shared, listen=lambda _job: nullcontext(listener))

    async def run() -> bytes:
        context: Any = SimpleNamespace(hub=hub, threads=None)
        return b"".join([message async for message in _messages(context, "a" * 64, "", "1-0")])

    sent = asyncio.run(run())
    assert 0 < sent.index(b"5-0") < sent.index(b"9-0")
