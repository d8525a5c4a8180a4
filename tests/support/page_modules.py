"""The modules of the page by themselves, in a browser without a service."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page

import grazemap_service

STATIC = Path(grazemap_service.__file__).parent / "static" / "explorer"


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


@contextmanager
def modules(browser: Browser) -> Iterator[Page]:
    """A page from which the modules are imported, as ``await import("/address.js")``."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=STATIC)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        page = browser.new_page()
        try:
            page.goto(f"http://127.0.0.1:{server.server_address[1]}/tiles.js")
            yield page
        finally:
            page.close()
            server.shutdown()
            thread.join()
