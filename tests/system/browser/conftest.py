"""A stack, headless Chromium, and pages that are watched: they complain about nothing and ask no other host."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.support.watched_page import FLAGS, Watched

CHROMIUM = shutil.which("chromium", path="/usr/bin")


@pytest.fixture(scope="session")
def url() -> Iterator[str]:
    """The address of a whole stack."""
    command = [sys.executable, "-m", "grazemap_service.stack", "--workers", "2", "--die-with-parent"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as stack:
        try:
            assert stack.stdout is not None
            yield json.loads(stack.stdout.readline())["url"]
        finally:
            stack.terminate()
            stack.wait(10)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("no /usr/bin/chromium: make browser installs it")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=FLAGS)
        yield chromium
        chromium.close()


def watched_page(browser: Browser, url: str, width: int, height: int) -> Iterator[Watched]:
    context = browser.new_context(viewport={"width": width, "height": height})
    watched = Watched(context.new_page())
    yield watched
    context.close()
    assert watched.complaints == []
    assert watched.hosts() == {urlsplit(url).netloc}


@pytest.fixture
def watched(browser: Browser, url: str) -> Iterator[Watched]:
    yield from watched_page(browser, url, 1280, 800)


@pytest.fixture
def small(browser: Browser, url: str) -> Iterator[Watched]:
    """A page whose plane has few tiles."""
    yield from watched_page(browser, url, 900, 480)
