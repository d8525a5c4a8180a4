"""The events of a job, and their decoder for a stream of server-sent events (WHATWG HTML, 9.2.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from grazemap.client.http import json_object
from grazemap.constants import MAX_EVENT_LENGTH
from grazemap.described import described
from grazemap.errors import ProtocolError
from grazemap.wire import Job


@described
@dataclass(frozen=True)
class Event:
    """One server-sent event of a job."""

    id: str
    """Its position in the job's stream; "" for an event that comes from polling."""
    name: str
    """"progress", "waiting", "tile" or "done"."""
    data: dict[str, Any]
    """progress: done, total, unit, eta_seconds; waiting: waiting_for, None when the job is computed; tile: index, rows;
    done: status."""


class EventDecoder:
    """Decodes a stream line by line; `feed` takes lines without line ends.

    The service sends comments to keep a connection alive. For a comment `feed` returns None, so that the caller can
    check the time.
    """

    def __init__(self, last_id: str = "") -> None:
        self.last_id = last_id
        self._name = ""
        self._data: list[str] = []
        self._length = 0

    def feed(self, line: str) -> Event | None:
        """Return the event that a line completes, or None.

        Raises
        ------
        ProtocolError
            An event whose data are not a JSON object, or too long.
        """
        if not line:
            return self._complete()
        if line.startswith(":"):
            return None
        field, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if field == "event":
            self._name = value
        elif field == "data":
            self._data.append(value)
            self._length += len(value) + 1
            if self._length > MAX_EVENT_LENGTH:
                raise ProtocolError(f"an event is longer than {MAX_EVENT_LENGTH} characters")
        elif field == "id" and "\0" not in value:
            self.last_id = value
        return None

    def _complete(self) -> Event | None:
        name, data = self._name or "message", "\n".join(self._data)
        self._name, self._data, self._length = "", [], 0
        if not data:
            return None
        return Event(self.last_id, name, json_object(data, "an event of the job"))


def last_events(job: Job) -> list[Event]:
    """Return the last two events of a finished job."""
    return [Event("", "progress", job.progress.model_dump()), Event("", "done", {"status": job.status})]
