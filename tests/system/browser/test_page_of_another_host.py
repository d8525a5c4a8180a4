"""The example of docs/languages.md for pages: it is served by another host, and draws a curve of the service."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.support.running_stack import RunningStack
from tests.support.watched_page import Watched

pytestmark = pytest.mark.browser

EXAMPLES = Path(__file__).parents[3] / "examples" / "languages"
# of the curve in the example
POINTS = 400


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def origin() -> Iterator[str]:
    """A host with the example."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=EXAMPLES)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def service(origin: str) -> Iterator[str]:
    """A stack that allows pages of this host."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("GRAZEMAP_CORS_ORIGINS", origin)
        stack = RunningStack()
    yield stack.url
    stack.stop()


def test_a_page_of_an_allowed_host_draws_the_curve(browser: Browser, origin: str, service: str) -> None:
    context = browser.new_context()
    watched = Watched(context.new_page())
    watched.page.goto(f"{origin}/grazing_curve.html?service={service}")
    expect(watched.page.locator("#caption")).to_contain_text("1.2", timeout=60_000)
    points = watched.page.locator("polyline").get_attribute("points") or ""
    x, y = zip(*(map(float, point.split(",")) for point in points.split()), strict=True)
    assert (x[0], x[-1], min(y)) == (0, 600, 0)
    assert list(x) == sorted(x)
    assert len(x) == POINTS
    assert watched.complaints == []
    context.close()


def test_a_page_of_another_host_is_told_that_it_may_not(browser: Browser, url: str, origin: str) -> None:
    """`url` is a stack without the setting."""
    context = browser.new_context()
    watched = Watched(context.new_page())
    watched.page.goto(f"{origin}/grazing_curve.html?service={url}")
    expect(watched.page.locator("#caption")).to_contain_text("fetch")
    assert watched.page.locator("polyline").get_attribute("points") is None
    context.close()
