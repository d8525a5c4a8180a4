"""How a request body becomes JSON: only application/json, only UTF-8, not too deep, no name twice, few names.

A route of class `JsonRoute` reads its body this way. NaN, Infinity and 1e999 pass here as floats, so that the
models refuse them with the field's name.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Coroutine
from typing import Any

from fastapi.concurrency import run_in_threadpool
from fastapi.routing import APIRoute
from starlette.requests import Request
from starlette.responses import Response

from grazemap_service.problems import ProblemException

# Bytes; more is parsed in a thread, so that other requests have their turn.
_PARSED_AT_ONCE = 1 << 16
# No object of a request has more than some ten; each unknown name would be reported.
_MOST_NAMES = 100


class JsonRequest(Request):
    """A request whose body is checked before the framework sees it."""

    async def body(self) -> bytes:
        """Return the raw body. Raises ProblemException for another media type, or none."""
        data = await super().body()
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
        """Return the framework's handler, given the checked request."""
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
