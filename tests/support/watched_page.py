"""A page in headless Chromium, what it complained about, and what it asked for."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import ConsoleMessage, Page, Request

# Chromium asks its maker's hosts for this and that unless it is told not to.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# What Chromium says of an answer of 400 or more, even where the page expects it.
REFUSED = "Failed to load resource: the server responded with a status of 4"


class Watched:
    """A page, what it complained about, and what it asked for."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.refusals: list[str] = []
        self.requests: list[Request] = []
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request))

    def _console(self, message: ConsoleMessage) -> None:
        if message.text.startswith(REFUSED):
            self.refusals.append(message.text)
        elif message.type in {"error", "warning"}:
            self.complaints.append(message.text)

    def hosts(self) -> set[str]:
        """Return the hosts that were asked."""
        parts = [urlsplit(request.url) for request in self.requests]
        return {part.netloc for part in parts if part.scheme not in {"data", "blob"}}

    def posted(self, process: str) -> list[dict[str, Any]]:
        """Return the bodies that were posted to a process."""
        mine = [
            request for request in self.requests if request.method == "POST" and request.url.endswith(f"/v1/{process}")
        ]
        return [request.post_data_json for request in mine]
