"""Says once a second what the workers of a machine are doing before they are ready."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

from redis.exceptions import RedisError

from grazemap_worker.store import Store

_EVERY_SECONDS = 1.0


@contextmanager
def said(store: Store, text: Callable[[], str]) -> Iterator[None]:
    """Store `text()` once a second within this block, for the service's /readyz; Redis may be away."""
    ended = Event()

    def say() -> None:
        while True:
            with suppress(RedisError):
                store.workers.say_starting(text())
            if ended.wait(_EVERY_SECONDS):
                return

    thread = Thread(target=say, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        with suppress(RedisError):
            store.workers.say_starting("")
