"""The body of a request: where it ends, how long and how late it may be, and its conversion from JSON.

JSON must be in UTF-8, as application/json or application/...+json. It must not be nested too deeply. The names in an
object must differ, and there must not be too many.

Routes of the class `JsonRoute` read their body in this way. NaN, Infinity and 1e999 are accepted here as floats, so
that the models refuse them and name the field.
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

# Bodies with more bytes are parsed in a thread, so that they do not delay other requests.
_PARSED_AT_ONCE = 1 << 16
# Maximum number of names of an object. Requests need about ten, and each unknown name would be reported.
_MAX_NAMES = 100
# Seconds in which a body must arrive after the head of its request.
REQUEST_SECONDS = 30.0
# Maximum bytes and seconds for reading the rest of a body after the response.
_MAX_REST_BYTES = 16 << 20
_REST_SECONDS = 5.0


class ReadRestOfBody:
    """If a response is complete before the request body is, reads the rest of the body first, then ends the response.

    If the connection were closed while the client still sends, it would be reset, and the client might never see the
    response. A very long body is read only in part. The connection is closed afterwards, even after the whole body.
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

        async def receive_and_note_end() -> Message:
            nonlocal ended
            message = await receive()
            ended = not message.get("more_body", False)
            return message

        async def send_after_body(message: Message) -> None:
            if message["type"] == "http.response.start" and not ended:
                MutableHeaders(scope=message)["Connection"] = "close"
            if message["type"] == "http.response.body" and not message.get("more_body", False) and not ended:
                await send({**message, "more_body": True})
                message, left = {"type": "http.response.body", "body": b""}, _MAX_REST_BYTES
                with anyio.move_on_after(_REST_SECONDS):
                    while left > 0 and not ended:
                        left -= len((await receive_and_note_end()).get("body", b""))
            await send(message)

        await self.app(scope, receive_and_note_end, send_after_body)


class BodyLimit:
    """Refuses a body that is too long, has an ambiguous end, or arrives too late.

    If Content-Length exceeds the limit, the body is not read. A body without it is refused as soon as it exceeds the
    limit. With both Content-Length and Transfer-Encoding, a proxy may disagree about where the body ends (RFC 9112
    6.3), so both together are refused.
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self.app = app
        self.limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on and limit its body, or refuse it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        declared = headers.get("content-length", "")
        if declared and "transfer-encoding" in headers:
            detail = "Content-Length and Transfer-Encoding are both given; send one of them."
            await response_of(ProblemException("bad-request", detail))(scope, receive, send)
            return
        # int() refuses thousands of digits, and a digit such as "²"
        if declared.isascii() and declared.isdigit() and (len(declared) > 18 or int(declared) > self.limit):
            await response_of(self._too_large())(scope, receive, send)
            return
        received, due = 0, anyio.current_time() + REQUEST_SECONDS

        async def receive_within_limits() -> Message:
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
                due = math.inf  # the body is complete; further calls wait for the client to disconnect
            return message

        await self.app(scope, receive_within_limits, send)

    def _too_large(self) -> ProblemException:
        return ProblemException("body-too-large", f"The body is over {self.limit} bytes.")


class JsonRequest(Request):
    """A request whose body is checked before the framework reads it."""

    async def body(self) -> bytes:
        """Return the raw body. Raises ProblemException if it is compressed or empty, or not declared as JSON."""
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
    """A route whose requests are of the class `JsonRequest`."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the handler of the framework, called with a `JsonRequest`."""
        handler = super().get_route_handler()

        async def checked(request: Request) -> Response:
            return await handler(JsonRequest(request.scope, request.receive))

        return checked


def parse_json(data: bytes, max_depth: int) -> Any:
    """Return JSON text as Python values.

    Parameters
    ----------
    data : bytes
        JSON in UTF-8.
    max_depth : int
        Maximum depth of nested objects and lists.

    Raises
    ------
    ProblemException
        "malformed-json": not UTF-8, not JSON, too deep, a name twice or very many names in one object, a lone
        surrogate, or an integer of thousands of digits.
    """
    try:
        value = json.loads(data.decode("utf-8"), object_pairs_hook=_object_of_unique_names)
    except UnicodeDecodeError as error:
        raise ProblemException("malformed-json", "The body is not UTF-8.") from error
    except RecursionError as error:
        raise _too_deep(max_depth) from error
    except ValueError as error:
        raise ProblemException("malformed-json", "The body is not JSON.") from error
    _check_depth_and_texts(value, max_depth)
    return value


def _too_deep(max_depth: int) -> ProblemException:
    return ProblemException("malformed-json", f"The body is nested more than {max_depth} levels deep.")


def _object_of_unique_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > _MAX_NAMES:
        raise ProblemException("malformed-json", f"An object of the body has more than {_MAX_NAMES} names.")
    members = dict(pairs)
    if len(members) != len(pairs):
        raise ProblemException("malformed-json", "An object of the body has the same name twice.")
    return members


def _check_depth_and_texts(value: Any, max_depth: int) -> None:
    level, depth = [value], 0
    while level:
        if depth == max_depth and any(isinstance(item, dict | list) for item in level):
            raise _too_deep(max_depth)
        below: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                below += item.keys()
                below += item.values()
            elif isinstance(item, list):
                below += item
            elif isinstance(item, str) and not _encodable(item):
                raise ProblemException("malformed-json", "A text of the body holds half of a surrogate pair.")
        level, depth = below, depth + 1


def _encodable(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True
