"""Says once a second what a process is doing: the workers of a machine before they are ready, a tile that compiles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

from redis.exceptions import RedisError

_EVERY_SECONDS = 1.0


@contextmanager
def said(say: Callable[[str], None], text: Callable[[], str]) -> Iterator[None]:
    """Call `say(text())` once a second within this block, and `say("")` at its end; Redis may be away."""
    ended = Event()

    def repeat() -> None:
        while True:
            with suppress(RedisError):
                say(text())
            if ended.wait(_EVERY_SECONDS):
                return

    thread = Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        with suppress(RedisError):
            say("")
