"""What a person sees of a point that was clicked: its own motion, where one can see it."""

from __future__ import annotations

import itertools
import json
import re
from urllib.parse import parse_qs, unquote, urlsplit

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests.support.explorer_page import (
    FIRST,
    QUICK,
    USUAL,
    WAIT,
    answered,
    is_free,
    place,
    show,
    soon,
    spot,
    trajectories_of_points,
    unfold,
    window,
)
from tests.support.watched_page import Watched
from tools.guide.pages import DOCS

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

FIRST_POINT = (0.27, 1.5)  # of 1-2r-2l
SECOND_POINT = (0.29, 1.75)  # of 1-1r-1l
FREE = "1-(-1)r-(-1)l"
SEVERAL = f"{FIRST}&at=0.29205,2.0029"  # where 3-1r-1l, from rest, and the motion without impacts exist
QUESTIONS = ("Follow the branch", "Bifurcation curves of this motion")


def open_point(page: Page, at: tuple[float, float], name: str) -> None:
    """Click a point, and wait for the name of its motion."""
    page.mouse.click(*place(page, *at))
    expect(page.locator("#point-name")).to_have_text(name, timeout=WAIT)


def test_a_new_point_shows_nothing_of_the_orbit_before(watched: Watched, url: str) -> None:
    """While the orbit of a point is awaited, there is none to ask about, and no figures of the last one."""
    page = show(watched, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    held: list[Route] = []
    page.route("**/v1/periodic-orbits", lambda route: held.append(route))
    open_point(page, SECOND_POINT, "1-1r-1l")
    for question in QUESTIONS:
        expect(page.get_by_role("button", name=question)).to_be_disabled()
    expect(page.locator("#multipliers svg")).to_have_count(0)
    for route in held:
        route.continue_()
    page.unroute_all()
    for question in QUESTIONS:
        expect(page.get_by_role("button", name=question)).to_be_enabled(timeout=WAIT)
    page.get_by_role("button", name="Bifurcation curves of this motion").click()
    expect(page.locator("#own-curves")).to_contain_text("of 1-1r-1l are drawn", timeout=WAIT)


# The boxes of what is shown of a point, and the parts of them that neither the window nor a scrolling box cuts off.
IN_SIGHT = """async (ids) => {
    await Promise.all(document.getAnimations().map((animation) => animation.finished));
    return ids.map((id) => {
        const element = document.getElementById(id);
        const { left, top, right, bottom } = element.getBoundingClientRect();
        let seen = [Math.max(left, 0), Math.max(top, 0), Math.min(right, innerWidth), Math.min(bottom, innerHeight)];
        for (let box = element.parentElement; box; box = box.parentElement) {
            if (getComputedStyle(box).overflowY === "visible") continue;
            const at = box.getBoundingClientRect();
            const [x, y] = [at.left + box.clientLeft, at.top + box.clientTop];
            seen = [Math.max(seen[0], x), Math.max(seen[1], y), Math.min(seen[2], x + box.clientWidth),
                Math.min(seen[3], y + box.clientHeight)];
        }
        return { id, whole: [left, top, right, bottom], seen };
    });
}"""
PARTS = ["point-name", "animation", "history", "portrait", "multipliers"]
AWAY = 0.5  # of a pixel, by which boxes are rounded


def assert_in_sight(page: Page) -> None:
    """Fail where a part of the open point is cut off, or is empty."""
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    for part in page.evaluate(IN_SIGHT, PARTS):
        assert np.allclose(part["seen"], part["whole"], atol=AWAY), part
        left, top, right, bottom = part["whole"]
        assert right - left > 30, part
        assert bottom - top > 15, part


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_an_opened_point_is_whole_in_sight(browser: Browser, url: str, width: int, height: int) -> None:
    """After a click, or a tap, where a section of the machine was read before; and from a link."""
    is_phone = width < height
    context = browser.new_context(viewport={"width": width, "height": height}, has_touch=is_phone)
    page = show(Watched(context.new_page()), url, USUAL, wait=False)
    unfold(page, "Machine", "All its numbers")
    page.get_by_role("button", name="Show this window").scroll_into_view_if_needed()
    at = place(page, *FIRST_POINT)
    opened = page.url.partition("#")[2]
    if is_phone:
        page.touchscreen.tap(*at)
    else:
        page.mouse.click(*at)
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    assert_in_sight(page)
    address = page.url
    assert "at=" in address
    assert address.partition("#")[2].partition("&at=")[0] == opened  # the window stays
    marked = spot(page, *(float(part) for part in parse_qs(urlsplit(address).fragment)["at"][0].split(",")))
    assert is_free(page, marked)  # the point itself is in sight, too
    page.goto("about:blank")
    page.goto(address)
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    assert_in_sight(page)
    assert is_free(
        page, spot(page, *(float(part) for part in parse_qs(urlsplit(address).fragment)["at"][0].split(",")))
    )
    context.close()


def test_a_point_is_closed(small: Watched, url: str) -> None:
    page = show(small, url, f"{USUAL}&at=0.27,1.5", wait=False)
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    page.get_by_role("button", name="Close the point").click()
    expect(page.locator("#point-section")).to_be_hidden()
    expect(page.locator("#plane")).to_be_focused()
    expect(page).not_to_have_url(re.compile("at="))
    page.go_back()
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)


