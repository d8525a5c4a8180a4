"""Whether a page in docs has the numbers that its command computes."""

from __future__ import annotations

import re
from pathlib import Path

from paper.page import PICTURES, Section

DOCS = Path(__file__).parents[2] / "docs"
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]\d+)?|1e-1\d")


def same(printed: str, computed: str) -> bool:
    """Whether two numbers are equal but for their last digit; bounds of round-off need only be as small."""
    if printed == computed or (printed.startswith("1e-1") and computed.startswith("1e-1")):
        return True
    digits, _, exponent = printed.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(float(printed) - float(computed)) < 1.5 * unit


def assert_on_page(section: Section, page: str) -> None:
    """Assert that a page has a section with these numbers, its lines at the top, and its pictures."""
    title = f"## {section.title}\n"
    assert title in page
    printed = page[page.index(title) :].removeprefix(title).partition("\n## ")[0].split()
    computed = section.markdown().removeprefix(title).split()
    text = [NUMBER.sub("#", " ".join(words)) for words in (printed, computed)]
    assert text[0] == text[1]
    pairs = zip(NUMBER.findall(" ".join(printed)), NUMBER.findall(" ".join(computed)), strict=True)
    assert [pair for pair in pairs if not same(*pair)] == []
    for row in section.rows:
        assert f"| {row.what} | {row.printed} |" in page
    assert set(section.pictures) <= {path.name for path in (DOCS / PICTURES).iterdir()}
