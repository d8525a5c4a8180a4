"""The middleware of every request: headers of every answer, host check and key check.

`request_body` has the middleware for request bodies. The classes are plain ASGI applications; the last one that
`install` adds is the outermost. A refusal is a problem, which is sent without reading the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import structlog
from fastapi import FastAPI
from starlette.datastructures import URL, Headers, MutableHeaders
from starlette.middleware.cors import CORSMiddleware
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from grazemap_service.keys import Keys
from grazemap_service.metrics import Metrics
from grazemap_service.problems import ProblemException, response_of
from grazemap_service.rendered import RENDERED_TYPES
from grazemap_service.representations import LINES_TYPE, NPZ_TYPE, TEXT_TYPE
from grazemap_service.request_body import BodyLimit, ReadRestOfBody
from grazemap_service.request_log import RequestLog
from grazemap_service.settings import ServiceSettings, is_loopback
from grazemap_worker.redis_settings import variable_of

GUIDE = "/guide"
"""Where the guide is served."""
OPEN_PATHS = frozenset({"/", "/healthz", "/readyz", "/docs", GUIDE, "/openapi.json", "/favicon.ico"})
OPEN_PREFIXES = ("/static/", f"{GUIDE}/")
_CHUNK_BYTES = 1 << 16
# JSON of a map has a third of its size at this level; the highest one saves a tenth of that in ten times the time.
_GZIP_LEVEL = 1
# What is compressed already, and streams of lines, which would wait in the compressor.
_NOT_COMPRESSED = (
    *DEFAULT_EXCLUDED_CONTENT_TYPES,
    NPZ_TYPE,
    LINES_TYPE,
    TEXT_TYPE,
    *(media.partition(";")[0] for form, media in RENDERED_TYPES.items() if form not in ("csv", "svg")),
)

# Pages set their own Content-Security-Policy; other answers are not meant to be shown as a page.
_SECURITY_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
}


def install(app: FastAPI, settings: ServiceSettings, metrics: Metrics) -> None:
    """Give the app its middleware; the last one added is the outermost."""
    cors = partial(
        Cors,
        allow_origins=list(settings.cors_origins),
        allow_methods=["GET", "HEAD", "POST", "DELETE"],
        allow_headers=[
            *("Authorization", "Content-Type", "Prefer", "Last-Event-ID", "If-None-Match"),
            *("Priority", "Grazemap-Group", "Grazemap-Client"),
        ],
        expose_headers=["Location", "Retry-After", "ETag", "X-Request-Id", "Preference-Applied"],
    )
    app.add_middleware(BodyLimit, limit=settings.max_body_bytes)
    app.add_middleware(KeyCheck, keys=Keys(settings.api_keys, settings.api_keys_file))
    app.add_middleware(cors)
    app.add_middleware(HostCheck, allowed=settings.allowed_hosts)
    app.add_middleware(
        GZipMiddleware, minimum_size=_CHUNK_BYTES, compresslevel=_GZIP_LEVEL, exclude_content_types=_NOT_COMPRESSED
    )
    app.add_middleware(ChunkedSend)
    app.add_middleware(AnswerHeaders)
    app.add_middleware(ReadRestOfBody)
    failure = AnswerHeaders(cors(response_of(ProblemException("internal-error"))))
    app.add_middleware(RequestLog, metrics=metrics, failure=failure)


class Cors(CORSMiddleware):
    """Starlette's middleware, with a problem as the answer to a refused request."""

    def preflight_response(self, request_headers: Headers) -> Response:
        """Answer a preflight request."""
        response = super().preflight_response(request_headers)
        if response.status_code < 400:
            return response
        headers = {name: value for name, value in response.headers.items() if not name.startswith("content-")}
        detail = "Pages of other origins may not send this method or header."
        if not self.is_allowed_origin(request_headers["origin"]):
            detail = f"The origin of the page is not among those of {variable_of('cors_origins')}."
        return response_of(ProblemException("bad-request", detail, headers=headers))


