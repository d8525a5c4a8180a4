"""The explorer inside a page of another origin: with the controls that its address names, and not for everyone."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, FrameLocator, Page, Request, expect

from grazemap import Client
from tests.support.explorer_page import QUICK, soon
from tests.support.running_stack import RunningStack
from tests.support.watched_page import Watched

pytestmark = pytest.mark.browser

KEY = "a-key-that-is-long-enough-0123456789"
MACHINE, COURSE = "localhost", "127.0.0.2"  # names of hosts: of a notebook on this machine, and of a course page


class Lesson(http.server.BaseHTTPRequestHandler):
    """A page with a body."""

    content = ""

    def do_GET(self) -> None:
        """Answer with the page."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(f"<!DOCTYPE html><title>Lesson</title>{self.content}<p style='height:2000px'>".encode())

    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """The port of a server with a lesson, under every name of this machine."""
    with http.server.ThreadingHTTPServer(("", 0), Lesson) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_port
        server.shutdown()
        thread.join()


@pytest.fixture
def watched(browser: Browser) -> Iterator[Watched]:
    context = browser.new_context(viewport={"width": 1000, "height": 900})
    yield Watched(context.new_page())
    context.close()


def framed(page: Page, host: str, port: int, content: str) -> FrameLocator:
    """Open a page with a body at a host; return its frame."""
    Lesson.content = content
    page.goto(f"http://{host}:{port}/")
    return page.frame_locator("iframe")


def frame(address: str) -> str:
    return f"<iframe src='{address}' style='width:800px;height:500px'></iframe>"


def test_a_page_of_this_machine_shows_the_chosen_controls(watched: Watched, url: str, port: int) -> None:
    page = watched.page
    inside = framed(page, MACHINE, port, frame(f"{url}/#{QUICK}&embed=sliders"))
    expect(inside.locator("#living")).to_be_visible(timeout=60_000)
    expect(inside.locator("#sliders input").first).to_be_visible()
    for hidden in ("header", "#legend-section", "#zoom-in", "#home", "#preset", "#form-section", "#story"):
        expect(inside.locator(hidden)).to_be_hidden()
    # a press keeps to the plane, as the address does not name the point
    before = page.evaluate("history.length")
    inside.locator("#plane").click(position={"x": 500, "y": 250})
    expect(inside.locator("#reading")).to_contain_text("ω =")
    expect(inside.locator("#point-section")).to_be_hidden()
    # a slider asks for another machine; neither it nor the window is a step back for the page around
    slider = inside.locator("#sliders input").first
    slider.focus()
    slider.press("ArrowLeft")
    whole = inside.locator("#whole")
    soon(page, lambda: "machine=" in (whole.get_attribute("href") or ""))
    assert page.evaluate("history.length") == before
    with page.expect_popup() as opening:
        whole.click()
    alone = opening.value
    expect(alone.locator("header")).to_be_visible()
    inside = framed(page, MACHINE, port, frame(f"{url}/#{QUICK}&embed=restitution"))
    expect(inside.locator("#sliders input")).to_have_count(1, timeout=60_000)
    expect(inside.locator("#sliders input[name=restitution]")).to_be_visible()
    assert "embed" not in alone.url
    assert "machine=" in alone.url
    expect(alone.locator("#whole")).to_be_hidden()
    assert watched.complaints == []


def test_the_wheel_scrolls_the_page_around_until_a_press_is_on_the_plane(watched: Watched, url: str, port: int) -> None:
    page = watched.page
    inside = framed(page, MACHINE, port, frame(f"{url}/#{QUICK}&embed="))
    expect(inside.locator("#living")).to_be_visible(timeout=60_000)
    page.mouse.move(500, 300)
    page.mouse.wheel(0, 120)
    soon(page, lambda: page.evaluate("scrollY") > 0)
    scrolled = page.evaluate("scrollY")
    address = inside.locator("#whole").get_attribute("href")
    inside.locator("#plane").click(position={"x": 400, "y": 250})
    page.mouse.wheel(0, 120)
    soon(page, lambda: inside.locator("#whole").get_attribute("href") != address)
    assert page.evaluate("scrollY") == scrolled
    # a moved window has a way back
    inside.locator("#home").click()
    expect(inside.locator("#whole")).to_have_attribute("href", str(address))
    expect(inside.locator("#home")).to_be_hidden()


def test_a_notebook_shows_the_page_of_a_map(watched: Watched, url: str, port: int) -> None:
    with Client(url) as client:
        umap = client.unfolding_map(omega=(0.25, 0.31), clearance=(1.5, 2.25), shape=(24, 24), progress=False)
    inside = framed(watched.page, MACHINE, port, umap.explore(height=480)._repr_html_())
    assert umap.motions()[0].label == "1-(-1)r-(-1)l"
    expect(inside.locator('#legend button[value="1-(-1)r-(-1)l"]')).to_be_attached(timeout=60_000)
    expect(inside.locator("header")).to_be_visible()
    assert watched.page.locator("iframe").bounding_box()["height"] == 480  # type: ignore[index]
    assert watched.complaints == []


def test_other_origins_may_not_show_it_unless_a_setting_names_them(watched: Watched, url: str, port: int) -> None:
    framed(watched.page, COURSE, port, frame(f"{url}/#{QUICK}&embed="))
    soon(watched.page, lambda: any("frame-ancestors" in complaint for complaint in watched.complaints))
    assert not [request for request in watched.requests if "/v1/" in request.url]


@pytest.fixture
def guarded() -> Iterator[str]:
    """A stack with a key, which pages of a course may show."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("GRAZEMAP_FRAME_ORIGINS", f"http://{COURSE}:*")
        environment.setenv("GRAZEMAP_API_KEYS", KEY)
        stack = RunningStack()
    yield stack.url
    stack.stop()


def test_a_frame_asks_for_no_key(watched: Watched, guarded: str, port: int) -> None:
    page = watched.page
    refused: list[Request] = []
    page.on("response", lambda answer: refused.append(answer.request) if answer.status == 401 else None)
    inside = framed(page, COURSE, port, frame(f"{guarded}/#{QUICK}&embed=sliders"))
    expect(inside.locator("#says")).to_contain_text("key", timeout=60_000)
    assert refused
    expect(inside.locator("#key-dialog")).to_be_hidden()
    with page.expect_popup() as opening:
        inside.locator("#whole").click()
    expect(opening.value.locator("#key-dialog")).to_be_visible()
    assert watched.complaints == []
