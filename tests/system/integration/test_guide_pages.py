"""Pages that users read first: their blocks print what stands after them. `make check-pages` runs all pages."""

from __future__ import annotations

from pathlib import Path

import pytest

from grazemap.local_client import LocalClient
from tools.guide import pages


@pytest.mark.parametrize("name", ["start.md", "sdk.md"])
def test_the_blocks_print_what_the_page_shows(name: str, stack: LocalClient, tmp_path: Path) -> None:
    with pages.examples_ask(stack.base_url):
        assert pages.differences(pages.DOCS / name, stack, tmp_path) == []
