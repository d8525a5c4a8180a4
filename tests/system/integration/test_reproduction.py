"""The page docs/reproduction.md is what its command prints, as far as that is computed in seconds."""

from __future__ import annotations

import re

import numpy as np
import pytest

from grazemap.local_client import LocalClient
from paper.codimension_two import computed_points, figure_5, figure_7
from paper.discontinuity import mapping, unfolding
from paper.double_grazing import figure_2, figure_3
from paper.errors import errors
from paper.figure_8 import (
    CHAIN,
    CLEARANCE,
    COLUMNS,
    EVERY_COLUMN,
    EVERY_ROW,
    OMEGA,
    ROWS,
    borders,
    closed_forms,
    labels,
)
from paper.motions import Run
from paper.one_stop import attractors, search
from paper.paper import GAMMA, REGIONS, Region
from paper.samples import samples_of
from paper.touching import speeds
from tests.support.pages import DOCS, NUMBER, assert_on_page, same

PAGE = (DOCS / "reproduction.md").read_text(encoding="utf-8")


def table_rows(title: str, page: str = PAGE) -> list[list[str]]:
    """Return the lines of the tables of a section, heads among them."""
    start = page.index(f"## {title}\n")
    lines = page[start:].removeprefix("## ").partition("\n## ")[0].splitlines()
    return [line.strip("| ").split(" | ") for line in lines if line.startswith("| ")]


def on_page(cells: list[str], title: str, page: str = PAGE) -> bool:
    """Whether a table of a section has a line, its numbers up to their last digits."""
    texts = [NUMBER.sub("#", cell) for cell in cells]
    for row in table_rows(title, page):
        if [NUMBER.sub("#", cell) for cell in row] == texts:
            pairs = zip(NUMBER.findall(" | ".join(row)), NUMBER.findall(" | ".join(cells)), strict=True)
            if all(same(*pair) for pair in pairs):
                return True
    return False


def printed_clearance(title: str, column: int, first: str) -> float:
    """Return the clearance in a column of the line that begins with a word, of the table that has it there."""
    rows = [row for row in table_rows(title) if row[0] == first and re.fullmatch(r"\d\.\d{4,6}", row[column])]
    return float(rows[0][column])


def title_of_line(omega: float) -> str:
    high, low = REGIONS[omega][0]
    return f"omega = {omega}, clearance from {high:g} down to {low:g}"


@pytest.mark.parametrize(
    "part", [figure_2, figure_3, mapping, figure_5, figure_7, pytest.param(unfolding, marks=pytest.mark.thorough)]
)
def test_the_page_has_the_computed_sections(stack: LocalClient, part) -> None:
    assert_on_page(part(stack), PAGE)


def test_the_page_has_the_errors_of_the_paper(stack: LocalClient) -> None:
    assert_on_page(errors(stack, computed_points(stack)[GAMMA]), PAGE)


def test_the_page_has_the_unfolding_map_at_some_points_and_its_borders(stack: LocalClient) -> None:
    umap = stack.unfolding_map(
        CHAIN,
        omega=np.linspace(*OMEGA, COLUMNS)[::EVERY_COLUMN],
        clearance=np.linspace(*CLEARANCE, ROWS)[::EVERY_ROW],
        progress=False,
    )
    rows = labels(umap) + borders(closed_forms(stack))
    assert len(rows) > 16
    assert [row for row in rows if not on_page(row, "Figure 8: the unfolding diagram")] == []


@pytest.mark.parametrize(("omega", "letters"), [(0.29, "acf"), pytest.param(0.27, "mp", marks=pytest.mark.thorough)])
def test_the_page_has_the_orbits_of_figure_9(stack: LocalClient, omega: float, letters: str) -> None:
    title, (span, printed) = title_of_line(omega), REGIONS[omega]
    wanted = {region: printed_clearance(title, 2, region.letter) for region in printed if region.letter in letters}
    samples = samples_of(stack, omega, span, wanted)
    assert [sample.row for sample in samples if not on_page(sample.row, title)] == []
    history_with_impacts = [sample for sample in samples if sample.region.letter != "a"]
    assert all(sample.verified for sample in history_with_impacts)
    row = history_with_impacts[0].row
    planted = re.sub(r"(\d)( \()", lambda match: f"{(int(match[1]) + 5) % 10}{match[2]}", row[7], count=1)
    assert planted != row[7]
    assert not on_page([*row[:7], planted], title)


def test_the_page_has_the_results_of_the_searches(stack: LocalClient) -> None:
    title = "Region (b): multi-0r-0l"
    first = table_rows(title)[2][0]
    (row,) = speeds(stack, 0.29, [float(first)])
    assert on_page(row, title)
    title = "Region (m): 3-(-1)r-3l"
    first = table_rows(title)[3][0]
    (row,) = attractors(stack, 0.27, [float(first)])
    assert on_page(row, title)
    row = search(stack, 0.27, float(first)).row
    assert on_page(row, title)
    assert not on_page([*row[:3], str(int(row[3]) + 1), *row[4:]], title)


@pytest.mark.parametrize("name", ["reproduction", "published"])
def test_every_picture_of_a_page_is_there(name: str) -> None:
    linked = re.findall(r"!\[[^]]+\]\(([^)]+)\)", (DOCS / f"{name}.md").read_text("utf-8"))
    assert len(linked) == len(set(linked)) >= 4
    for path in linked:
        assert (DOCS / path).read_bytes().startswith(b"\x89PNG")


def test_a_changed_digit_is_detected() -> None:
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
