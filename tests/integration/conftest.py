"""One real stack for all tests here: embedded Redis, service and one worker, as `grazemap.local()` starts them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import grazemap
from grazemap.embedded import LocalClient


@pytest.fixture(scope="session")
def stack() -> Iterator[LocalClient]:
    """A client of it; do not stop it."""
    with grazemap.local(workers=1) as client:
        yield client
