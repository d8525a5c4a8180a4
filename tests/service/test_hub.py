"""The one reader of the events of Redis."""

from __future__ import annotations

import asyncio
from types import TracebackType
from typing import Any

import redis.exceptions

from grazemap_service.hub import Hub


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
