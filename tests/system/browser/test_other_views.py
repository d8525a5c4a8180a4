"""Views of the page beside the motions from rest: observables, other starts, other units, other motions at a point."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from urllib.parse import quote

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

from grazemap.results import UnfoldingMap
from grazemap.wire.observables import OBSERVABLES
from tests.support.explorer_page import answered, soon, unfold
from tests.support.watched_page import Watched
from tests.system.browser.conftest import watched_page

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

WAIT = 120_000
ABOVE = "omega=0.25..0.28125&clearance=2..2.25"
NEAR = "omega=0.275..0.2875&clearance=1.83..1.88"
STEEL = {"units": "SI", "masses": [0.5], "stiffnesses": [2000], "damping": [1.5], "forcing": [5], "restitution": 0.7}
HAMMER = quote(json.dumps({"oscillator": STEEL, "stops": "right"}))


@pytest.fixture
def tiny(browser: Browser, url: str) -> Iterator[Watched]:
    yield from watched_page(browser, url, 800, 400)


def test_every_observable_of_maps_is_a_layer_with_its_unit_and_description(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#{ABOVE}")
    options = page.locator("#layer option")
    expect(options.nth(len(OBSERVABLES))).to_be_attached()
    layers = dict(options.evaluate_all("all => all.map(({ value, title }) => [value, title])"))
    assert {name: UnfoldingMap.schema[name].description for name in OBSERVABLES}.items() <= layers.items()
    page.locator("#layer").select_option("peak_displacement")
    expect(page.locator("#ramp-text")).to_contain_text(re.compile(r"\d to "), timeout=WAIT)
    assert tiny.posted("unfolding-maps")[-1]["observables"] == ["peak_displacement"]
    page.mouse.move(400, 200)
    soon(page, lambda: "peak displacement" in page.locator("#reading").inner_text())


def test_values_come_first_for_few_points_and_then_for_all(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#{ABOVE}&layer=exponent")
    expect(page.locator("#progress")).to_have_class("done", timeout=WAIT)
    points = [
        body["horizontal"]["values"]["points"] for body in tiny.posted("unfolding-maps") if not body.get("preview")
    ]
    few, fine = min(points), max(points)
    assert few < fine
    assert points == sorted(points)
    assert points.count(few) == points.count(fine)


def test_a_sweep_is_one_map_of_the_window_and_says_so(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#{NEAR}&policy=sweep-up")
    expect(page.locator("#progress")).to_have_class("done", timeout=WAIT)
    (asked,) = tiny.posted("unfolding-maps")[:1]
    assert asked["policy"] == "sweep-up"
    across, up = asked["horizontal"]["values"], asked["vertical"]["values"]
    for values, (low, high) in ((across, (0.275, 0.2875)), (up, (1.83, 1.88))):
        half = (high - low) / values["points"] / 2
        assert values["start"] == pytest.approx(low + half)
        assert values["stop"] == pytest.approx(high - half)
    expect(page.locator("#says")).to_contain_text("swept")
    page.mouse.move(400, 250)
    soon(page, lambda: "sweep up" in page.locator("#reading").inner_text())
    page.mouse.click(400, 250)
    expect(page.locator("#point-why")).to_contain_text("sweep up", timeout=30_000)
    # each window is swept anew
    page.get_by_role("button", name="Zoom in").click()
    soon(page, lambda: len({json.dumps(body) for body in tiny.posted("unfolding-maps")}) > 1)


def test_the_number_of_motions_is_a_layer_of_ensembles_alone(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#{ABOVE}")
    number = page.locator("#layer option[value=number]")
    expect(number).to_be_disabled()
    page.locator("#view-section > summary").click()
    page.locator("#policy").select_option("ensemble")
    expect(page).to_have_url(re.compile("policy=ensemble"))
    expect(number).to_be_enabled()
    page.locator("#layer").select_option("number")
    expect(page).to_have_url(re.compile("layer=number"))
    expect(page.locator("#ramp-text")).to_contain_text(re.compile(r"0 to \d"), timeout=WAIT)
    page.locator("#policy").select_option("rest")
    expect(page.locator("#layer")).to_have_value("motion")
    expect(page).not_to_have_url(re.compile("policy|layer"))


def test_units_are_chosen_for_axes_readings_and_forms_and_requests_stay_in_si(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#omega=60..75&clearance=0.012..0.02&machine={HAMMER}")
    unfold(page, "All its numbers")
    page.locator("#unit-frequency").select_option("Hz")
    page.locator("#unit-length").select_option("mm")
    page.locator("#view-section > summary").click()
    expect(page).to_have_url(re.compile("units=Hz%2Cmm"))
    expect(page.locator("#point-form [data-names=horizontal]")).to_contain_text("(Hz)")
    page.locator("#point-form").get_by_label("forcing frequency f (Hz)").fill("10.5")
    page.locator("#point-form").get_by_label("clearance (mm)").fill("15")
    page.get_by_role("button", name="Show this point").click()
    expect(page.locator("#point-place")).to_contain_text("10.5 Hz")
    expect(page.locator("#point-place")).to_contain_text("15 mm")
    asked = tiny.posted("trajectories")[-1]
    assert asked["omega"] == pytest.approx(10.5 * 2 * np.pi)
    assert asked["clearance"]["right"] == pytest.approx(0.015)
    assert re.search(r"omega=60\.\.75&clearance=0\.012\.\.0\.02", page.url)
    page.reload()
    expect(page.locator("#point-place")).to_contain_text("15 mm")
    expect(page.locator("#modes li").first).to_contain_text("10.07 Hz", use_inner_text=False, timeout=30_000)


def test_units_are_no_choice_for_a_machine_without_any(tiny: Watched, url: str) -> None:
    page = tiny.page
    page.goto(f"{url}/#{ABOVE}&units=Hz,mm")
    unfold(page, "All its numbers")
    expect(page.locator("#machine [name=masses]")).to_be_visible()
    expect(page.locator("#units")).to_be_hidden()
    page.mouse.move(500, 300)
    soon(page, lambda: "ω = 0.2" in page.locator("#reading").inner_text())
    assert "Hz" not in page.locator("#reading").inner_text()


def test_motions_that_exist_side_by_side_are_told_at_one_press(tiny: Watched, url: str) -> None:
    page = tiny.page
    at = (0.272, 1.85)
    page.goto(f"{url}/#omega=0.27..0.28&clearance=1.8..1.9&at={at[0]},{at[1]}")
    page.get_by_role("button", name="Other motions here").click()
    expect(page.locator("#others li").first).to_be_visible(timeout=WAIT)
    entries = page.locator("#others li").all_inner_texts()
    body = tiny.posted("basin-fractions")[-1]
    answer = answered(url, "basin-fractions", body)
    labels = {attractor["label"] for attractor in answer["attractors"]}
    assert len(labels) > 1
    assert {entry.partition(":")[0] for entry in entries} == labels
    assert (body["axis"]["values"][0], body["clearance"]) == at
    # each of them is opened, with the orbit to which its start leads
    first = page.locator("#point-name").inner_text()
    shows = page.locator("#others").get_by_role("button")
    expect(shows).to_have_count(len(labels), timeout=WAIT)
    other = next(label for label in sorted(labels) if label != first)
    page.get_by_role("button", name=f"Show {other}").click()
    expect(page.locator("#point-name")).to_have_text(other, timeout=WAIT)
    expect(page.locator("#point-why")).to_contain_text("random starts")
    (start,) = {json.dumps(body["initial"]) for body in tiny.posted("periodic-orbits") if "initial" in body}
    assert json.loads(start) in tiny.posted("trajectories")[-2]["initial"]


def test_an_unresolved_point_says_why_and_may_be_watched_longer(tiny: Watched, url: str) -> None:
    page = tiny.page
    values = {"start": 0.274, "stop": 0.276, "points": 24}
    body = {
        "horizontal": {"vary": "omega", "values": values},
        "vertical": {"vary": "clearance", "values": {"start": 1.84, "stop": 1.85, "points": 24}},
        "max_periods": 400,
        "other_starts": 0,
    }
    umap = answered(url, "unfolding-maps", body)
    kinds = np.array(umap["kind"])
    row, column = np.argwhere(kinds == umap["kinds"].index("unresolved"))[0]
    at = f"{umap['omega'][column]},{umap['clearance'][row]}"
    page.goto(f"{url}/#omega=0.27..0.28&clearance=1.8..1.9&at={at}")
    expect(page.locator("#point-name")).to_have_text("unresolved", timeout=WAIT)
    page.locator("#unresolved > summary").click()
    expect(page.locator("#unresolved-why")).to_contain_text("400")
    expect(page.locator("#unresolved-words")).to_be_hidden()  # the service's own words, for those who ask
    page.locator("#ask-longer").click()
    title = page.locator("#point-name")
    expect(title).to_contain_text("4000", timeout=WAIT)
    # it has the answer, and what stands below is of as long a watch
    (longer,) = (asked for asked in tiny.posted("unfolding-maps") if asked["max_periods"] == 4000)
    verdict = answered(url, "unfolding-maps", longer)
    motion = verdict["motions"][verdict["motion"][0][0]]
    assert title.inner_text().startswith(motion["label"] or motion["kind"])
    assert tiny.posted("trajectories")[-1]["transient_periods"] == 4000
    expect(page.locator("#ask-longer")).to_be_hidden()
