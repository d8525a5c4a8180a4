"""The client that computes in a script, without a service; editors read `direct_client.pyi`."""

from __future__ import annotations

import os
from collections.abc import AsyncGenerator, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Self, TypeVar, cast

from grazemap.client.blocking import blocking
from grazemap.client.events import Event
from grazemap.client.messages import notes_on_all, result_of, warn_about
from grazemap.client.methods import AsyncMethods, Methods
from grazemap.client.progress import ProgressListener
from grazemap.errors import GrazemapError, JobError
from grazemap.results import Result
from grazemap.server_command import worker_module
from grazemap.validation import validated, validated_each
from grazemap.wire import Forecast, ProcessRequest, notes_on, unstated

R = TypeVar("R", bound=Result)


class AsyncDirectClient(AsyncMethods):
    """Computes without a service, with the methods of a client of a service that compute.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        Computes the tiles of a request and what follows them, for example that of Dask, ``client.get_executor()``, or
        ``mpi4py.futures.MPIPoolExecutor()``. Left out: a pool of processes of this machine, one for each core.

    Raises
    ------
    MissingExtra
        The extra "compute" is not installed.
    """

    def __init__(self, executor: Executor | None = None) -> None:
        self._direct = worker_module("direct").Direct(executor)

    async def compute(
        self,
        process: str,
        request: ProcessRequest | Mapping[str, Any],
        *,
        progress: bool = True,
        checkpoint: str | os.PathLike[str] | None = None,
    ) -> Any:
        """Compute a request, and return its result: the bytes are those of a service.

        Parameters
        ----------
        process : str
            For example "unfolding-maps".
        request : mapping or wire model
            The body as the HTTP interface takes it.
        progress : bool
            Whether a bar is shown on a terminal or below a notebook's cell during the computation, and elsewhere a line
            on stderr for what it waits for longer than 5 s.
        checkpoint : path, optional
            A folder for the finished tiles of this request. A computation that was interrupted goes on from it.

        Raises
        ------
        ParameterError, JobFailed
            Values that are not allowed, or that the core cannot compute.
        CheckpointError
            The folder is that of another request, or of another version.
        ComputationError
            The processes of the executor end, or compute with different libraries or processors.
        """
        return self._result(validated(process, request), progress, checkpoint)

    async def _compute(self, kind: type[R], request: ProcessRequest, progress: bool) -> R:
        return cast(R, self._result(request, progress))

    def _result(
        self, request: ProcessRequest, progress: bool, checkpoint: str | os.PathLike[str] | None = None
    ) -> Result:
        warn_about([*notes_on(request), *unstated(request)])
        folder = None if checkpoint is None else Path(checkpoint).expanduser()
        with ProgressListener(request.operation.process, progress) as listener:
            outcome = self._direct.compute(request, lambda name, data: listener(Event("", name, data)), folder)
        return result_of(request, outcome)

    def map(
        self,
        process: str | Iterable[ProcessRequest | tuple[str, Mapping[str, Any]]],
        requests: Iterable[ProcessRequest | Mapping[str, Any]] = (),
        *,
        return_exceptions: bool = False,
    ) -> AsyncGenerator[Any]:
        """Compute many requests, and yield their results in the order of the requests.

        Parameters
        ----------
        process : str, or iterable of wire models and pairs (process, request)
            The process of all requests; or the requests themselves, of any processes.
        requests : iterable of mappings or wire models
            The bodies as the HTTP interface takes them, if `process` is a name.
        return_exceptions : bool
            For a request that cannot be computed, yield the exception in place of the result and go on, rather than
            raise the exception.

        Raises
        ------
        ParameterError
            Values that are not allowed; the pointers begin with the place of the request. Nothing is computed then.
        JobFailed
            In place of a result.
        """
        return _each(self._direct, validated_each(process, requests), return_exceptions)

    async def estimate(self, process: str, request: ProcessRequest | Mapping[str, Any]) -> Forecast:
        """Return what a request is expected to cost; nothing is computed. Its notes are issued as warnings, too."""
        model = validated(process, request)
        notes = [*notes_on(model), *unstated(model)]
        warn_about(notes)
        plan = worker_module("processes").IMPLEMENTATIONS[process].plan(model)
        return Forecast(**plan.estimate.model_dump(), notes=notes)

    async def close(self) -> None:
        """End the processes that this client has started; an executor that was given goes on."""
        self._direct.close()


async def _each(
    direct: Any, requests: Sequence[ProcessRequest], return_exceptions: bool
) -> AsyncGenerator[Result | GrazemapError]:
    """Compute requests, and yield their results or, if they are asked for, exceptions."""
    warn_about(notes_on_all(requests))
    for request, outcome in zip(requests, direct.each(requests), strict=True):
        try:
            result: Result | GrazemapError = result_of(request, outcome)
        except JobError as error:
            if not return_exceptions:
                raise
            result = error
        yield result


@blocking(AsyncDirectClient)
class DirectClient(Methods):  # noqa: D101 - its docstring is made too
    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
