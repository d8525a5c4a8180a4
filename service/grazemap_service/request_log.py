"""The outermost middleware: request ids, the request log, metrics, and the response to unhandled exceptions.

An X-Request-Id that a client sends is kept if it has only letters, digits, ".", "_" and "-", and at most 64 characters.
So the logs of both sides can be compared. The traceback of an unhandled exception is written to the log only.
"""

from __future__ import annotations

import re
import secrets
import time

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from grazemap_service.metrics import Metrics

REQUEST_ID_HEADER = "X-Request-Id"
_HARMLESS = re.compile(r"[A-Za-z0-9._-]{1,64}")
_METHODS = frozenset({"GET", "HEAD", "POST", "DELETE", "PUT", "PATCH", "OPTIONS"})
# The status of nginx for a client that closed the connection before the answer.
_CLIENT_LEFT = 499
# Requests to these routes are logged at level debug.
_QUIET_ROUTES = frozenset({"/healthz", "/readyz", "/metrics"})
_log = structlog.get_logger("grazemap_service")


class RequestLog:
    """Gives each request an id, logs and measures it, and answers with `failure` after an unhandled exception."""

    def __init__(self, app: ASGIApp, metrics: Metrics, failure: ASGIApp) -> None:
        self.app = app
        self.metrics = metrics
        self.failure = failure

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        client_id = Headers(scope=scope).get(REQUEST_ID_HEADER, "")
        request_id = client_id if _HARMLESS.fullmatch(client_id) else secrets.token_hex(8)
        structlog.contextvars.clear_contextvars()
        structlog.contextvars.bind_contextvars(request_id=request_id)
        began = time.perf_counter()
        status = 0

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]  # before it is sent, so that it is recorded if the sending fails
                MutableHeaders(scope=message)[REQUEST_ID_HEADER] = request_id
            await send(message)

        try:
            await self.app(scope, receive, send_with_id)
        except Exception:
            _log.exception("request failed", method=scope["method"], route=_route(scope))
            if status:
                raise  # the response has begun; the client notices the error as a broken connection
            await self.failure(scope, receive, send_with_id)
        finally:
            self._record(scope, status or _CLIENT_LEFT, time.perf_counter() - began)

    def _record(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in _METHODS else "other"
        route = _route(scope)
        self.metrics.requests.labels(method, route, str(status)).inc()
        self.metrics.latency.labels(method, route).observe(seconds)
        if api_key := scope.get("state", {}).get("key"):
            self.metrics.key_requests.labels(api_key.name).inc()
        log = _log.debug if route in _QUIET_ROUTES else _log.info
        log("request", method=method, route=route, status=status, seconds=round(seconds, 6))


def _route(scope: Scope) -> str:
    """Return the template of the route; paths with ids would fill the log and multiply the metrics."""
    return str(getattr(scope.get("route"), "path", "unmatched"))
