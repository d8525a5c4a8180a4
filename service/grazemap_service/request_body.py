"""The body of a request: its end, its limits of bytes and of time, and how it becomes JSON.

JSON is taken as application/json only, in UTF-8, not too deep, without a name twice and with few names.

A route of class `JsonRoute` reads its body this way. NaN, Infinity and 1e999 pass here as floats, so that the
models refuse them with the field's name.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Coroutine
from typing import Any

import anyio
from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from grazemap_service.problems import ProblemException, response_of

# Bytes; larger bodies are parsed in a thread, so that other requests are not delayed.
_PARSED_AT_ONCE = 1 << 16
# Objects of requests have about ten names at most; each unknown name would be reported.
_MOST_NAMES = 100
# Seconds for a body to arrive, from its request's head on.
REQUEST_SECONDS = 30.0
# What is still read of a body after its answer, in bytes and seconds.
_MOST_DRAINED = 16 << 20
_DRAIN_SECONDS = 5.0


class Draining:
    """Ends an answer only after the rest of the request's body, so that clients that send it first read the answer.

    A connection that is closed while a client sends is reset, and the client may never see the answer. Of a body that
    goes on for long only a part is read; the connection is closed in any case.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on."""
        headers = Headers(scope=scope) if scope["type"] == "http" else {}
        if headers.get("content-length", "0") == "0" and "transfer-encoding" not in headers:
            await self.app(scope, receive, send)
            return
        ended = False

        async def noted() -> Message:
            nonlocal ended
            message = await receive()
            ended = not message.get("more_body", False)
            return message

        async def after_the_body(message: Message) -> None:
            if message["type"] == "http.response.start" and not ended:
                MutableHeaders(scope=message)["Connection"] = "close"
            if message["type"] == "http.response.body" and not message.get("more_body", False) and not ended:
                await send({**message, "more_body": True})
                message, left = {"type": "http.response.body", "body": b""}, _MOST_DRAINED
                with anyio.move_on_after(_DRAIN_SECONDS):
                    while left > 0 and not ended:
                        left -= len((await noted()).get("body", b""))
            await send(message)

        await self.app(scope, noted, after_the_body)


class BodyLimit:
    """Refuses a body that is over the limit, ambiguous in its end, or late.

    A length is refused before the body is read, a longer body as soon as it is over the limit. Of a body with
    Content-Length and Transfer-Encoding a proxy may see another end (RFC 9112 6.3).
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self.app = app
        self.limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with its body counted and timed, or refuse it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        declared = headers.get("content-length", "")
        if declared and "transfer-encoding" in headers:
            detail = "Content-Length and Transfer-Encoding are both given; send one of them."
            await response_of(ProblemException("bad-request", detail))(scope, receive, send)
            return
        # the digits are counted first: int() refuses thousands of them
        if declared.isdigit() and (len(declared) > 18 or int(declared) > self.limit):
            await response_of(self._too_large())(scope, receive, send)
            return
        received, due = 0, anyio.current_time() + REQUEST_SECONDS

        async def counted() -> Message:
            nonlocal received, due
            with anyio.CancelScope(deadline=due) as waiting:
                message = await receive()
            if waiting.cancelled_caught:
                raise ProblemException("bad-request", f"The body has not arrived within {REQUEST_SECONDS:g} s.")
            if message["type"] == "http.request":
                received += len(message.get("body", b""))
                if received > self.limit:
                    raise self._too_large()
            if not message.get("more_body", False):
                due = math.inf  # from now on it is the client's end that is waited for
            return message

        await self.app(scope, counted, send)

    def _too_large(self) -> ProblemException:
        return ProblemException("body-too-large", f"The body is over {self.limit} bytes.")


class JsonRequest(Request):
    """A request whose body is checked before the framework sees it."""

    async def body(self) -> bytes:
        """Return the raw body. Raises ProblemException for another media type, or none, and for an encoded body."""
        data = await super().body()
        encodings = ",".join(self.headers.getlist("content-encoding")).lower().split(",")
        if any(encoding.strip() not in ("", "identity") for encoding in encodings):
            raise ProblemException("unsupported-media-type", headers={"Accept-Encoding": "identity"})
        media_type = self.headers.get("content-type", "").split(";")[0].strip().lower()
        if media_type != "application/json" and not (
            media_type.startswith("application/") and media_type.endswith("+json")
        ):
            raise ProblemException("unsupported-media-type")
        if not data.strip():
            raise ProblemException("malformed-json", "The body is empty.")
        return data

    async def json(self) -> Any:
        """Return the body as Python values. Raises ProblemException."""
        data, depth = await self.body(), self.app.state.context.settings.max_depth
        if len(data) <= _PARSED_AT_ONCE:
            return parse_json(data, depth)
        return await run_in_threadpool(parse_json, data, depth)


class JsonRoute(APIRoute):
    """A route that takes `JsonRequest`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the framework's handler, which gets the checked request."""
        handler = super().get_route_handler()

        async def checked(request: Request) -> Response:
            return await handler(JsonRequest(request.scope, request.receive))

        return checked


def parse_json(data: bytes, max_depth: int) -> Any:
    """Return JSON text as Python values.

    Parameters
    ----------
    data : bytes
        UTF-8.
    max_depth : int
        How many objects and lists may nest.

    Raises
    ------
    ProblemException
        "malformed-json": not UTF-8, not JSON, too deep, a name twice or very many names in one object, a lone
        surrogate, or an integer of thousands of digits.
    """
    try:
        value = json.loads(data.decode("utf-8"), object_pairs_hook=_unique)
    except UnicodeDecodeError as error:
        raise ProblemException("malformed-json", "The body is not UTF-8.") from error
    except RecursionError as error:
        raise _too_deep(max_depth) from error
    except ValueError as error:
        raise ProblemException("malformed-json", "The body is not JSON.") from error
    _check(value, max_depth)
    return value


def _too_deep(max_depth: int) -> ProblemException:
    return ProblemException("malformed-json", f"The body nests more than {max_depth} objects and lists.")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > _MOST_NAMES:
        raise ProblemException("malformed-json", f"An object of the body has more than {_MOST_NAMES} names.")
    members = dict(pairs)
    if len(members) != len(pairs):
        raise ProblemException("malformed-json", "An object of the body has the same name twice.")
    return members


def _check(value: Any, max_depth: int) -> None:
    level = [value]
    for _ in range(max_depth + 1):
        below: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                below += item.keys()
                below += item.values()
            elif isinstance(item, list):
                below += item
            elif isinstance(item, str) and not _encodable(item):
                raise ProblemException("malformed-json", "A text of the body holds half of a surrogate pair.")
        if not below:
            return
        level = below
    raise _too_deep(max_depth)


def _encodable(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True
