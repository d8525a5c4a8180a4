"""The page docs/published.md is what its command prints."""

from __future__ import annotations

import pytest

from grazemap.local_client import LocalClient
from paper.published.__main__ import PARTS, head
from paper.published.impact_damper import impact_damper
from paper.published.one_mass import Family
from paper.published.resonant_graze import curves, tangency
from paper.published.undamped import undamped
from tests.support.pages import DOCS, assert_on_page

LONG = (curves, undamped, impact_damper)
PAGE = (DOCS / "published.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "part", [pytest.param(part, marks=pytest.mark.thorough) if part in LONG else part for part in PARTS]
)
def test_the_page_has_the_computed_sections(stack: LocalClient, part) -> None:
    assert_on_page(part(stack), PAGE)


def test_a_row_of_the_page_is_printed_at_its_head(stack: LocalClient) -> None:
    section = tangency(stack)
    (row,) = (row for row in section.rows if row.what.endswith("PD"))
    assert row.computed in head([section])


def test_orbits_in_closed_form_are_on_the_ellipse_of_the_undamped_oscillator() -> None:
    omega, restitution, clearance = 2.8, 0.8, 0.3
    family = Family.of(0.0, restitution, omega)
    for speed in family.speeds(clearance):
        place, slope = clearance + family.displacement * speed, family.velocity * speed / omega
        assert place**2 + slope**2 == pytest.approx((1.0 / (omega**2 - 1.0)) ** 2, rel=1e-12)
    # without damping an impact every period leaves half its change of velocity before it
    assert family.velocity == pytest.approx(0.5 * (1.0 - restitution), rel=1e-12)
