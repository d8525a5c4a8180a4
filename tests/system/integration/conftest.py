"""One real stack for all tests here: embedded Redis, service and one worker, as `grazemap.local()` starts them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import grazemap
from grazemap.local_client import LocalClient


@pytest.fixture(scope="session")
def stack() -> Iterator[LocalClient]:
    """A client of it; do not stop it."""
    with pytest.MonkeyPatch.context() as environment:
        # Settings of an operator's service on the same machine: a private stack must not take them over.
        environment.setenv("GRAZEMAP_API_KEYS", "of-another-service")
        environment.setenv("GRAZEMAP_ALLOWED_HOSTS", "another.example")
        client = grazemap.local(workers=1)
    with client:
        yield client
