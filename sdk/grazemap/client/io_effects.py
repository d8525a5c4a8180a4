"""The border between what the client does and how bytes move.

A flow (`flows.py`) is a generator: it yields one of the effects below and is sent its outcome. The two drivers
(`driver.py`, `async_driver.py`) perform effects; they hold no decisions. So every rule about retries, events,
timeouts and caches exists once, and is tested without a network or a clock.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Send:
    """Send a request and read the whole answer; the outcome is a `Reply` or a raised `LinkBroken`."""

    method: str
    path: str
    params: Mapping[str, str | int] = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes | None = None


@dataclass(frozen=True)
class Reply:
    """An answer; header names are lower case."""

    status: int
    headers: Mapping[str, str]
    content: bytes = b""


@dataclass(frozen=True)
class OpenStream:
    """Open a streamed answer, closing the one before; the outcome is a `Reply`, without content when its status is 200.

    `silence` is how many seconds may pass without a byte before `NextLine` raises `LinkBroken`.
    """

    path: str
    headers: Mapping[str, str]
    silence: float


@dataclass(frozen=True)
class NextLine:
    """Read a line of the open stream; the outcome is its text without the line's end, or None after the last one."""


@dataclass(frozen=True)
class CloseStream:
    """Close the open stream, if there is one."""


@dataclass(frozen=True)
class Sleep:
    """Wait for some seconds."""

    seconds: float


@dataclass(frozen=True)
class Now:
    """The outcome is the seconds of a clock that never goes back."""


@dataclass(frozen=True)
class Event:
    """One server-sent event of a job.

    Attributes
    ----------
    id : str
        Its place in the job's stream; "" when the client made the event from polling.
    name : {"progress", "tile", "done"}
    data : dict
        progress: done, total, unit, eta_seconds; tile: index, rows; done: status.
    """

    id: str
    name: str
    data: dict[str, Any]


Effect = Send | OpenStream | NextLine | CloseStream | Sleep | Now | Event
"""What a flow may yield. Yielding an `Event` hands it to whoever listens."""

Flow = Generator[Effect, Any, T]


class LinkBroken(Exception):
    """No connection, or one that ended in the middle. `retryable` is False when trying again cannot help."""

    def __init__(self, reason: str, retryable: bool = True) -> None:
        super().__init__(reason)
        self.retryable = retryable
