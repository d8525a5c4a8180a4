"""The explorer as its tests see it: windows of the plane, and where their points are on the page."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx2
from playwright.sync_api import Page, expect

from tests.support.watched_page import Watched
from tests.support.watching import until

# Above the grazing curve, where tiles take a moment; the first window, one below it; two where tiles take seconds.
QUICK = "omega=0.25..0.28125&clearance=2..2.25"
FIRST = "omega=0.25..0.3125&clearance=1.5..2.25"
USUAL = "omega=0.25..0.3125&clearance=1.25..2"
HARD = "omega=0.28125..0.296875&clearance=1.25..1.375"
ALSO_HARD = "omega=0.296875..0.3125&clearance=1.25..1.375"
LEFT, RIGHT, TOP, BOTTOM = 66, 12, 10, 42  # margins of the plane in its canvas
WAIT = 120_000


def show(watched: Watched, url: str, state: str, *, wait: bool = True) -> Page:
    """Open a window of the plane, and wait until the page answers, or for its verified tiles."""
    watched.page.goto(f"{url}/#{state}")
    expect(watched.page.locator("#says")).not_to_be_empty()
    if wait:
        verified(watched.page)
    return watched.page


def verified(page: Page) -> None:
    """Wait for the verified tiles of the window, for as long as there are more and more of them."""
    says = page.locator("#says")
    text = ""
    while not re.match(r"\d+ tiles complete", text):
        count = re.search(r"\d+ of \d+ tiles", text)
        if count is not None:
            expect(says).not_to_contain_text(count[0], timeout=WAIT)
        expect(says).to_have_text(re.compile(r"^\d+ tiles complete|\d+ of \d+ tiles"), timeout=WAIT)
        text = says.inner_text()


def reading(page: Page, at: tuple[float, float]) -> str:
    """Point at a place of the page, and return what the page says of it."""
    page.mouse.move(*at)
    page.evaluate("() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
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


def place(page: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the plane is on the page."""
    box, fragment = page.locator("#plane").bounding_box(), parse_qs(urlsplit(page.url).fragment)
    assert box is not None
    names = fragment.get("horizontal", ["omega"])[0], fragment.get("vertical", ["clearance"])[0]
    (left, right), (low, high) = ([float(end) for end in fragment[name][0].split("..")] for name in names)
    across, up = (x - left) / (right - left), (high - y) / (high - low)
    return (
        box["x"] + LEFT + across * (box["width"] - LEFT - RIGHT),
        box["y"] + TOP + up * (box["height"] - TOP - BOTTOM),
    )


def answered(url: str, process: str, request: dict[str, Any]) -> dict[str, Any]:
    """Return the result that the API gives of a request."""
    waiting = {"Prefer": "wait=20, return=representation"}
    result: dict[str, Any] = httpx2.post(f"{url}/v1/{process}", json=request, headers=waiting).json()
    return result


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
