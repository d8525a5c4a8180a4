"""The guide is made without a warning, every link in it leads somewhere, and its search knows its words."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

import pytest

from tools.guide.pages import DOCS


class Links(HTMLParser):
    """The links of a page, and the places in it to which links lead."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {name: value or "" for name, value in attrs}
        self.places |= {named[name] for name in ("id", "name") if name in named}
        self.links += [named[name] for name in ("href", "src") if name in named]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(folder / "trees")]
    done = subprocess.run([*command, str(DOCS), str(folder / "pages")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "pages"


def broken(site: Path) -> Iterator[str]:
    """Yield the links to files of the guide, or places in them, that are not there."""
    pages = {path: Links(path.read_text("utf-8")) for path in site.rglob("*.html")}
    for path, page in pages.items():
        for link in page.links:
            address, place = urldefrag(link)
            if urlsplit(address).scheme:
                continue
            target = (path.parent / unquote(urlsplit(address).path)).resolve() if address else path
            if not target.is_file() or (target in pages and unquote(place) not in pages[target].places):
                yield f"{path.name}: {link}"


def test_every_link_leads_somewhere(site: Path) -> None:
    assert [*broken(site)] == []
    (site / "index.html").write_text('<a href="none.html">x</a> <a href="glossary.html#none">y</a>')
    assert len([*broken(site)]) == 2


def test_nothing_comes_from_another_host(site: Path) -> None:
    for path in site.rglob("*.html"):
        loaded = re.findall(r'<(?:script|img|link|iframe)[^>]+(?:src|href)="(https?:[^"]*)"', path.read_text("utf-8"))
        assert not loaded, path


def test_its_search_knows_the_words_of_the_field(site: Path) -> None:
    index = (site / "searchindex.js").read_text("utf-8")
    assert all(word in index for word in ("clearanc", "graze", "restitut", "basin"))
