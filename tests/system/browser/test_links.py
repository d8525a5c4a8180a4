"""Links to the page: each is complete, and what is wrong with one is said."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.explorer_page import FIRST, QUICK, show
from tests.support.page_modules import modules
from tests.support.watched_page import Watched
from tests.system.browser.conftest import watched_page

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

READ = """async (hash) => {
    const { UNSAID, read, write } = await import("/address.js");
    const { state, faults } = read(hash, { ...UNSAID, x: [0.25, 0.3125], y: [1.5, 2.25] });
    return { state, faults, hash: write(state) };
}"""
OTHER = "horizontal=omega&vertical=restitution&omega=0.25..0.3125"


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with modules(browser) as page:
        yield page


def machine(**fields: Any) -> str:
    return f"machine={quote(json.dumps(fields))}"


@pytest.mark.parametrize(
    ("link", "part", "allowed", "shown"),
    [
        ("omega=0.3..0.25", "omega", "smaller", "0.25..0.3125"),
        ("clearance=foo", "clearance", "numbers", "1.5..2.25"),
        ("clearance=-1..2", "clearance", "0", "1.5..2.25"),
        ("omega=..0.3", "omega", "numbers", "0.25..0.3125"),
        ("layer=colour", "layer", "exponent", "motion"),
        ("curves=some", "curves", "all", "grazing"),
        ("at=0.28,x", "at", "numbers", "no point"),
        ("at=0.28,-2", "at", "plane", "no point"),
        ("horizontal=masses[9]", "horizontal", "masses[3]", "omega"),
        (OTHER, "restitution and clearance", "interval", "frequency and clearance"),
        (f"{OTHER}&restitution=0.5..2&clearance=1.6", "restitution", "0 to 1", "0.5..1"),
        ("machine={", "machine", "JSON", "paper"),
        (machine(stops="both"), "stops", "right", "equal"),
        (machine(stops="unequal"), "left", "distance", "equal"),
        (machine(periods=-1), "periods", "> 0", "400"),
        (machine(oscillator=[1]), "oscillator", "fields", "null"),
        ("embed=slider,legend", "slider", "sliders", "the rest"),
    ],
)
def test_what_is_wrong_with_a_link_is_said_with_what_is_allowed_and_what_is_shown(
    page: Page, link: str, part: str, allowed: str, shown: str
) -> None:
    answer = page.evaluate(READ, f"#{link}")
    (fault,) = answer["faults"]
    what, _, rest = fault.partition("; allowed: ")
    may, _, instead = rest.partition(" Shown instead: ")
    assert part in what
    assert allowed in may
    assert shown in instead
    # what is shown is a state like any other: its own link has no fault
    again = page.evaluate(READ, answer["hash"])
    assert again["faults"] == []
    assert again["state"] == answer["state"]


@pytest.mark.parametrize(
    "link",
    [
        "",
        FIRST,
        f"{FIRST}&layer=exponent&curves=all&borders=explained&at=0.28,1.6",
        f"{OTHER}&restitution=0.5..1&clearance=1.6",
        f"{FIRST}&{machine(stops='unequal', left=0.5, periods=1000)}",
        f"clearance=0.001..0.02&omega=40..80&{machine(oscillator={'units': 'SI', 'masses': [0.5]}, stops='right')}",
    ],
)
def test_a_state_and_its_link_are_the_same(page: Page, link: str) -> None:
    answer = page.evaluate(READ, f"#{link}" if link else "")
    assert answer["faults"] == []
    again = page.evaluate(READ, answer["hash"])
    assert again["state"] == answer["state"]
    assert again["hash"] == answer["hash"]


def test_the_address_has_the_state_from_the_first_moment_and_no_entry_more(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(url)
    expect(page).to_have_url(re.compile(r"#omega=[\d.]+\.\.[\d.]+&clearance=[\d.]+\.\.[\d.]+"))
    entries = page.evaluate("history.length")
    assert entries == 2  # the blank page, and this one
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_text("Take home", exact=True).click()
    page.get_by_role("button", name="Copy link").click()
    expect(page.locator("#copied")).not_to_be_empty()
    assert page.evaluate("navigator.clipboard.readText()") == page.url


def test_a_fault_stands_until_the_next_move_and_the_address_says_what_is_shown(watched: Watched, url: str) -> None:
    page = watched.page
    says = page.locator("#says")
    page.goto(f"{url}/#{QUICK.replace('2..2.25', 'foo')}")
    expect(says).to_contain_text("“foo”")
    assert "foo" not in page.url
    page.wait_for_timeout(1000)
    expect(says).to_contain_text("“foo”")
    page.get_by_role("button", name="Zoom in").click()
    expect(says).not_to_contain_text("foo")


def test_a_fault_is_seen_on_a_phone(browser: Browser, url: str) -> None:
    for watched in watched_page(browser, url, 390, 844):
        watched.page.goto(f"{url}/#{QUICK}&layer=colour")
        says = watched.page.locator("#says")
        expect(says).to_contain_text("colour")
        expect(says).to_be_visible()


def test_a_machine_that_the_service_refuses_is_said_and_another_one_is_shown(watched: Watched, url: str) -> None:
    page = watched.page
    wrong = machine(oscillator={"masses": [1, -2], "stiffnesses": [1, 1], "damping": 0.1, "forcing": [1, 0]})
    page.goto(f"{url}/#{QUICK}&{wrong}")
    says = page.locator("#says")
    expect(says).to_contain_text("masses/1")
    expect(says).to_contain_text("0")
    assert "machine=" not in page.url
    expect(page.locator("#modes li")).to_have_count(3, timeout=60_000)  # of the paper's machine
    assert all(body.get("oscillator") is None for body in watched.posted("unfolding-maps"))


def test_parts_of_a_link_that_mean_nothing_are_said(page: Page) -> None:
    (fault,) = page.evaluate(READ, f"#{FIRST}&x=1&restitution=0.5..1")["faults"]
    assert "x, restitution" in fault


@pytest.mark.parametrize("fields", [{"masses": 2}, {"bias": 5}], ids=["masses", "bias"])
def test_a_machine_without_the_lists_of_one_is_said(watched: Watched, url: str, fields: dict[str, Any]) -> None:
    page = watched.page
    page.goto(f"{url}/#{QUICK}&{machine(oscillator=fields)}")
    expect(page.locator("#says")).to_contain_text(next(iter(fields)), timeout=60_000)
    expect(page.locator("#modes li")).to_have_count(3, timeout=60_000)  # of the paper's machine


def test_a_link_keeps_its_machine_where_the_service_fails(watched: Watched, url: str) -> None:
    page = watched.page
    failed = json.dumps({"title": "Internal Server Error", "status": 500})
    page.route("**/v1/structures", lambda route: route.fulfill(status=500, body=failed))
    page.goto(f"{url}/#{QUICK}&{machine(oscillator={'restitution': 0.7})}")
    expect(page.locator("#progress")).to_have_attribute("value", re.compile("[0-9]"), timeout=60_000)
    assert "0.7" in page.url
    expect(page.locator("#says")).not_to_contain_text("refuses")
    watched.complaints.clear()  # of the answers with 500


def test_trouble_before_the_first_window_is_said(watched: Watched, url: str) -> None:
    page = watched.page
    page.route("**/v1/**", lambda route: route.abort())
    page.goto(f"{url}/#{QUICK}&{machine(oscillator={'restitution': 0.7})}")
    page.mouse.move(600, 400)
    expect(page.locator("#says")).to_contain_text("does not answer")
    page.unroute_all()
    expect(page.locator("#progress")).to_have_attribute("value", re.compile("[0-9]"), timeout=60_000)
    assert all("net::ERR_FAILED" in text for text in watched.complaints)
    watched.complaints.clear()


def test_a_link_that_is_followed_replaces_a_machine_that_is_awaited(watched: Watched, url: str) -> None:
    page = show(watched, url, QUICK, wait=False)
    page.route("**/v1/grazing-curves", lambda _: None)
    page.locator("#preset").select_option("hammer")
    expect(page.locator("#says")).to_contain_text("Computing the grazing curve")
    page.unroute_all()
    page.evaluate(f"location.hash = '{FIRST}'")
    expect(page.locator("#says")).not_to_contain_text("Computing the grazing curve", timeout=60_000)
    page.wait_for_timeout(1000)
    assert "machine=" not in page.url


def test_home_is_the_first_window_of_a_machine_before_its_curve_is_there(watched: Watched, url: str) -> None:
    page = show(watched, url, QUICK, wait=False)
    page.locator("#preset").select_option("hammer")
    expect(page).to_have_url(re.compile("machine="), timeout=60_000)
    expect(page).to_have_url(re.compile("omega=40..80"))
    page.route("**/v1/grazing-curves", lambda _: None)
    page.reload()
    page.get_by_role("button", name="Zoom in").click()  # at once, it may mean nothing yet
    expect(page.locator("#progress")).to_have_attribute("value", re.compile("[0-9]"), timeout=60_000)
    page.get_by_role("button", name="Zoom in").click()
    expect(page).not_to_have_url(re.compile("omega=40..80"), timeout=60_000)
    page.get_by_role("button", name="First window").click()
    expect(page).to_have_url(re.compile("omega=40..80"))
    page.unroute_all(behavior="ignoreErrors")