def test_the_buttons_zoom_about_the_open_point(small: Watched, url: str) -> None:
    page = show(small, url, f"{USUAL}&at=0.27,1.5", wait=False)
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    before, first = spot(page, 0.27, 1.5), window(page)
    for name in ("Zoom in", "Zoom in", "Zoom out"):
        shown = window(page)
        page.get_by_role("button", name=name).click()
        soon(page, lambda shown=shown: window(page) != shown)  # type: ignore[misc]
        assert spot(page, 0.27, 1.5) == pytest.approx(before, abs=2)
    assert window(page) != first


def test_on_a_phone_a_closed_point_stays_marked_and_its_machine_opens_it_again(browser: Browser, url: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page = show(Watched(context.new_page()), url, f"{USUAL}&at=0.28,1.75", wait=False)
    expect(page.locator("#point-name")).to_have_text("1-1r-1l", timeout=WAIT)
    page.get_by_role("button", name="Close the point").tap()
    expect(page.locator("#living")).to_be_visible(timeout=WAIT)
    shown = window(page)
    page.get_by_role("button", name="Zoom in").tap()
    soon(page, lambda: window(page) != shown)
    page.locator("#living").tap(timeout=WAIT)
    expect(page).to_have_url(re.compile("at="), timeout=WAIT)
    at = [float(part) for part in parse_qs(urlsplit(page.url).fragment)["at"][0].split(",")]
    assert at == pytest.approx([0.28, 1.75], rel=2e-3)
    context.close()


def test_a_question_says_in_sight_that_it_is_computed(small: Watched, url: str) -> None:
    page = show(small, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    page.route("**/v1/basins", lambda route: None)  # an answer that does not come
    page.get_by_role("button", name="Basins").click()
    expect(page.get_by_text("Basins: computing")).to_be_in_viewport()
    page.unroute_all(behavior="ignoreErrors")


def test_a_point_is_entered_and_left_by_keys(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "View")
    form = page.locator("#point-form")
    across, up = form.get_by_label("forcing frequency"), form.get_by_label("clearance")
    for text, message in (
        ("1,7", "“1,7” is not a number; write 1.7"),
        ("-1", "-1 is out of range; allowed: numbers > 0"),
    ):
        across.fill("0.26")
        up.fill(text)
        up.press("Enter")
        assert up.evaluate("(field) => field.validationMessage").startswith(message)
    assert not trajectories_of_points(small)
    up.fill("1.7")
    up.press("Enter")
    expect(page.locator("#point-name")).to_have_text("1-1r-1l", timeout=WAIT)
    expect(page.locator("#point-place")).to_have_text(re.compile("^ω = 0.26, clearance 1.7(;|$)"))
    assert window(page) == ([0.25, 0.28125], [1.575, 1.825])  # the window follows
    expect(page.locator("#point-name")).to_be_focused()  # and the menu is closed
    expect(form).to_be_hidden()
    page.keyboard.press("Escape")
    expect(page.locator("#plane")).to_be_focused()


def test_axes_of_small_machines_have_powers_of_ten(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "Machine")
    page.get_by_label("Begin with").select_option("rotor")
    expect(page).to_have_url(re.compile("machine="))
    unfold(page, "View")
    form = page.locator("#point-form")
    form.get_by_label("forcing frequency ω (rad/s)").fill("150")
    form.get_by_label("clearance (m)").fill("0.0004")
    form.get_by_label("clearance (m)").press("Enter")
    expect(page.locator("#portrait svg")).to_contain_text("displacement (10⁻⁴ m)", timeout=WAIT)
    page.get_by_role("button", name="Basins").click()
    basins = page.locator("#basins svg")
    expect(basins).to_contain_text("displacement of mass 1 (10⁻⁴ m)", timeout=WAIT)
    expect(basins).to_contain_text("velocity of mass 1 (m/s)")


def test_a_chaotic_point_is_called_so(small: Watched, url: str) -> None:
    """Trajectories have no exponents, which tell chaos: a map of the point has."""
    page = show(small, url, f"{FIRST}&at=0.30926,2.0627", wait=False)
    expect(page.locator("#point-name")).to_have_text("chaotic", timeout=WAIT)
    expect(page.locator("#point-why")).to_contain_text("Lyapunov exponent 0.")


def test_rebounds_are_drawn_on_the_stops(small: Watched, url: str) -> None:
    page = show(small, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#portrait .stop")).to_have_count(2)
    stops = [page.locator("#portrait .stop").nth(k).get_attribute("x1") for k in range(2)]
    path = page.locator("#portrait path.motion").get_attribute("d") or ""
    points = [point.split() for point in re.split("[ML]", path)[1:]]
    rebounds = [
        (point, other)
        for point, other in itertools.pairwise(points)
        if point[0] == other[0] and point[0] in stops and point[1] != other[1]
    ]
    assert len(rebounds) >= 40  # of four in each of twelve periods


def test_the_form_of_a_point_keeps_no_number_of_another_plane(small: Watched, url: str) -> None:
    page = show(small, url, f"{USUAL}&at=0.27,1.5", wait=False)
    up = page.locator("#point-form input").nth(1)
    expect(up).to_have_value("1.5")
    unfold(page, "View")
    page.locator("#up").select_option("restitution")
    expect(up).to_have_value("")
    up.fill("1")
    page.locator("#point-form input").nth(0).fill("0.27")
    up.press("Enter")  # a restitution may be 1
    expect(page.locator("#point-place")).to_contain_text("restitution 1", timeout=WAIT)


def test_the_motion_that_just_touches_is_shown_on_the_grazing_curve(small: Watched, url: str) -> None:
    curve = answered(url, "grazing-curves", {"omega": [0.265, 0.27]})
    page = show(small, url, f"{USUAL}&at={curve['omega'][0]},{curve['clearance'][0]}", wait=False)
    button = page.get_by_role("button", name="Show the motion that just touches")
    expect(button).to_be_visible(timeout=WAIT)
    name = page.locator("#point-name")
    expect(page.locator("#point-figures dt").first).to_be_visible(timeout=WAIT)
    from_rest = name.inner_text()
    assert from_rest != FREE
    button.click()
    expect(name).to_have_text(FREE, timeout=WAIT)
    expect(page.locator("#point-why")).to_contain_text("speed zero")
    expect(page.locator("#point-figures dd")).to_have_count(1, timeout=WAIT)  # those of an orbit with impacts are gone
    expect(page.locator("#multipliers svg")).to_have_count(0)
    assert page.locator("#history .impact").count() == 0
    # the amplitude is the clearance: the motion fills the chart from stop to stop
    bars, path = page.locator("#history .stop"), page.locator("#history path.motion")
    ends = sorted(bar["y"] for bar in (bars.nth(k).bounding_box() for k in range(2)) if bar)
    box = path.bounding_box()
    assert box is not None
    assert [box["y"], box["y"] + box["height"]] == pytest.approx(ends, abs=6.0)
    # it plays in place of the motion before, and stops
    canvas = page.locator("#animation")
    pixels = "canvas => canvas.toDataURL()"
    page.get_by_role("button", name="Pause").click()
    still = canvas.evaluate(pixels)
    page.wait_for_timeout(300)
    assert canvas.evaluate(pixels) == still
    # and there is a way back
    page.get_by_role("button", name="from rest").click()
    expect(name).to_have_text(from_rest, timeout=WAIT)
    expect(button).to_be_visible()
    page.mouse.click(*place(page, 0.28, 1.7))
    expect(page.locator("#point-name")).to_have_text("1-1r-1l", timeout=WAIT)
    expect(button).to_be_hidden()


def test_nothing_of_a_motion_stands_below_the_title_of_another_that_is_computed(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#point-figures dt").first).to_be_visible(timeout=WAIT)
    held: list[Route] = []
    page.route("**/v1/trajectories", lambda route: held.append(route))  # the orbit's own answer comes
    with page.expect_response("**/v1/periodic-orbits"):
        page.mouse.click(*place(page, *SECOND_POINT))
    page.wait_for_timeout(300)
    expect(page.locator("#point-figures dt")).to_have_count(0)
    for part in ("#stage", "#history", "#portrait", "#multipliers svg"):
        assert page.locator(part).count() == 0 or page.locator(part).is_hidden()
    asked = page.locator("#point-section button[id^=ask]:visible")
    assert asked.count() >= 4
    assert all(button.is_disabled() for button in asked.all())
    for route in held:
        route.continue_()
    page.unroute_all()
    expect(page.locator("#point-name")).to_have_text("1-1r-1l", timeout=WAIT)
    expect(page.locator("#stage")).to_be_visible()
    expect(page.locator("#ask-others")).to_be_enabled()


def test_a_question_that_cannot_be_asked_says_why(small: Watched, url: str) -> None:
    page = show(small, url, f"{USUAL}&at=0.27,1.95", wait=False)
    expect(page.locator("#point-figures dt").first).to_be_visible(timeout=WAIT)
    for question in QUESTIONS:
        button = page.get_by_role("button", name=question)
        expect(button).to_be_disabled()
        expect(button).to_have_accessible_description(re.compile("periodic orbit"))
    expect(page.locator("#ask-needs")).to_be_visible()
    page.mouse.click(*place(page, *FIRST_POINT))
    expect(page.get_by_role("button", name=QUESTIONS[0])).to_be_enabled(timeout=WAIT)
    expect(page.locator("#ask-needs")).to_be_hidden()


def test_one_goes_from_motion_to_motion_in_their_list_and_in_the_basins(watched: Watched, url: str) -> None:
    page = show(watched, url, SEVERAL, wait=False)
    name = page.locator("#point-name")
    expect(name).to_have_text("3-1r-1l", timeout=WAIT)
    page.get_by_role("button", name="Other motions").click()
    buttons = {label: page.get_by_role("button", name=f"Show {label}") for label in ("3-1r-1l", FREE)}
    for label in (FREE, "3-1r-1l", FREE):
        buttons[label].click(timeout=WAIT)
        expect(name).to_have_text(label, timeout=WAIT)
        for other, button in buttons.items():
            expect(button).to_have_attribute("aria-pressed", str(other == label).lower())
        expect(page.locator("#animation")).to_be_in_viewport()  # what was asked for
    page.get_by_role("button", name="from rest").click()
    expect(name).to_have_text("3-1r-1l", timeout=WAIT)
    assert "initial" not in watched.posted("periodic-orbits")[-1]
    page.get_by_role("button", name="Basins").click()
    picture = page.locator("#basins image")
    expect(picture).to_be_visible(timeout=WAIT)
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.7 * box["width"], box["y"] + 0.2 * box["height"])
    expect(page.locator("#point-why")).to_contain_text("displacement", timeout=WAIT)
    pressed = watched.posted("basins")[-1]
    (start,) = {json.dumps(body["initial"]) for body in watched.posted("periodic-orbits")[-1:]}
    for quantity, along, share in (("displacement", "horizontal", 0.7), ("velocity", "vertical", 0.8)):
        first, *others = json.loads(start)[quantity]
        values = pressed[along]["values"]
        step = (values["stop"] - values["start"]) / (values["points"] - 1)
        assert first == pytest.approx(values["start"] + share * values["points"] * step, abs=1.5 * step)
        assert others == pytest.approx([0, 0], abs=1e-12)
    said = page.locator("#basins [role=status]")
    label = said.inner_text().rpartition(": ")[2]
    expect(name).to_have_text(label, timeout=WAIT)
    expect(picture).to_be_attached()
    assert {label for label, button in buttons.items() if button.get_attribute("aria-pressed") == "true"} == {label}
    # and by keys
    page.locator("#basins svg").focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowUp")
    elsewhere = said.inner_text()
    page.keyboard.press("Enter")
    place_, _, label = elsewhere.rpartition(": ")
    expect(page.locator("#point-why")).to_contain_text(place_, timeout=WAIT)
    expect(name).to_have_text(label)


def test_an_answer_is_in_sight_below_its_question(browser: Browser, url: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page = show(Watched(context.new_page()), url, f"{USUAL}&at=0.27,1.5", wait=False)
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    for question, answer in (("others", "li"), ("branch", "svg"), ("basins", "svg")):
        button = page.locator(f"#ask-{question}")
        button.tap()
        first = page.locator(f"#{question} {answer}").first
        expect(first).to_be_visible(timeout=WAIT)
        expect(button).to_be_in_viewport(ratio=1)
        expect(first).to_be_in_viewport()
    # a thumb meets one button at a time
    boxes = [box for box in (page.locator(name).bounding_box() for name in ("#play", "#sound")) if box]
    assert min(min(box["width"], box["height"]) for box in boxes) >= 40
    assert boxes[1]["x"] - (boxes[0]["x"] + boxes[0]["width"]) >= 8
    context.close()


def test_words_of_the_field_lead_to_the_glossary(small: Watched, url: str) -> None:
    page = show(small, url, f"{FIRST}&at=0.30926,2.0627", wait=False)  # chaotic
    expect(page.locator("#point-why a")).to_be_visible(timeout=WAIT)
    links = page.locator("#point-section a.term").evaluate_all("(links) => links.map(({ href }) => href)")
    page.goto(f"{url}/#{USUAL}&at=0.27,1.5")
    expect(page.locator("#multipliers a")).to_be_visible(timeout=WAIT)
    page.locator("#ask-branch").click()
    expect(page.locator("#branch a")).to_be_visible(timeout=WAIT)
    # its points are read by arrow keys and with the pointer
    chart, spoken = page.locator("#branch svg"), page.locator("#branch [role=status]")
    chart.press("ArrowRight")
    expect(spoken).to_have_text(re.compile(r"^clearance [\d.]+: impact speed [\d.]+, (un)?stable|not admissible$"))
    by_key = spoken.inner_text()
    chart.hover()
    expect(spoken).not_to_have_text(by_key)
    links += page.locator("#point-section a.term").evaluate_all("(links) => links.map(({ href }) => href)")
    assert len(set(links)) >= 9
    sections = re.split("^## ", (DOCS / "glossary.md").read_text(), flags=re.MULTILINE)
    for link in set(links):
        parts = urlsplit(link)
        assert parts.path == "/guide/glossary.html"
        heading, _, word = parts.fragment.partition(":~:text=")
        (section,) = (text for text in sections if text.startswith(heading.replace("-", " ").capitalize()))
        row = re.escape(unquote(word)).replace(",", r"(\]\([^)]*\))?,")
        assert re.search(rf"^\| \[?{row}", section, re.MULTILINE), link


def test_a_motion_that_settles_late_has_its_orbit(small: Watched, url: str) -> None:
    """What the map calls verified has an orbit here, too: the map solves for a motion before it has settled."""
    at = (0.25958, 1.7822)
    request = {"omega": at[0], "clearance": at[1], "transient_periods": 400}
    assert not answered(url, "periodic-orbits", request)["converged"]
    page = show(small, url, f"{USUAL}&at={at[0]},{at[1]}", wait=False)
    expect(page.locator("#point-name")).to_have_text("1-1r-1l", timeout=WAIT)
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    expect(page.locator("#point-place")).to_contain_text("; verified")
    expect(page.get_by_role("button", name="Follow the branch")).to_be_enabled()


def test_of_a_chaotic_point_no_orbit_is_missed(small: Watched, url: str) -> None:
    page = show(small, url, f"{FIRST}&at=0.30926,2.0627", wait=False)
    expect(page.locator("#point-name")).to_have_text("chaotic", timeout=WAIT)
    expect(page.locator("#point-figures dd").first).to_contain_text("chaotic", timeout=WAIT)
    expect(page.locator("#point-figures dd")).to_have_count(1)
