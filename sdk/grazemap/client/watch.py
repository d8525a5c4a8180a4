"""Following a job until it is finished: by its event stream or, where that fails, by polling."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing

import httpx2

from grazemap import constants
from grazemap.client.connection import AsyncConnection, lines_of
from grazemap.client.events import Event, EventDecoder, last_events
from grazemap.client.http import pause
from grazemap.errors import ConnectionFailed, ProtocolError, WaitTimeout
from grazemap.wire import FINISHED, Job


def _timeout(job: Job) -> WaitTimeout:
    return WaitTimeout(f"job {job.id} was last seen {job.status}; it continues", job)


class Follower:
    """Follows one job until it is finished, over several connections if necessary.

    A stream that breaks is resumed where it ended (Last-Event-ID). Waiting for a line of a stream cannot be
    interrupted, so the job is polled when less time remains than a stream may be silent.

    Parameters
    ----------
    connection : AsyncConnection
    path : str
        The job's address.
    timeout : float, optional
        Seconds to wait for the end.
    job : Job, optional
        The last known state of the job; left out: it is requested first.
    stale : bool
        Request the job first though a state is known.
    replay : bool
        For a finished job: yield all events that the service still stores, not only the last progress and done.

    Attributes
    ----------
    job : Job or None
        The job as last seen.
    """

    def __init__(
        self,
        connection: AsyncConnection,
        path: str,
        timeout: float | None = None,
        job: Job | None = None,
        replay: bool = False,
        stale: bool = False,
    ) -> None:
        self.job = job
        self._stale = stale
        self._connection = connection
        self._path = path
        self._replay = replay
        self._deadline = None if timeout is None else connection.now() + timeout
        # more attempts than for a plain request, unless retries are switched off
        retries = connection.settings.retries
        self._retries = max(retries, constants.FOLLOW_RETRIES) if retries else 0
        self._done = False
        self._seen = 0
        self._last_id = ""
        self._waiting_for: str | None = None

    async def run(self, listen: Callable[[Event], None] | None = None) -> Job:
        """Follow the job to its end, call `listen` with each event, and return the job. Raises WaitTimeout."""
        async with aclosing(self.events()) as events:
            async for event in events:
                if listen is not None:
                    listen(event)
        assert self.job is not None  # set before the first event
        return self.job

    async def events(self) -> AsyncGenerator[Event]:
        """Yield the job's events until it is finished. Raises WaitTimeout."""
        job = await self._fetch_job() if self.job is None or self._stale else self.job
        broken = 0
        while job.status not in FINISHED or (self._replay and not self._done):
            polls = broken >= constants.STREAM_ATTEMPTS or self._near_deadline()
            seen_before = self._seen
            async with aclosing(self._poll(job) if polls else self._stream_events()) as events:
                async for event in events:
                    yield event
            if polls:
                break
            job = await self._fetch_job()
            broken = 0 if self._seen > seen_before else broken + 1
            if job.status not in FINISHED:
                self._done = False  # it was the end of an earlier computation of the same request
            for event in self._waiting_events(job):
                yield event
            again = not self._done and 0 < broken < constants.STREAM_ATTEMPTS
            if again and not self._near_deadline():
                await self._connection.sleep(pause(broken - 1))
        if not self._done:
            assert self.job is not None
            for event in last_events(self.job):
                yield event

    async def _fetch_job(self) -> Job:
        try:
            response = await self._connection.send("GET", self._path, retries=self._retries, deadline=self._deadline)
        except ConnectionFailed as error:
            if self.job is None or self._deadline is None or self._connection.now() < self._deadline:
                raise
            raise _timeout(self.job) from error
        self.job = Job.read(response.content)
        return self.job

    def _near_deadline(self) -> bool:
        return self._deadline is not None and self._deadline - self._connection.now() < constants.STREAM_SILENCE

    async def _stream_events(self) -> AsyncGenerator[Event]:
        """Yield the events of one stream until it ends or breaks, or the deadline is near."""
        headers = {"accept": "text/event-stream", "cache-control": "no-store"}
        if self._last_id:
            headers["last-event-id"] = self._last_id
        decoder = EventDecoder(self._last_id)
        try:
            async with self._connection.stream(self._path + "/events", headers, constants.STREAM_SILENCE) as response:
                kind = response.headers.get("content-type", "")
                if response.status_code != 200 or not kind.startswith("text/event-stream"):
                    return
                async with aclosing(lines_of(response)) as lines:
                    async for line in lines:
                        event = decoder.feed(line)
                        if event is not None:
                            self._seen += event.id != self._last_id  # an event without an id may come on every stream
                            self._last_id = event.id
                            self._done = event.name == "done"
                            if event.name == "waiting":
                                self._waiting_for = event.data.get("waiting_for")
                            yield event
                        if self._done or self._near_deadline():
                            return
        except (httpx2.RequestError, ProtocolError):
            # Not an error: the caller requests the job, opens another stream, and polls after several such failures.
            pass

    async def _poll(self, job: Job) -> AsyncGenerator[Event]:
        """Request the job at increasing intervals until it is finished, and yield its progress."""
        seconds = constants.POLL_START
        seen = None
        while job.status not in FINISHED:
            if job.progress != seen:
                seen = job.progress
                yield Event("", "progress", seen.model_dump())
            for event in self._waiting_events(job):
                yield event
            if self._deadline is not None:
                left = self._deadline - self._connection.now()
                if left <= 0:
                    raise _timeout(job)
                seconds = min(seconds, left)
            await self._connection.sleep(seconds)
            seconds = min(constants.MAX_POLL_INTERVAL, seconds * constants.POLL_GROWTH)
            job = await self._fetch_job()

    def _waiting_events(self, job: Job) -> list[Event]:
        """Return a waiting event if what an unfinished job waits for has changed since the last event."""
        if job.status in FINISHED or job.waiting_for == self._waiting_for:
            return []
        self._waiting_for = job.waiting_for
        return [Event("", "waiting", {"waiting_for": job.waiting_for})]
