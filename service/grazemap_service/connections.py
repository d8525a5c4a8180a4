"""The HTTP server and its limits on connections: clients that neither send nor read must not keep others out.

The limits are options of uvicorn and of the kernel; `request_body` limits the time in which a body arrives. Only a
proxy can limit connections on which no complete request head arrives: see docs/nginx.conf.
"""

from __future__ import annotations

import resource
import socket

import uvicorn
from starlette.types import ASGIApp

# Seconds in which a client must read data that was sent. They count for each chunk: a long answer may take longer.
SEND_SECONDS = 30.0
# Seconds after which an idle connection is closed. Most clients and proxies close it after 5 to 60 seconds. The server
# waits longer, because a client may lose a request when both sides close the connection at the same time.
IDLE_SECONDS = 75
# Seconds in which answers may finish when the server is to stop; event streams do not end by themselves.
GRACE_SECONDS = 2
# File descriptors that are reserved for Redis, the listening socket and files of the pages.
_RESERVED = 64
_MIN_CONNECTIONS = 16


def bounded_server(
    app: ASGIApp, listener: socket.socket, send_seconds: float = SEND_SECONDS, max_connections: int | None = None
) -> uvicorn.Server:
    """Return a server for an app; run it with the listener.

    Parameters
    ----------
    app : ASGI application
        The app to serve.
    listener : socket
        The listening socket; its connections inherit the options that are set here.
    send_seconds : float
        Time after which the kernel closes a connection whose client does not read data that was sent (Linux).
    max_connections : int, optional
        Number of connections above which requests are answered with 503. Default: file descriptors, less some.
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
            limit_concurrency=max_connections if max_connections is not None else _descriptor_limit(),
            timeout_keep_alive=IDLE_SECONDS,
            timeout_graceful_shutdown=GRACE_SECONDS,
        )
    )


def _descriptor_limit() -> int | None:
    """Return the maximum number of connections, from the limit of file descriptors; None: no limit."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return max(_MIN_CONNECTIONS, limit - _RESERVED) if limit != resource.RLIM_INFINITY else None
