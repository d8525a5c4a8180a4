"""Server-sent events (WHATWG HTML, 9.2.6), line by line: what `Event`s a stream of lines holds."""

from __future__ import annotations

import json

from grazemap.client.io_effects import Event
from grazemap.errors import ProtocolError


class EventDecoder:
    """Feed it lines without their ends; it answers each with an event or None.

    Comments, which keep a connection alive, give None like any unfinished event: the caller gets to look at its clock.
    """

    def __init__(self, last_id: str = "") -> None:
        self.last_id = last_id
        self._name = ""
        self._data: list[str] = []

    def feed(self, line: str) -> Event | None:
        """Take one line; return the event that it completes.

        Raises
        ------
        ProtocolError
            An event whose data are not a JSON object.
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
        elif field == "id" and "\0" not in value:
            self.last_id = value
        return None

    def _complete(self) -> Event | None:
        name, data = self._name or "message", "\n".join(self._data)
        self._name, self._data = "", []
        if not data:
            return None
        try:
            content = json.loads(data)
        except (ValueError, RecursionError) as error:
            raise ProtocolError("an event of the job is not JSON") from error
        if not isinstance(content, dict):
            raise ProtocolError("an event of the job is not a JSON object")
        return Event(self.last_id, name, content)
