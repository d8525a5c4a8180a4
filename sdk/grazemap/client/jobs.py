"""Handles on jobs: one for the blocking client, one for the asynchronous one, over the same flows."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Generator
from contextlib import aclosing
from typing import Any

from grazemap.client import operations
from grazemap.client.async_io import AsyncDriver
from grazemap.client.io_effects import Event
from grazemap.client.progress import Listener
from grazemap.client.sync_io import Driver
from grazemap.results import Result
from grazemap.wire import Job, Problem, Progress, Status


class _Handle:
    """What is known of a job without asking; `refresh` and `wait` bring it up to date."""

    def __init__(self, settings: operations.Settings, job: Job) -> None:
        self._settings = settings
        self._job = job

    @property
    def id(self) -> str:
        """The content-addressed id: the same question has the same one."""
        return self._job.id

    @property
    def process(self) -> str:
        """Name of the process, for example "unfolding-maps"."""
        return self._job.process

    @property
    def request(self) -> dict[str, Any] | None:
        """The canonical request, every default filled in; None for a long one in a list, until `refresh`."""
        return self._job.request

    @property
    def status(self) -> Status:
        """Status as last seen: accepted, running, successful, failed or dismissed."""
        return self._job.status

    @property
    def progress(self) -> Progress:
        """Progress as last seen."""
        return self._job.progress

    @property
    def problem(self) -> Problem | None:
        """Why the job failed, if it did."""
        return self._job.problem

    @property
    def job(self) -> Job:
        """The whole job as last seen."""
        return self._job

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id[:12]} {self.process}: {self.status}>"


class JobHandle(_Handle):
    """A job of a `Client`."""

    def __init__(self, driver: Driver, settings: operations.Settings, job: Job) -> None:
        super().__init__(settings, job)
        self._driver = driver

    def refresh(self) -> JobHandle:
        """Ask the service how the job is, and return the handle."""
        self._job = self._driver.run(operations.look(self._settings, self.id))
        return self

    def events(self, timeout: float | None = None) -> Generator[Event]:
        """Yield the job's events, from its beginning until it is finished. Raises WaitTimeout.

        A finished job tells them again as long as the service has them; at the least there are its last progress
        and done. Where less time is left than a stream may be silent (45 s), the job is polled: progress and done
        are all that comes then.
        """
        self._job = yield from self._driver.events(operations.watch(self._settings, self.id, timeout, replay=True))

    def wait(self, timeout: float | None = None, progress: bool = False) -> JobHandle:
        """Wait until the job is successful, and return the handle.

        Parameters
        ----------
        timeout : float, optional
            Seconds; the job goes on when they are over.
        progress : bool
            Show a bar on stderr.

        Raises
        ------
        JobFailed, JobDismissed, WaitTimeout
        """
        with Listener(self.process, progress) as listener:
            self._job = self._driver.run(operations.watch(self._settings, self.id, timeout), listener)
        operations.require_success(self._job)
        return self

    def result(self) -> Result:
        """Fetch the result of a finished job.

        One that the service has dropped meanwhile is computed again and waited for.

        Raises
        ------
        ResultNotReady
            The job is unfinished.
        """
        return self._driver.run(operations.fetch(self._settings, self.id))

    def cancel(self) -> JobHandle:
        """Dismiss the job, unless it is finished, and return the handle."""
        self._job = self._driver.run(operations.cancel(self._settings, self.id))
        return self


class AsyncJobHandle(_Handle):
    """A job of an `AsyncClient`: the methods of `JobHandle`, to be awaited."""

    def __init__(self, driver: AsyncDriver, settings: operations.Settings, job: Job) -> None:
        super().__init__(settings, job)
        self._driver = driver

    async def refresh(self) -> AsyncJobHandle:
        """As `JobHandle.refresh`."""
        self._job = await self._driver.run(operations.look(self._settings, self.id))
        return self

    async def events(self, timeout: float | None = None) -> AsyncGenerator[Event]:
        """As `JobHandle.events`."""
        flow = operations.watch(self._settings, self.id, timeout, replay=True)
        async with aclosing(self._driver.events(flow, self._see)) as events:
            async for event in events:
                yield event

    async def wait(self, timeout: float | None = None, progress: bool = False) -> AsyncJobHandle:
        """As `JobHandle.wait`."""
        with Listener(self.process, progress) as listener:
            self._see(await self._driver.run(operations.watch(self._settings, self.id, timeout), listener))
        operations.require_success(self._job)
        return self

    async def result(self) -> Result:
        """As `JobHandle.result`."""
        return await self._driver.run(operations.fetch(self._settings, self.id))

    async def cancel(self) -> AsyncJobHandle:
        """As `JobHandle.cancel`."""
        self._see(await self._driver.run(operations.cancel(self._settings, self.id)))
        return self

    def _see(self, job: Job) -> None:
        self._job = job
