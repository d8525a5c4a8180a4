"""Pages that users read first: their blocks print what stands after them. `make check-pages` runs all pages."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

import grazemap
from grazemap.local_client import LocalClient
from tools.guide import pages


@pytest.mark.parametrize("name", ["start.md", "sdk.md"])
def test_the_blocks_print_what_the_page_shows(
    name: str, stack: LocalClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("GRAZEMAP_URL", stack.base_url)
    with ExitStack() as opened:

        def local(*_: Any, **__: Any) -> grazemap.Client:
            return opened.enter_context(grazemap.Client(stack.base_url))  # of its own, as the page may close it

        monkeypatch.setattr(grazemap, "local", local)
        assert pages.differences(pages.DOCS / name, stack, tmp_path) == []
