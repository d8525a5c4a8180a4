"""Following a job until it is finished: its event stream while that works, polling where it does not."""

from __future__ import annotations

from grazemap import constants
from grazemap.client.event_stream import EventDecoder
from grazemap.client.io_effects import (
    CloseStream,
    Event,
    Flow,
    LinkBroken,
    NextLine,
    Now,
    OpenStream,
    Reply,
    Send,
    Sleep,
)
from grazemap.client.retry import exchange, pause, read_model
from grazemap.errors import ProtocolError, WaitTimeout
from grazemap.wire import FINISHED, Job


def follow(path: str, retries: int, timeout: float | None, job: Job | None = None, replay: bool = False) -> Flow[Job]:
    """Hand on a job's events until it is finished, and return it as it is then.

    A broken stream is taken up again where it ended (Last-Event-ID). A stream cannot be left between two of its
    lines, so when less time is left than a stream may be silent the rest is polled, and `timeout` is kept.

    Parameters
    ----------
    path : str
        The job's address.
    retries : int
        Attempts after the first one for each plain request; a running job gets more patience, unless it is 0.
    timeout : float or None
        Seconds to wait for the end.
    job : Job, optional
        The job as it was a moment ago.
    replay : bool
        Hand on the events of a finished job too, as far as the service still has them; else there is nothing to
        wait for, and its end is all that is told.

    Raises
    ------
    WaitTimeout
    """
    deadline = None if timeout is None else (yield Now()) + timeout
    follower = _Follower(path, max(retries, constants.FOLLOW_RETRIES) if retries else 0, deadline)
    if job is None:
        job = yield from follower.look()
    broken = 0
    while job.status not in FINISHED or (replay and not follower.done):
        if broken >= constants.STREAM_ATTEMPTS or (yield from follower.near_deadline()):
            return (yield from follower.poll(job))
        before = follower.heard
        yield from follower.listen()
        job = yield from follower.look()
        broken = 0 if follower.heard > before else broken + 1
        if job.status not in FINISHED:
            follower.done = False  # that was the end of an earlier computation of the same question
        retried = not follower.done and 0 < broken < constants.STREAM_ATTEMPTS
        if retried and not (yield from follower.near_deadline()):
            yield Sleep(pause(broken - 1))
    if not follower.done:
        yield Event("", "progress", job.progress.model_dump())
        yield Event("", "done", {"status": job.status})
    return job


class _Follower:
    """One job over all the connections that it takes to see its end."""

    def __init__(self, path: str, retries: int, deadline: float | None) -> None:
        self.heard = 0
        self.done = False
        self._path = path
        self._retries = retries
        self._deadline = deadline
        self._last_id = ""

    def look(self) -> Flow[Job]:
        return read_model(Job, (yield from exchange(Send("GET", self._path), self._retries, self._deadline)))

    def near_deadline(self) -> Flow[bool]:
        if self._deadline is None:
            return False
        now: float = yield Now()
        return self._deadline - now < constants.STREAM_SILENCE

    def listen(self) -> Flow[None]:
        """Follow one connection until it ends, breaks, or the last stretch of the time begins."""
        headers = {"accept": "text/event-stream", "cache-control": "no-store"}
        if self._last_id:
            headers["last-event-id"] = self._last_id
        try:
            reply: Reply = yield OpenStream(self._path + "/events", headers, constants.STREAM_SILENCE)
            if reply.status == 200 and reply.headers.get("content-type", "").startswith("text/event-stream"):
                yield from self._read()
        except (LinkBroken, ProtocolError):
            # Nothing is lost: the caller looks at the job itself, comes back, and in the end does without a stream.
            pass
        yield CloseStream()

    def _read(self) -> Flow[None]:
        decoder = EventDecoder(self._last_id)
        while not self.done:
            line: str | None = yield NextLine()
            if line is None:
                return
            event = decoder.feed(line)
            if event is not None:
                self.heard += 1
                self._last_id = event.id
                self.done = event.name == "done"
                yield event
            if (yield from self.near_deadline()):
                return

    def poll(self, job: Job) -> Flow[Job]:
        """Look at the job at growing intervals until it is finished."""
        seconds = constants.POLL_START
        seen = None
        while job.status not in FINISHED:
            if job.progress != seen:
                seen = job.progress
                yield Event("", "progress", seen.model_dump())
            if self._deadline is not None:
                left = self._deadline - (yield Now())
                if left <= 0:
                    raise WaitTimeout(f"job {job.id} is still {job.status}; it goes on", job)
                seconds = min(seconds, left)
            yield Sleep(seconds)
            seconds = min(constants.POLL_LIMIT, seconds * constants.POLL_GROWTH)
            job = yield from self.look()
        yield Event("", "progress", job.progress.model_dump())
        yield Event("", "done", {"status": job.status})
        return job
