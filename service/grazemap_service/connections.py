"""Bounds on connections, so that clients that neither send nor read do not keep others out.

uvicorn closes idle connections between requests, but waits indefinitely for the rest of a request, and until a client
takes an answer. `bounded` returns a protocol that closes a connection whose request does not arrive in time, or whose
client does not read. There are only so many, as a process without file descriptors could neither answer nor reach
Redis: a new one takes the place of the one that has been idle for longest, and is closed at once where none is idle.
"""

from __future__ import annotations

import asyncio
import resource
from collections.abc import Iterable
from operator import itemgetter
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from grazemap_service.problems import ProblemException, response_of

# Seconds for line, headers and body of a request together.
REQUEST_SECONDS = 30.0
# Seconds in which a client must take what waits for it, some 100 KB: an answer is written in small pieces.
SEND_SECONDS = 30.0
# Seconds between requests: more than clients and proxies wait, of whom most close a connection after 5 to 60. One that
# both sides close at the same time costs the client a request.
IDLE_SECONDS = 75
# File descriptors that are not for clients: Redis, the listening socket, files of the pages.
_RESERVED = 64
_FEWEST = 16


def _by_descriptors() -> int:
    """Return how many connections this process takes, by its limit of file descriptors."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(_FEWEST, limit - _RESERVED) if limit != resource.RLIM_INFINITY else 1 << 16


def _close_an_idle_one(connections: Iterable[Any]) -> bool:
    """Close the connection that has been idle for longest; return whether there was one."""
    waiting = [
        (connection.timeout_keep_alive_task.when(), connection)
        for connection in connections
        if connection.timeout_keep_alive_task is not None and not connection.transport.is_closing()
    ]
    if not waiting:
        return False
    _, oldest = min(waiting, key=itemgetter(0))
    oldest.timeout_keep_alive_handler()
    return True


def bounded(
    request_seconds: float = REQUEST_SECONDS, most_connections: int | None = None, send_seconds: float = SEND_SECONDS
) -> type[H11Protocol]:
    """Return uvicorn's protocol with deadlines for requests and readers, and a limit of connections.

    Parameters
    ----------
    request_seconds : float
        From a connection's beginning, or from the first byte of a later request, to the request's last byte.
    most_connections : int, optional
        By the limit of file descriptors when left out.
    send_seconds : float
        How long the rest of an answer waits for a client that does not read.
    """
    most = most_connections if most_connections is not None else _by_descriptors()

    class BoundedProtocol(H11Protocol):
        """A connection that ends when its request does not arrive, or its answer is not taken."""

        _deadline: asyncio.TimerHandle | None = None
        _taken_by: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self.timeout_keep_alive = IDLE_SECONDS
            if len(self.connections) > most and not _close_an_idle_one(self.connections):
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
            self._taken()
            super().connection_lost(exc)

        def pause_writing(self) -> None:
            super().pause_writing()
            self._await_reader()

        def resume_writing(self) -> None:
            super().resume_writing()
            if not self.transport.is_closing():
                self._taken()

        def on_response_complete(self) -> None:
            super().on_response_complete()
            if self.transport.is_closing():  # it waits for a reader too
                self._await_reader()

        def timeout_keep_alive_handler(self) -> None:
            super().timeout_keep_alive_handler()
            self._await_reader()

        def send_400_response(self, msg: str) -> None:
            """Answer what is not HTTP with a problem, and close the connection."""
            if self.conn.our_state in {h11.IDLE, h11.SEND_RESPONSE}:
                answer = response_of(ProblemException("bad-request", msg, headers={"Connection": "close"}))
                head = h11.Response(status_code=400, headers=answer.raw_headers, reason=b"Bad Request")
                for event in (head, h11.Data(data=bytes(answer.body)), h11.EndOfMessage()):
                    self.transport.write(self.conn.send(event) or b"")
            self.transport.close()

        def _await_reader(self) -> None:
            if self._taken_by is None:
                self._taken_by = self.loop.call_later(send_seconds, self.transport.abort)

        def _taken(self) -> None:
            if self._taken_by is not None:
                self._taken_by.cancel()
                self._taken_by = None

        def _expect(self) -> None:
            if self._deadline is None:
                self._deadline = self.loop.call_later(request_seconds, self.transport.abort)

        def _arrived(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

    return BoundedProtocol
