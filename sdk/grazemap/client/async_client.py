"""The asyncio client of the service: a method for each process, and methods that return handles of jobs."""

from __future__ import annotations

import os
from collections.abc import AsyncGenerator, Iterable, Mapping
from functools import partial
from typing import Any, Self

import httpx2

from grazemap import constants
from grazemap.client import jobs as job_calls
from grazemap.client.connection import AsyncConnection
from grazemap.client.http import ConnectionSettings, json_object
from grazemap.client.jobs import AsyncJobHandle
from grazemap.client.methods import AsyncMethods
from grazemap.results import html
from grazemap.validation import validated, validated_each
from grazemap.wire import Forecast, ProcessRequest, ServiceStatus, Status


class AsyncClient(AsyncMethods):
    """Sends requests to a grazemap service from asyncio. Nothing is sent before a method is called.

    Parameters
    ----------
    base_url : str, optional
        Left out: the environment variable GRAZEMAP_URL, else http://127.0.0.1:8000.
    api_key : str, optional
        Sent as a bearer token. Left out: the environment variable GRAZEMAP_API_KEY, if it is set.
    cache_dir : path, optional
        Folder for results; a result is used again when the service confirms its ETag.
    timeout : float
        Seconds to wait for the next data of an answer. It does not limit the time of a computation.
    retries : int
        Number of further attempts after the HTTP status 429, 502, 503 or 504, or a broken connection. No request is
        computed twice.
    transport : httpx2.AsyncBaseTransport, optional
        A transport of httpx2, for example to an application in the same process.
    group : str, optional
        A name for the jobs that are submitted, to find them in lists: up to 64 letters, digits, `.`, `_` and `-`.

    Raises
    ------
    ValueError
        The address is not valid, or another argument is out of range.
    """

    _connection_class, _handle_class = AsyncConnection, AsyncJobHandle

    def __init__(
        self,
        base_url: str | None = None,
        api_key: str | None = None,
        cache_dir: str | os.PathLike[str] | None = None,
        timeout: float = constants.DEFAULT_TIMEOUT,
        retries: int = constants.DEFAULT_RETRIES,
        transport: httpx2.AsyncBaseTransport | None = None,
        group: str | None = None,
    ) -> None:
        url = base_url or os.environ.get("GRAZEMAP_URL") or constants.DEFAULT_BASE_URL
        key = os.environ.get("GRAZEMAP_API_KEY") if api_key is None else api_key
        self._connection = self._connection_class(
            ConnectionSettings(url, key, cache_dir, timeout, retries, group), transport
        )
        self._compute = partial(job_calls.compute, self._connection)

    @property
    def base_url(self) -> str:
        """The address of the service."""
        return self._connection.settings.base_url

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.base_url}>"

    def _repr_html_(self) -> str:
        return html.table(type(self).__name__, {"service": self.base_url})

    async def close(self) -> None:
        """Close the connections."""
        await self._connection.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def describe(self) -> dict[str, Any]:
        """Return the service's description: versions, processes, limits."""
        response = await self._connection.send("GET", constants.API_PREFIX)
        return json_object(response.content, "the answer")

    async def status(self) -> ServiceStatus:
        """Return the state of the service: its workers, waiting jobs, what is stored, and failures."""
        return ServiceStatus.read((await self._connection.send("GET", f"{constants.API_PREFIX}/status")).content)

    async def submit(self, process: str, request: ProcessRequest | Mapping[str, Any]) -> AsyncJobHandle:
        """Submit a request and return its job without waiting; equal requests have the same job.

        Parameters
        ----------
        process : str
            For example "unfolding-maps".
        request : mapping or wire model
            The body as the HTTP interface takes it.

        Raises
        ------
        ParameterError
            Values that are not allowed; most are found before anything is sent.
        QueueFull, ServiceUnavailable, ConnectionFailed
        """
        model = validated(process, request)
        return self._handle_class(self._connection, await job_calls.submit(self._connection, model), model)

    def map(
        self,
        process: str | Iterable[ProcessRequest | tuple[str, Mapping[str, Any]]],
        requests: Iterable[ProcessRequest | Mapping[str, Any]] = (),
        *,
        return_exceptions: bool = False,
    ) -> AsyncGenerator[Any]:
        """Compute many requests together, and yield their results in the order of the requests.

        A thousand of them are sent at a time, which is much faster than one by one. Each has its own job.

        Parameters
        ----------
        process : str, or iterable of wire models and pairs (process, request)
            The process of all requests; or the requests themselves, of any processes.
        requests : iterable of mappings or wire models
            The bodies as the HTTP interface takes them, if `process` is a name.
        return_exceptions : bool
            For a job that failed, was dismissed or was not accepted, yield the exception in place of the result and go
            on, rather than raise the exception.

        Raises
        ------
        ParameterError
            Values that are not allowed; the pointers begin with the place of the request. Nothing is sent then. A
            request over a limit of the service is found only when its thousand is sent.
        JobFailed, JobDismissed, QueueFull, ServiceUnavailable, ConnectionFailed
            In place of a result; the results before it have been yielded.
        """
        return job_calls.compute_many(self._connection, validated_each(process, requests), return_exceptions)

    async def estimate(self, process: str, request: ProcessRequest | Mapping[str, Any]) -> Forecast:
        """Return what a request is expected to cost; nothing is submitted. Its notes are issued as warnings, too.

        The parameters and the exceptions are those of `submit`, without QueueFull. A request over a limit of the
        service raises ParameterError, whose text has the estimate and the limit.
        """
        return await job_calls.forecast(self._connection, validated(process, request))

    async def job(self, job_id: str) -> AsyncJobHandle:
        """Return the handle of a job that was submitted before. Raises NotFound."""
        return self._handle_class(self._connection, await job_calls.fetch_job(self._connection, job_id))

    async def jobs(
        self,
        status: Status | None = None,
        process: str | None = None,
        limit: int = 50,
        group: str | None = None,
        small: bool | None = None,
    ) -> list[AsyncJobHandle]:
        """Return up to `limit` jobs, newest first.

        Parameters
        ----------
        status, process, group : str, optional
            Only jobs with this status, of this process, or submitted by a client that has this `group`.
        small : bool, optional
            True: only jobs that take milliseconds; False: only longer jobs.
        """
        filters = {"status": status, "process": process, "group": group}
        if small is not None:
            filters["small"] = str(small).lower()
        job_list = await job_calls.list_jobs(self._connection, filters, limit)
        return [self._handle_class(self._connection, job) for job in job_list]
