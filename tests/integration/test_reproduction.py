"""The page docs/reproduction.md is what its command prints, as far as that is computed in seconds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from examples.reproduce.codimension_two import computed_points, figure_5, figure_7
from examples.reproduce.discontinuity import mapping, unfolding
from examples.reproduce.double_grazing import figure_2, figure_3
from examples.reproduce.errors import errors
from examples.reproduce.motions import Run
from examples.reproduce.page import PICTURES, Section
from examples.reproduce.paper import GAMMA, Region
from grazemap.embedded import LocalClient

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "reproduction.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"-?\d+\.\d+(?:e[-+]\d+)?|1e-1\d")


def same(printed: str, computed: str) -> bool:
    """Whether two numbers are equal but for their last digit; bounds of round-off need only be as small."""
    if printed == computed or (printed.startswith("1e-1") and computed.startswith("1e-1")):
        return True
    digits, _, exponent = printed.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(float(printed) - float(computed)) < 1.5 * unit


def assert_on_page(section: Section) -> None:
    title = f"## {section.title}\n"
    assert title in PAGE
    printed = PAGE[PAGE.index(title) :].removeprefix(title).partition("\n## ")[0].split()
    computed = section.markdown().removeprefix(title).split()
    text = [NUMBER.sub("#", " ".join(words)) for words in (printed, computed)]
    assert text[0] == text[1]
    pairs = zip(NUMBER.findall(" ".join(printed)), NUMBER.findall(" ".join(computed)), strict=True)
    assert [pair for pair in pairs if not same(*pair)] == []
    for row in section.rows:
        assert f"| {row.what} | {row.printed} |" in PAGE
    assert set(section.pictures) <= {path.name for path in (DOCS / PICTURES).iterdir()}


@pytest.mark.parametrize("part", [figure_2, figure_3, mapping, figure_5, figure_7, unfolding])
def test_the_page_has_what_is_computed(stack: LocalClient, part) -> None:
    assert_on_page(part(stack))


def test_the_page_has_the_proofs_of_the_paper_s_errors(stack: LocalClient) -> None:
    assert_on_page(errors(stack, computed_points(stack)[GAMMA]))


def test_every_picture_of_the_page_is_there() -> None:
    linked = re.findall(r"!\[[^]]+\]\(([^)]+)\)", PAGE)
    assert len(linked) == len(set(linked)) >= 9
    for path in linked:
        assert (DOCS / path).read_bytes().startswith(b"\x89PNG")


def test_a_changed_digit_is_seen() -> None:
    assert same("0.282469586635", "0.282469586636")
    assert not same("0.282469586635", "0.282469586735")
    assert same("1.3383e-08", "1.3384e-08")
    assert not same("1.3383e-08", "1.3393e-08")
    assert same("1e-14", "1e-13")


def test_a_printed_label_is_matched_by_impacts_and_turns() -> None:
    run = Run([1.6432, 1.6427], [0.1, 0.1], "periodic", (3, 4, 3), turns=6)
    assert run.matches(Region("p", 6, 4, 3))
    assert not run.matches(Region("p", 3, 4, 3))  # the least period is not the printed n
    assert not run.matches(Region("p", 6, 3, 4))
    assert run.matches(Region("p", 6, 3, 4), mirrored=True)
    assert not Run([1.6], [float("nan")], "chaotic", None).matches(Region("r", None, None, None))