class AnswerHeaders:
    """Completes the headers of every answer.

    - Browsers may neither execute an answer, nor show it in a frame, nor guess its type. A page that frames may show
      says in its policy whose they are, which X-Frame-Options cannot.
    - The address of a redirect has no scheme and no host, as clients may know the service by others than a proxy uses.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on and complete the headers of its answer."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _SECURITY_HEADERS.items():
                    headers.setdefault(name, value)
                if "frame-ancestors 'none'" not in headers["Content-Security-Policy"]:
                    del headers["X-Frame-Options"]
                if location := headers.get("Location"):
                    headers["Location"] = location.removeprefix(str(URL(scope=scope).replace(path="", query="")))
            await send(message)

        await self.app(scope, receive, with_headers)


class ChunkedSend:
    """Sends an answer in chunks: the next one when the client has read most of the previous one.

    The server copies data that is to be sent. With chunks, it holds only one chunk for a client that does not read.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on."""

        async def send_chunks(message: Message) -> None:
            body, sent = message.get("body", b""), 0
            while len(body) - sent > _CHUNK_BYTES:
                await send({**message, "body": body[sent : sent + _CHUNK_BYTES], "more_body": True})
                sent += _CHUNK_BYTES
            await send({**message, "body": body[sent:]} if sent else message)

        await self.app(scope, receive, send_chunks)


class HostCheck:
    """Refuses a Host header that is not allowed, so that no web page can reach the service by DNS rebinding.

    ``*`` allows every host, and ``*.example.org`` every subdomain of example.org. Ports are ignored.
    """

    def __init__(self, app: ASGIApp, allowed: Sequence[str]) -> None:
        self.app = app
        self.allowed = {name.lower() for name in allowed}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or refuse it."""
        if scope["type"] == "http" and not self._allows(Headers(scope=scope).get("host", "")):
            problem = ProblemException(
                "host-not-allowed", "The Host header is not allowed; the operator sets GRAZEMAP_ALLOWED_HOSTS."
            )
            await response_of(problem)(scope, receive, send)
            return
        await self.app(scope, receive, send)

    def _allows(self, header: str) -> bool:
        if "*" in self.allowed:
            return True
        name, _, port = header.lower().rpartition(":")
        host = name if name and port.isdigit() else header.lower()
        return host in self.allowed or any(
            pattern.startswith("*.") and host.endswith(pattern[1:]) for pattern in self.allowed
        )


class KeyCheck:
    """Requires ``Authorization: Bearer <key>`` on every path that is not open.

    The key is stored as `key` in the state of the request. If there are no keys, only requests to addresses of this
    machine are served, even if the server was started without the check of the settings.
    """

    def __init__(self, app: ASGIApp, keys: Keys) -> None:
        self.app = app
        self.keys = keys

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or refuse it."""
        if scope["type"] == "http" and not self._is_open(scope["path"]) and not self._allows(scope):
            problem = ProblemException("key-required", headers={"WWW-Authenticate": "Bearer"})
            await response_of(problem)(scope, receive, send)
            return
        await self.app(scope, receive, send)

    @staticmethod
    def _is_open(path: str) -> bool:
        return path in OPEN_PATHS or path.startswith(OPEN_PREFIXES)

    def _allows(self, scope: Scope) -> bool:
        if not self.keys.required:
            server = scope.get("server")
            # without a port it is a unix socket, which file permissions protect
            return server is None or server[1] is None or is_loopback(server[0])
        scheme, _, text = Headers(scope=scope).get("authorization", "").partition(" ")
        key = self.keys.find(text.strip().encode("latin-1"))
        if scheme.lower() != "bearer" or key is None:
            return False
        scope.setdefault("state", {})["key"] = key
        structlog.contextvars.bind_contextvars(key=key.name)
        return True
