"""The explorer as its tests see it: windows of the plane, and where their points are on the page."""

from __future__ import annotations

import base64
import io
import re
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx2
import matplotlib.pyplot as plt
import numpy as np
from playwright.sync_api import Page, expect

from tests.support.watched_page import Watched
from tests.support.watching import until

# Above the grazing curve, where tiles take a moment; the first window, one below it; two where tiles take seconds.
QUICK = "omega=0.25..0.28125&clearance=2..2.25"
FIRST = "omega=0.25..0.3125&clearance=1.5..2.25"
USUAL = "omega=0.25..0.3125&clearance=1.25..2"
HARD = "omega=0.28125..0.296875&clearance=1.25..1.375"
ALSO_HARD = "omega=0.296875..0.3125&clearance=1.25..1.375"
WAIT = 120_000

# The maps of the window that are there, all of them, and whether the page says that it is done.
PROGRESS = """() => {
    const { value, max, className } = document.getElementById("progress");
    return [value, max, className === "done"];
}"""
DRAWN = "() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))"
IS_FREE = "([x, y]) => document.elementFromPoint(x, y)?.id === 'plane'"
OF_THE_POINTER = 32  # samples in a period, of the machine beside the pointer
CARDS = ("#machine-section", "#legend-section")


def show(watched: Watched, url: str, state: str, *, wait: bool = True) -> Page:
    """Open a window of the plane, and wait until the page knows its tiles, or for them to be verified."""
    watched.page.goto(f"{url}/#{state}")
    expect(watched.page.locator("#progress")).to_have_attribute("value", re.compile(r"\d"))
    if wait:
        verified(watched.page)
    return watched.page


def drawn(page: Page) -> None:
    """Wait until the page has drawn what it was told last."""
    page.evaluate(DRAWN)


def verified(page: Page) -> int:
    """Wait for the verified tiles of the window, for as long as there are more and more of them; return how many."""
    drawn(page)
    most, since = -1, time.monotonic()
    while True:
        done, total, is_done = page.evaluate(PROGRESS)
        if is_done:
            return int(total)
        if done != most:
            most, since = done, time.monotonic()
        assert time.monotonic() - since < WAIT / 1000, f"{done} of {total} tiles"
        page.wait_for_timeout(100)


def picture(page: Page) -> Any:
    """Return the colours of the plane, of shape (height, width, 3), without what floats over it."""
    _, _, data = page.evaluate("() => document.getElementById('plane').toDataURL()").partition(",")
    return np.round(255 * plt.imread(io.BytesIO(base64.b64decode(data)))[:, :, :3]).astype(int)


PREVIEW_ALPHA = 0.75  # of the colours of what is not verified yet


def paler(colours: Any) -> Any:
    """Return the colours in which previews have motions of these colours."""
    return 255 - PREVIEW_ALPHA * (255 - np.asarray(colours, float))


def reading(page: Page, at: tuple[float, float]) -> str:
    """Point at a place of the page, and return what the page says of it."""
    page.mouse.move(*at)
    drawn(page)
    return page.locator("#reading").inner_text()


def soon(page: Page, condition: Callable[[], object]) -> None:
    """Wait until a condition holds of what the page shows."""

    def holds() -> object:
        page.wait_for_timeout(50)  # in which events of the page arrive
        return condition()

    until(holds, 60)


def window(page: Page) -> tuple[list[float], list[float]]:
    """Return the window that the address says."""
    omega, clearance = re.search(r"omega=([^&]*)&clearance=([^&]*)", page.url).groups()  # type: ignore[union-attr]
    return [float(end) for end in omega.split("..")], [float(end) for end in clearance.split("..")]


def beside_axes(page: Page) -> tuple[list[float], list[float]]:
    """Return the window without the strips of the axes, as it is shown and taken home."""
    left, right, low, high = (float(field.input_value()) for field in page.locator("#window-form input").all())
    return [left, right], [low, high]


def spot(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the plane is on the page, whatever floats over it."""
    box, fragment = page.locator("#plane").bounding_box(), parse_qs(urlsplit(page.url).fragment)
    assert box is not None
    names = fragment.get("horizontal", ["omega"])[0], fragment.get("vertical", ["clearance"])[0]
    (left, right), (low, high) = ([float(end) for end in fragment[name][0].split("..")] for name in names)
    across, up = (x - left) / (right - left), (high - y) / (high - low)
    return box["x"] + across * box["width"], box["y"] + up * box["height"]


def is_free(page: Page, at: tuple[float, float]) -> bool:
    """Return whether the plane is what a pointer meets at a place of the page."""
    return bool(page.evaluate(IS_FREE, at))


def place(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the plane is on the page, where a pointer meets it: folds a card that is over it."""
    at = spot(page, x, y)
    for card in CARDS:
        if not is_free(page, at):
            summary = page.locator(f"{card}[open] > summary")
            if summary.is_visible():
                summary.click()
    assert is_free(page, at), f"something floats over ({x}, {y})"
    return at


def unfold(page: Page, *names: str) -> None:
    """Open menus and sections of the page that are closed."""
    for name in names:
        summary = page.locator("summary", has_text=re.compile(f"^{name}$"))
        if summary.locator("..").get_attribute("open") is None:
            summary.click()


def answered(url: str, process: str, request: dict[str, Any]) -> dict[str, Any]:
    """Return the result that the API gives of a request."""
    waiting = {"Prefer": "wait=20, return=representation"}
    result: dict[str, Any] = httpx2.post(f"{url}/v1/{process}", json=request, headers=waiting).json()
    return result


def trajectories_of_points(watched: Watched) -> list[dict[str, Any]]:
    """Return what was asked of the points that were opened, not of those that the pointer passed."""
    asked = watched.posted("trajectories")
    finest = max((body["samples_per_period"] for body in asked), default=0)
    return [body for body in asked if body["samples_per_period"] == finest > OF_THE_POINTER]


def maps(url: str) -> list[dict[str, Any]]:
    """Return the jobs of maps, newest first."""
    jobs: list[dict[str, Any]] = httpx2.get(f"{url}/v1/jobs?process=unfolding-maps&limit=500").json()["jobs"]
    return jobs


def ranges(body: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the ranges of the two axes of a request."""
    return body["horizontal"]["values"], body["vertical"]["values"]


def holds(body: dict[str, Any], *point: float) -> bool:
    """Return whether a point is inside the ranges of a request."""
    return all(values["start"] < value < values["stop"] for values, value in zip(ranges(body), point, strict=True))


def ended(url: str, job: str) -> str:
    """Wait for the end of a job, and return its status."""
    deadline = time.monotonic() + 30
    while (status := httpx2.get(f"{url}/v1/jobs/{job}").json()["status"]) in {"accepted", "running"}:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    return str(status)
