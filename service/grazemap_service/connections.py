"""The server and its bounds on connections, so that clients that neither send nor read do not keep others out.

The bounds are options of uvicorn and of the kernel; `request_body` has the time in which a body arrives. What only a
proxy can bound, connections on which no whole request head arrives, is left to one: see docs/nginx.conf.
"""

from __future__ import annotations

import resource
import socket

import uvicorn
from starlette.types import ASGIApp

# Seconds in which a client must take what waits for it: an answer is written in small pieces.
SEND_SECONDS = 30.0
# Seconds between requests: more than clients and proxies wait, of whom most close a connection after 5 to 60. One that
# both sides close at the same time costs the client a request.
IDLE_SECONDS = 75
# Seconds for answers in progress when asked to stop; event streams do not end by themselves.
GRACE_SECONDS = 2
# File descriptors that are not for clients: Redis, the listening socket, files of the pages.
_RESERVED = 64
_FEWEST = 16


def bounded_server(
    app: ASGIApp, listener: socket.socket, send_seconds: float = SEND_SECONDS, most_connections: int | None = None
) -> uvicorn.Server:
    """Return a server for an app, which listens when it is run with the listener.

    Parameters
    ----------
    app : ASGI application
        What is served.
    listener : socket
        The options that it is given here are those of its connections too.
    send_seconds : float
        How long what was sent waits for a client that does not read; then the kernel closes the connection (Linux).
    most_connections : int, optional
        As many connections, and further requests are answered with 503. By the limit of file descriptors when left out.
    """
    if hasattr(socket, "TCP_USER_TIMEOUT") and listener.family != socket.AF_UNIX:
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, round(1000 * send_seconds))
    return uvicorn.Server(
        uvicorn.Config(
            app,
            http="h11",
            log_config=None,
            access_log=False,
            server_header=False,
            limit_concurrency=most_connections if most_connections is not None else _by_descriptors(),
            timeout_keep_alive=IDLE_SECONDS,
            timeout_graceful_shutdown=GRACE_SECONDS,
        )
    )


def _by_descriptors() -> int | None:
    """Return how many connections this process takes, by its limit of file descriptors; None: any number."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(_FEWEST, limit - _RESERVED) if limit != resource.RLIM_INFINITY else None
