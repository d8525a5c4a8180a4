"""Bounds on connections, so that requests that never end do not keep others out.

uvicorn closes idle connections between requests, but waits indefinitely for the rest of a request. `bounded` returns a
protocol that closes a connection whose request does not arrive in time, and closes new ones at once when there are too
many: a process without file descriptors could neither answer nor reach Redis.
"""

from __future__ import annotations

import asyncio
import resource

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

# Seconds for line, headers and body of a request together.
REQUEST_SECONDS = 30.0
# File descriptors that are not for clients: Redis, the listening socket, files of the pages.
_RESERVED = 64
_FEWEST = 16


def _by_descriptors() -> int:
    """Return how many connections this process takes, by its limit of file descriptors."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(_FEWEST, limit - _RESERVED) if limit != resource.RLIM_INFINITY else 1 << 16


def bounded(request_seconds: float = REQUEST_SECONDS, most_connections: int | None = None) -> type[H11Protocol]:
    """Return uvicorn's protocol with a deadline for requests and a limit of connections.

    Parameters
    ----------
    request_seconds : float
        From a connection's beginning, or from the first byte of a later request, to the request's last byte.
    most_connections : int, optional
        By the limit of file descriptors when left out.
    """
    most = most_connections if most_connections is not None else _by_descriptors()

    class BoundedProtocol(H11Protocol):
        """A connection that ends when its request does not arrive."""

        _deadline: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            if len(self.connections) > most:
                transport.abort()
                return
            self._expect()

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.conn.their_state in {h11.IDLE, h11.SEND_BODY}:
                self._expect()
            else:
                self._arrived()

        def connection_lost(self, exc: Exception | None) -> None:
            self._arrived()
            super().connection_lost(exc)

        def _expect(self) -> None:
            if self._deadline is None:
                self._deadline = self.loop.call_later(request_seconds, self.transport.abort)

        def _arrived(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

    return BoundedProtocol
