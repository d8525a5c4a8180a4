"""A connection to a service, awaited or blocking: sends requests, and repeats them after temporary failures.

Every request can be repeated safely: GET and HEAD change nothing, DELETE is idempotent, and equal POSTs have the same
job, which is computed once.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, ParamSpec, TypeVar

import httpx2

from grazemap import constants
from grazemap.client.http import ConnectionSettings, failure_of, pause, problem_of
from grazemap.errors import ConnectionFailed, ProtocolError, ServiceProblem

# Seconds for which an answer is awaited also after a deadline.
_LEAST_PATIENCE = 1.0
P = ParamSpec("P")
T = TypeVar("T")


class AsyncConnection:
    """Sends all requests of a client over one `httpx2.AsyncClient`."""

    def __init__(self, settings: ConnectionSettings, transport: httpx2.AsyncBaseTransport | None = None) -> None:
        self.settings = settings
        self._http: httpx2.AsyncClient | _BlockingHttp = httpx2.AsyncClient(**settings.http, transport=transport)

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def send(
        self,
        method: str,
        path: str,
        *,
        params: Mapping[str, str | int] | None = None,
        headers: Mapping[str, str] | None = None,
        content: bytes | None = None,
        retries: int | None = None,
        deadline: float | None = None,
    ) -> httpx2.Response:
        """Send a request, repeat it after temporary failures, and return the answer; its status is below 400.

        Parameters
        ----------
        method, path, params, headers, content
            The request.
        retries : int, optional
            Number of further attempts; left out: as in the settings.
        deadline : float, optional
            Time of `now` after which no further attempt starts, and an attempt waits no longer for an answer.

        Raises
        ------
        ServiceProblem
            The service answered with a problem.
        ConnectionFailed
            There was no answer after all attempts.
        ProtocolError
            The answer cannot be read, or is longer than any answer of a service.
        """
        attempts = 1 + (self.settings.retries if retries is None else retries)
        for attempt in range(attempts):
            failure: ServiceProblem | ConnectionFailed
            retry_after: float | None = None
            try:
                timeout = self._timeout(deadline)
                answer = self._http.stream(
                    method, path, params=params, headers=headers, content=content, timeout=timeout
                )
                async with answer as streamed:
                    response = await _read(streamed)
            except httpx2.RequestError as error:
                failure = failure_of(error)
                again = not isinstance(error, httpx2.UnsupportedProtocol)
            else:
                if response.status_code < 400:
                    return final(response)
                failure = problem_of(response)
                retry_after = failure.retry_after
                again = response.status_code in constants.RETRIED_STATUSES
            if not again or attempt + 1 == attempts or (retry_after or 0.0) > constants.MAX_RETRY_AFTER:
                break
            seconds = pause(attempt) + (retry_after or 0.0)
            if deadline is not None and self.now() + seconds >= deadline:
                break
            await self.sleep(seconds)
        raise failure

    def _timeout(self, deadline: float | None) -> float:
        """Return the seconds without data after which an attempt has failed."""
        if deadline is None:
            return self.settings.timeout
        return min(self.settings.timeout, max(_LEAST_PATIENCE, deadline - self.now()))

    def stream(
        self,
        path: str,
        headers: Mapping[str, str],
        silence: float,
        *,
        params: Mapping[str, str | int] | None = None,
        content: bytes | None = None,
    ) -> AbstractAsyncContextManager[httpx2.Response]:
        """Return the context of a streamed answer: to a POST if there is content, else to a GET.

        The stream fails after `silence` seconds without data.
        """
        timeout = httpx2.Timeout(self.settings.timeout, read=silence)
        method = "GET" if content is None else "POST"
        return self._http.stream(method, path, params=params, headers=headers, content=content, timeout=timeout)

    def now(self) -> float:
        """Return the seconds of a monotonic clock."""
        return time.monotonic()

    async def sleep(self, seconds: float) -> None:
        """Wait for some seconds."""
        await asyncio.sleep(seconds)

    async def work(self, function: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T:
        """Return the value of a function that may take long, such as decoding a result or writing it to a disk."""
        return await asyncio.to_thread(function, *arguments, **keywords)


class Connection(AsyncConnection):
    """The connection of a blocking client: its coroutines block, and never wait for an event loop."""

    def __init__(self, settings: ConnectionSettings, transport: httpx2.BaseTransport | None = None) -> None:
        self.settings = settings
        self._http = _BlockingHttp(httpx2.Client(**settings.http, transport=transport))

    async def sleep(self, seconds: float) -> None:
        """Wait for some seconds."""
        time.sleep(seconds)

    async def work(self, function: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T:
        """Return the value of a function."""
        return function(*arguments, **keywords)


class _BlockingHttp:
    """An `httpx2.Client` with the methods of an `httpx2.AsyncClient` that a connection uses."""

    def __init__(self, client: httpx2.Client) -> None:
        self._client = client

    @asynccontextmanager
    async def stream(self, method: str, path: str, **options: Any) -> AsyncIterator[httpx2.Response]:
        with self._client.stream(method, path, **options) as response:
            response.stream = _BlockingStream(response.stream)
            yield response

    async def aclose(self) -> None:
        self._client.close()


class _BlockingStream(httpx2.SyncByteStream, httpx2.AsyncByteStream):
    """The body of an answer to an `httpx2.Client`, readable like the body of an answer to an `httpx2.AsyncClient`."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for part in self._stream:
            yield part

    def close(self) -> None:
        self._stream.close()

    async def aclose(self) -> None:
        self._stream.close()


def final(response: httpx2.Response) -> httpx2.Response:
    """Return an answer that is not an error. Raises ProtocolError for one that says to ask elsewhere."""
    if response.has_redirect_location:
        place = response.headers["location"]
        raise ProtocolError(
            f"the answer is a redirect (HTTP status {response.status_code}) to {place}: use its address"
        )
    return response


async def _read(streamed: httpx2.Response) -> httpx2.Response:
    """Return an answer with its body. Raises ProtocolError where the body is too long."""
    parts, size = [], 0
    async for part in streamed.aiter_bytes():
        size += len(part)
        if size > constants.MAX_ANSWER_BYTES:
            raise ProtocolError(f"the answer is longer than {constants.MAX_ANSWER_BYTES} bytes")
        parts.append(part)
    # the parts are decompressed
    headers = [(name, value) for name, value in streamed.headers.multi_items() if name != "content-encoding"]
    return httpx2.Response(streamed.status_code, headers=headers, content=b"".join(parts), request=streamed.request)


async def lines_of(response: httpx2.Response) -> AsyncGenerator[str]:
    """Yield the lines of a stream, without line ends. Raises ProtocolError where a line is too long."""
    rest = ""
    async for text in response.aiter_text():
        *lines, rest = (rest + text).split("\n")
        if len(rest) > constants.MAX_EVENT_LENGTH:
            raise ProtocolError(f"a line is longer than {constants.MAX_EVENT_LENGTH} characters")
        for line in lines:
            yield line.removesuffix("\r")
