"""The explorer in a real browser, without internet, over a whole stack."""

from __future__ import annotations

import ast
import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect

import grazemap_service
from grazemap import Client
from grazemap.plots import palette
from tests.support.explorer_page import (
    ALSO_HARD,
    FIRST,
    HARD,
    PROGRESS,
    QUICK,
    USUAL,
    WAIT,
    answered,
    ended,
    holds,
    maps,
    paler,
    picture,
    place,
    ranges,
    show,
    soon,
    spot,
    unfold,
    verified,
    window,
)
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

STATIC = Path(grazemap_service.__file__).parent / "static"

MOST_BYTES = 120_000
LONG = 'machine={"periods":12000}'  # so that a tile takes a while


def test_the_page_is_small(url: str) -> None:
    files = [file.relative_to(STATIC) for file in (STATIC / "icon.svg", *(STATIC / "explorer").iterdir())]
    paths = ["", "static/palette.json", *(f"static/{file}" for file in files)]
    sent = [httpx2.get(f"{url}/{path}", headers={"Accept-Encoding": "gzip"}) for path in paths]
    assert all(answer.status_code == 200 for answer in sent)
    assert sum(answer.num_bytes_downloaded for answer in sent) < MOST_BYTES


@pytest.mark.parametrize("module", sorted((STATIC / "explorer").glob("*.js")), ids=lambda module: module.stem)
def test_a_module_is_sent_without_its_comments_and_with_all_else(url: str, module: Path) -> None:
    whole = module.read_text().splitlines()
    sent = httpx2.get(f"{url}/static/explorer/{module.name}").text.splitlines()
    assert len(sent) == len(whole)  # so that what browsers report is found in the file
    for number, (line, text) in enumerate(zip(sent, whole, strict=True)):
        if line == text:
            continue
        assert line == ""
        assert text.lstrip().startswith(("//", "/**"))
        assert "\n".join(whole[:number]).count("`") % 2 == 0  # in no text of the program


def test_the_first_window_comes_as_previews_then_verified_in_the_colours_of_pictures(
    watched: Watched, url: str
) -> None:
    page = watched.page
    page.goto(f"{url}/")
    expect(page.locator("#legend")).to_contain_text("1-1r-1l", timeout=WAIT)  # of a preview
    verified(page)
    requests = watched.posted("unfolding-maps")
    previews, tiles = ([body for body in requests if body.get("preview", False) is kind] for kind in (True, False))
    assert requests.index(previews[0]) == 0
    distinct = {json.dumps(tile) for tile in tiles}
    assert len(distinct) == 12
    for tile in tiles:  # tiles of the dyadic lattice
        for along, size in zip(ranges(tile), (2.0**-6, 2.0**-2), strict=True):
            start, stop, points = (along[name] for name in ("start", "stop", "points"))
            assert points == 128
            assert (start - size / 256) % size == 0
            assert stop - start == size * 127 / 128
    plane = picture(page)[50:-50, 100:-50].reshape(-1, 3)  # without the strips of the axes
    colours, counts = np.unique(plane, axis=0, return_counts=True)
    seen = ["#{:02X}{:02X}{:02X}".format(*colour) for colour in colours[np.argsort(-counts)]]
    assert seen[0] == palette.NAMED["1-(-1)r-(-1)l"]
    assert {palette.NAMED["1-1r-1l"], palette.NAMED["1-2r-2l"]} <= set(seen[:8])


def over(first: tuple[float, float], points: int = 48) -> dict[str, float]:
    """Return an interval as a range of the API."""
    return {"start": first[0], "stop": first[1], "points": points}


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        ({"omega": over((0.36, 0.40)), "clearance": {"right": over((0.6, 0.9)), "left": None}}, "machine=.*right"),
        (
            {
                "horizontal": {"vary": "omega", "values": over((0.28, 0.30))},
                "vertical": {"vary": "restitution", "values": over((0.5, 0.9))},
                "clearance": {"right": 1.6, "left": None},
                "policy": "sweep-up",
            },
            "restitution=.*policy=sweep-up.*machine=.*right",
        ),
    ],
    ids=["clearance", "restitution"],
)
def test_an_address_opens_a_map_that_another_client_has_computed(
    watched: Watched, url: str, request_: dict[str, object], says: str
) -> None:
    with Client(url) as client:
        job = client.submit("unfolding-maps", request_ | {"max_periods": 300})
        umap = job.wait(120).result()
    page = watched.page
    page.route("**/v1/unfolding-maps", lambda _: None)  # no tile of the page comes
    if says.startswith("machine"):  # an explorer that is open follows a new address, too
        show(watched, url, QUICK, wait=False)
    page.goto(f"{url}/#map={job.id}")
    expect(page.locator("#legend")).to_contain_text(umap.motions()[0].label, timeout=WAIT)
    row, column = 30, 12
    page.mouse.move(*place(page, umap.horizontal[column], umap.vertical[row]))
    expect(page.locator("#reading")).to_contain_text(f": {umap.labels()[row, column]}")
    expect(page).to_have_url(re.compile(says))
    expect(page).not_to_have_url(re.compile("map="))


def test_an_address_of_a_job_that_is_no_such_map_says_so(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/#map={'0' * 64}")
    expect(page.locator("#says")).to_contain_text("job", timeout=WAIT)
    verified(page)
    tiles = {json.dumps(body) for body in watched.posted("unfolding-maps") if not body.get("preview")}
    assert len(tiles) == 12


def test_pointing_says_what_the_api_says(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL)
    request = next(
        body for body in watched.posted("unfolding-maps") if "preview" not in body and holds(body, 0.27, 1.6)
    )
    umap = answered(url, "unfolding-maps", request)
    row, column = 40, 70
    page.mouse.move(*place(page, umap["omega"][column], umap["clearance"][row]))
    label = umap["motions"][umap["motion"][row][column]]["label"]
    expect(page.locator("#reading")).to_contain_text(f": {label}; ")
    kinds = np.array(umap["kind"])
    unresolved = np.argwhere(kinds == umap["kinds"].index("unresolved"))
    row, column = unresolved[0]
    page.mouse.move(*place(page, umap["omega"][column], umap["clearance"][row]))
    reason, _, _ = umap["reasons"][umap["reason"][row][column]].partition(". Remedy:")
    expect(page.locator("#reading")).to_contain_text(f"unresolved; {reason}")


def test_curves_and_points_explain_themselves(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL)
    curve = answered(url, "grazing-curves", {"omega": {"start": 0.25, "stop": 0.3125, "points": 33}})
    page.mouse.move(*place(page, curve["omega"][12], curve["clearance"][12]))
    expect(page.locator("#reading")).to_contain_text("Grazing curve")
    order = next(point for point in curve["points"] if point["kind"] == "recurrence" and point["omega"] > 0.26)
    page.mouse.move(*place(page, order["omega"], order["clearance"]))
    expect(page.locator("#reading")).to_contain_text(f"Recurrence point of order {order['order']}")
    unfold(page, "View")
    page.get_by_label("bifurcation curves").check()
    expect(page).to_have_url(re.compile("curves=all"))
    page.get_by_label("bifurcation curves").uncheck()
    page.mouse.move(*place(page, curve["omega"][12], curve["clearance"][12]))
    expect(page.locator("#reading")).to_contain_text("Grazing curve")  # it stays


def test_the_grazing_curve_is_there_again_after_the_number_of_periods_has_changed(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL, wait=False)
    curve = answered(url, "grazing-curves", {"omega": {"start": 0.25, "stop": 0.3125, "points": 33}})
    on_curve = place(page, curve["omega"][12], curve["clearance"][12])
    page.mouse.move(*on_curve)
    expect(page.locator("#reading")).to_contain_text("Grazing curve", timeout=WAIT)
    unfold(page, "Machine", "All its numbers")
    page.get_by_label("Forcing periods watched").select_option("1000")
    page.get_by_role("button", name="Show this machine").click()
    expect(page).to_have_url(re.compile("machine="))
    page.mouse.move(*on_curve)
    expect(page.locator("#reading")).to_contain_text("Grazing curve", timeout=WAIT)


def test_marks_that_cover_one_another_say_so(small: Watched, url: str) -> None:
    page = show(small, url, "omega=0.25..1.25&clearance=1..9", wait=False)
    with Client(url) as client:
        curve = client.grazing_curve(omega=(0.25, 1.25), points=33)
    points = [(point.omega, point.clearance) for point in curve.points if 2 < point.clearance < 8]
    places = [spot(page, *point) for point in points]
    covered = next(k for k, at in enumerate(places) if any(math.dist(at, other) < 4 for other in places[:k]))
    page.mouse.move(*place(page, *points[covered]))
    expect(page.locator("#reading")).to_contain_text("more here: zoom in", timeout=WAIT)


def most_frequent(page: Page) -> Any:
    """Return the colour of most points of the plane, without the strips of the axes."""
    colours, counts = np.unique(picture(page)[50:-50, 100:-50].reshape(-1, 3), axis=0, return_counts=True)
    return colours[np.argmax(counts)].astype(float)


def test_previews_are_paler_and_leave_motions_open(small: Watched, url: str) -> None:
    held: list[Route] = []

    def answer(route: Route) -> None:
        """Let previews come; the tiles are held."""
        if route.request.post_data_json.get("preview"):
            route.continue_()
        else:
            held.append(route)

    small.page.set_viewport_size({"width": 500, "height": 300})  # has few tiles
    small.page.route("**/v1/unfolding-maps", answer)
    page = show(small, url, "omega=0.28125..0.296875&clearance=1.125..1.25", wait=False)
    expect(page.locator("#legend")).to_contain_text("not decided yet", timeout=WAIT)
    soon(page, lambda: held)  # all previews have come
    expect(page.locator("#legend")).not_to_contain_text("unresolved")
    largest = page.locator("#legend button[value] .swatch").first.evaluate(
        "(square) => square.style.backgroundColor.match(/\\d+/g).map(Number)"
    )
    assert most_frequent(page) == pytest.approx(paler(largest), abs=2)
    page.route("**/v1/unfolding-maps", lambda route: route.continue_())
    for route in held:
        route.continue_()
    verified(page)
    expect(page.locator("#legend")).not_to_contain_text("not decided yet")
    assert most_frequent(page) == pytest.approx(largest, abs=2)


def test_legend_and_layers_ask_nothing(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL)
    page.wait_for_timeout(500)
    before = len(watched.requests)
    first = page.locator("#legend button[aria-pressed]").first
    before_it = picture(page)
    first.click()
    expect(first).to_have_attribute("aria-pressed", "false")
    soon(page, lambda: not np.array_equal(picture(page), before_it))
    expect(first).to_be_focused()
    page.keyboard.press("Enter")
    expect(first).to_have_attribute("aria-pressed", "true")
    soon(page, lambda: np.array_equal(picture(page), before_it))
    for layer, text in (
        ("exponent", "Lyapunov exponent per forcing period: "),
        ("speed", "Minimum impact speed: 0 to "),
    ):
        page.get_by_label("Colour").select_option(layer)
        expect(page.locator("#ramp-text")).to_contain_text(text)
        expect(page).to_have_url(re.compile(f"layer={layer}"))
    assert [request.url for request in watched.requests[before:] if "/v1/" in request.url] == []


def test_panning_back_computes_nothing_and_history_goes_back(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    first = window(page)
    page.locator("#plane").focus()
    for _ in range(8):
        page.keyboard.press("ArrowRight")
    moved = [[0.28125, 0.3125], first[1]]
    soon(page, lambda: np.allclose(window(page), moved, rtol=1e-12))
    verified(page)
    count = len(maps(url))
    for _ in range(8):
        page.keyboard.press("ArrowLeft")
    soon(page, lambda: window(page) == first)  # without the digits of round-off
    verified(page)
    assert len(maps(url)) == count
    # windows at which the keys paused are places of the history too
    for there, go in ((moved, page.go_back), (first, page.go_forward)):
        for _ in range(8):
            go()
            page.wait_for_timeout(50)  # until the address of the page is known here, too
            if np.allclose(window(page), there, rtol=1e-12):
                break
        soon(page, lambda there=there: np.allclose(window(page), there, rtol=1e-12))


def test_tiles_left_behind_are_given_up_unless_another_client_waits(small: Watched, url: str) -> None:
    page = show(small, url, f"{HARD}&{LONG}", wait=False)
    running: list[dict[str, Any]] = []
    while len(running) < 2:
        page.wait_for_timeout(200)
        tiles = [job for job in maps(url) if "preview" not in job["request"]]
        running = [job for job in tiles if job["status"] == "running"]
    kept = running[0]["id"]
    others = [job["id"] for job in tiles if job["status"] in {"accepted", "running"} and job["id"] != kept]
    httpx2.post(f"{url}/v1/unfolding-maps", json=running[0]["request"], headers={"Grazemap-Client": "another"})
    page.evaluate(f"location.hash = '{QUICK}'")
    verified(page)
    ends = {ended(url, job_id) for job_id in others}
    assert "dismissed" in ends
    assert ends <= {"dismissed", "successful"}  # a tile may end before the page leaves it
    assert httpx2.get(f"{url}/v1/jobs/{kept}").json()["status"] != "dismissed"
    httpx2.delete(f"{url}/v1/jobs/{kept}?for=all")


def test_a_page_waits_for_a_service_that_is_away(small: Watched, url: str) -> None:
    page = show(small, url, "omega=0.25..0.28125&clearance=3..3.25")
    page.route("**/v1/**", lambda route: route.abort())
    page.get_by_label("Zoom out").click()
    expect(page.locator("#says")).to_contain_text("The service does not answer; trying again.")
    page.unroute_all()
    verified(page)
    assert small.complaints
    assert all("net::ERR_FAILED" in text for text in small.complaints)
    small.complaints.clear()


def test_the_window_is_zoomed_by_wheel_box_and_keys(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    across, up = place(page, 0.26, 2.1)
    page.mouse.move(across, up)
    page.mouse.wheel(0, -600)
    expect(page).not_to_have_url(re.compile(re.escape(QUICK)))
    assert np.allclose(place(page, 0.26, 2.1), (across, up), atol=2)  # the wheel knows whole pixels
    page.keyboard.down("Shift")
    page.mouse.move(*place(page, 0.259, 2.09))
    page.mouse.down()
    page.mouse.move(*place(page, 0.261, 2.11))
    before = page.url
    page.mouse.up()
    page.keyboard.up("Shift")
    expect(page).not_to_have_url(before)
    assert np.allclose(window(page), ([0.259, 0.261], [2.09, 2.11]), rtol=1e-3)
    page.locator("#plane").focus()
    before = page.url
    page.keyboard.press("-")
    expect(page).not_to_have_url(before)
    assert np.ptp(window(page)[0]) == pytest.approx(1.5 * 0.002, rel=0.02)
    page.keyboard.press("Home")
    expect(page).to_have_url(re.compile(re.escape(FIRST)))
    page.keyboard.press("Enter")
    expect(page.locator("#point-name")).to_be_focused()


def test_the_first_window_refines_at_its_codimension_two_point(small: Watched, url: str) -> None:
    asked = {"omega": {"start": 0.28, "stop": 0.285, "points": 3}}
    points = answered(url, "grazing-curves", asked)["points"]
    (recurrence,) = (point for point in points if point["kind"] == "recurrence" and point["order"] == 2)
    at = recurrence["omega"], recurrence["clearance"]
    page = show(small, url, FIRST)
    for _ in range(3):
        before = page.url
        page.mouse.move(*place(page, *at))
        page.mouse.wheel(0, -math.log(4.0) / 0.0015)
        expect(page).not_to_have_url(before)
    (left, right), (low, high) = window(page)
    assert left < at[0] < right
    assert low < at[1] < high
    assert (right - left, high - low) == pytest.approx((0.0625 / 64, 0.75 / 64), rel=0.01)
    verified(page)
    tiles = [body for body in small.posted("unfolding-maps") if "preview" not in body]
    steps = [
        (across["stop"] - across["start"]) / (across["points"] - 1) for across, _ in (ranges(tile) for tile in tiles)
    ]
    assert min(steps) <= max(steps) / 64
    page.mouse.move(*place(page, *at))
    expect(page.locator("#reading")).to_contain_text("Recurrence point of order 2")
    assert page.locator("#legend button[aria-pressed]").count() >= 3  # the families of motions that meet there


def test_two_fingers_zoom_and_one_moves(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    session = page.context.new_cdp_session(page)
    across, up = place(page, 0.265, 2.12)

    def touch(kind: str, *offsets: float) -> None:
        points = [{"x": across + offset, "y": up, "id": k} for k, offset in enumerate(offsets)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", -40, 40)
    touch("touchMove", -60, 60)
    touch("touchMove", -80, 80)
    touch("touchEnd")
    expect(page).not_to_have_url(re.compile(re.escape(QUICK)))
    (left, right), _ = window(page)
    assert right - left == pytest.approx(0.03125 / 2, rel=0.02)
    assert (0.265 - left) / (right - left) == pytest.approx((0.265 - 0.25) / 0.03125, abs=0.03)
    touch("touchStart", 0)
    touch("touchMove", 10)
    touch("touchMove", 40)
    touch("touchEnd")
    box = page.locator("#plane").bounding_box()
    assert box is not None
    soon(page, lambda: abs(spot(page, left, 2.1)[0] - (box["x"] + 40)) < 11)


def test_the_end_of_double_precision_is_announced(small: Watched, url: str) -> None:
    width = 2.0**-42
    page = show(small, url, f"omega=0.25..{0.25 + width!r}&clearance=2.125..{2.125 + 2.0**-36!r}")
    expect(page.locator("#says")).to_contain_text("Double precision ends here")
    posted = small.posted("unfolding-maps")
    assert posted
    for body in posted:
        for along in ranges(body):
            start, stop, points = (along[name] for name in ("start", "stop", "points"))
            values = start + np.arange(points) * ((stop - start) / (points - 1))
            assert np.diff(values).min() >= 64 * np.spacing(values).max() * (1 - 1e-9)
    address = page.url
    page.get_by_label("Zoom in").click()
    page.wait_for_timeout(500)
    assert page.url == address


def test_a_click_shows_the_motion_its_basins_and_its_branch(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL, wait=False)
    page.mouse.click(*place(page, 0.27, 1.5))
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    omega, clearance = (float(value) for value in re.search(r"at=([\d.]+)%2C([\d.]+)", page.url).groups())  # type: ignore[union-attr]
    orbit = answered(
        url, "periodic-orbits", {"omega": omega, "clearance": clearance, "observables": ["dissipated_power"]}
    )
    figures = dict(
        zip(*(page.locator(f"#point-figures {name}").all_inner_texts() for name in ("dt", "dd")), strict=True)
    )
    assert figures["verified"] == "yes"
    assert float(figures["dissipated power"]) == pytest.approx(orbit["dissipated_power"], rel=1e-3)
    slowest = min(abs(velocity) for velocity in orbit["velocities"])
    assert float(figures["minimum impact speed"]) == pytest.approx(slowest, rel=1e-3)
    real, imaginary = orbit["multipliers"][0]
    largest = abs(complex(real, imaginary)) if imaginary else real  # with its sign
    assert float(figures["largest multiplier"].partition(",")[0]) == pytest.approx(largest, rel=1e-3)
    for name in ("portrait", "history"):
        expect(page.locator(f"#{name} svg")).to_be_visible()
    assert page.locator("#history .impact").count() >= 8
    assert page.locator("#multipliers .inside").count() == 6
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.get_by_role("button", name="Basins").click()
    expect(page.locator("#basins")).to_contain_text("1-2r-2l: 100.0 %", timeout=WAIT)
    page.get_by_role("button", name="Follow the branch").click()
    expect(page.locator("#branch")).to_contain_text("GR at clearance", timeout=WAIT)
    page.get_by_role("button", name="Bifurcation curves of this motion").click()
    expect(page.locator("#own-curves")).to_contain_text("of 1-2r-2l are drawn into the plane", timeout=WAIT)
    address = page.url
    page.reload()
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    assert page.url == address


def test_the_form_shows_errors_beside_fields_and_natural_frequencies(watched: Watched, url: str) -> None:
    page = show(watched, url, QUICK)
    unfold(page, "Machine", "All its numbers")
    expect(page.locator("#modes")).to_contain_text("0.4189, damping ratio 0.02095")
    expect(page.get_by_role("img", name="3 masses: mass 1 between two stops.")).to_be_visible()
    form = page.locator("#machine")
    low, high = page.get_by_label("Frequency from"), page.locator("#overview").get_by_label("to")
    high.fill("0.3")
    for text, message in (
        ("abc", "“abc” is not a number"),
        ("-5", "-5 is out of range; allowed: numbers > 0"),
        ("0.5", ""),
    ):
        low.fill(text)
        page.get_by_role("button", name="Show this window").click()
        assert low.evaluate("(field) => field.validationMessage").startswith(message)
    expect(page.locator("#overview-says")).to_contain_text("below the second")
    restitution, masses = form.get_by_label("Restitution"), form.get_by_label("Masses, from")
    restitution.fill("2")
    expect(page.locator("#error-restitution")).to_contain_text("less than or equal to 1")
    expect(restitution).to_have_attribute("aria-invalid", "true")
    restitution.fill("0.8")
    expect(page.locator("#error-restitution")).to_be_empty()
    restitution.fill("0,8")
    expect(page.locator("#error-restitution")).to_contain_text("“0,8” is not a number; write 0.8")
    restitution.fill("")
    expect(page.locator("#error-restitution")).to_contain_text("Enter a number")
    restitution.fill("0.8")
    damping = form.get_by_label("Damping")
    damping.fill("0,05")
    expect(page.locator("#error-damping")).to_contain_text("“0,05” is not a number; write 0.05")
    damping.fill("0.05")
    further = page.get_by_label("Further fields")
    further.fill("5")
    expect(page.locator("#error-further")).to_contain_text("This is not JSON")
    further.fill('{"base": {"amplitude": 0.1}}')
    expect(page.locator("#error-further")).to_contain_text("base/stops_move: ")
    further.fill("")
    masses.fill("1, x")
    expect(page.locator("#error-masses")).to_contain_text("“x” is not a number")
    masses.fill("1, 2")
    expect(page.locator("#error-stiffnesses")).to_contain_text("3 numbers and masses has 2")
    expect(page.locator("#error-masses")).to_contain_text("2 masses, but 3 stiffnesses")
    chart = page.locator("#overview-chart svg")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 50)
    shown = page.url
    page.mouse.up()
    expect(page).not_to_have_url(shown)
    low, high = 0.3 * 0.41892744, 1.6 * 1.19352411
    left, right = (low + (320 * part - 62) / 244 * (high - low) for part in (0.6, 0.7))
    shows = window(page)[0]
    assert shows[1] == pytest.approx(right, abs=0.01)
    assert shows[0] < left + 0.01  # the strip of the axis covers nothing of it
    assert shows[0] > left - 0.1 * (right - left) - 0.01
    masses.fill("2, 10, 10")
    expect(page.locator("#modes")).not_to_contain_text("0.4189,")
    expect(page.locator("#overview-chart svg")).to_be_visible()
    assert len(watched.refusals) == 3


def test_machines_are_drawn(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "Machine", "All its numbers")
    for preset, words in (
        ("hammer", "One mass: mass 1 with a stop on the right."),
        ("damper", "2 masses: mass 1 between two stops on mass 2."),
        ("rack", "3 masses: mass 1 between two stops that move with the base."),
    ):
        page.get_by_label("Begin with").select_option(preset)
        drawing = page.get_by_role("img", name=words)
        expect(drawing).to_be_visible()
        assert drawing.locator(".stop").count() == (1 if preset == "hammer" else 2)
    page.get_by_label("Begin with").select_option("paper")
    for name in ("Masses, from", "Stiffnesses", "Damping", "Forces"):
        page.locator("#machine").get_by_label(name).fill("")
    matrices = {"mass": [[1, 0], [0, 2]], "damping": {"modal": [0.02, 0.02]}, "stiffness": [[2, -1], [-1, 3]]}
    others = {"matrices": matrices, "contact": {"row": [1, -0.5]}, "forcing": [1, 0]}
    page.get_by_label("Further fields").fill(json.dumps(others))
    expect(page.get_by_role("img", name="2 masses: a sum of displacements between two stops.")).to_be_visible()


def test_the_address_shares_the_machine(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "Machine")
    page.get_by_label("Begin with").select_option("hammer")
    expect(page).to_have_url(re.compile("machine="))
    address, asked = page.url, small.posted("unfolding-maps")
    page.goto("about:blank")
    page.goto(address)
    expect(page.locator("#modes")).to_contain_text("63.25 rad/s, damping ratio 0.02372", use_inner_text=False)
    soon(page, lambda: len(small.posted("unfolding-maps")) > len(asked))
    again = small.posted("unfolding-maps")[len(asked) :]
    assert all(body["clearance"]["left"] is None for body in again)


def test_what_is_taken_home(small: Watched, url: str, tmp_path: Path) -> None:
    page = small.page
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.route("**/v1/unfolding-maps", lambda route: None)  # an answer that does not come
    show(small, url, QUICK, wait=False)
    unfold(page, "Take home")
    page.get_by_role("button", name="CSV", exact=True).click()
    expect(page.locator("#copied")).to_have_text("No tile of this window is complete yet.")
    page.unroute_all(behavior="ignoreErrors")
    page.goto("about:blank")
    show(small, url, QUICK)
    unfold(page, "Take home")
    saved = {}
    for name in ("PNG", "SVG", "CSV", "npz"):
        with page.expect_download() as download:
            page.get_by_role("button", name=name, exact=True).click()
        saved[name] = tmp_path / download.value.suggested_filename
        download.value.save_as(saved[name[:3]])
    assert saved["PNG"].read_bytes().startswith(b"\x89PNG")
    assert "<path" in saved["SVG"].read_text()
    umap = np.load(saved["npz"], allow_pickle=False)
    assert umap["verified"].shape == (128, 128)
    rows = list(csv.DictReader(saved["CSV"].read_text().splitlines()))
    points = {(float(row["omega"]), float(row["clearance"])): row["motion"] for row in rows}
    assert points[umap["omega"][3], umap["clearance"][5]] == "1-(-1)r-(-1)l"

    def copied(name: str) -> str:
        page.get_by_role("button", name=name).click()
        expect(page.locator("#copied")).to_contain_text("copied")
        text: str = page.evaluate("navigator.clipboard.readText()")
        return text

    assert copied("Copy link") == page.url
    command = copied("Copy as curl").replace("curl -s", "curl -sf", 1)
    answer = json.loads(subprocess.run(command, shell=True, capture_output=True, check=True).stdout)
    assert set(answer["omega"]) == {omega for omega, _ in points}
    program = copied("Copy as Python")
    ast.parse(program)
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True)
    assert (tmp_path / "map.png").exists()


def test_a_table_of_a_view_that_is_not_complete_says_so(small: Watched, url: str, tmp_path: Path) -> None:
    page, kept = small.page, []

    def answer(route: Route) -> None:
        """Let one tile come, and the previews; the others do not."""
        body = route.request.post_data_json
        if not body.get("preview"):
            kept.append(body)
        if body.get("preview") or body == kept[0]:
            route.continue_()

    page.route("**/v1/unfolding-maps", answer)
    show(small, url, QUICK, wait=False)

    def previews() -> int:
        return len({json.dumps(body) for body in small.posted("unfolding-maps") if body.get("preview")})

    soon(page, lambda: page.evaluate(PROGRESS)[0] == previews() + 1)
    unfold(page, "Take home")
    with page.expect_download() as download:
        page.get_by_role("button", name="CSV", exact=True).click()
    total = int(re.search(r"-1-of-(\d+)-tiles", download.value.suggested_filename)[1])  # type: ignore[index]
    expect(page.locator("#copied")).to_contain_text(f"1 of the {total} tiles")
    download.value.save_as(tmp_path / "part.csv")
    rows = list(csv.DictReader((tmp_path / "part.csv").read_text().splitlines()))
    places = [(float(row["clearance"]), float(row["omega"])) for row in rows]
    assert places == sorted(set(places))
    assert len(places) == len({x for x, _ in places}) * len({y for _, y in places})
    there = [row for row in rows if row["motion"] != "not computed"]
    assert 0 < len(there) <= 128 * 128 < len(rows)
    page.unroute_all(behavior="ignoreErrors")


def test_jobs_are_listed_and_cancelled(small: Watched, url: str) -> None:
    page = show(small, url, f"{ALSO_HARD}&{LONG}", wait=False)
    unfold(page, "Jobs")
    verified_tiles = page.locator("#jobs li:has(button)").filter(has_text="unfolding maps", has_not_text="preview")
    link = verified_tiles.get_by_role("link").first.get_attribute("href")
    job = str(link).rpartition("/")[2]
    page.locator(f'#jobs li:has(a[href="{link}"]) button').click()
    assert ended(url, job) == "dismissed"
    says = page.locator("#says")
    expect(says).to_contain_text("The job was cancelled", timeout=30_000)
    # where it is asked for again it is computed
    page.keyboard.press("Escape")  # the menu lies over the buttons
    page.get_by_label("Zoom in").click()
    page.get_by_label("Zoom out").click()
    soon(page, lambda: httpx2.get(f"{url}/v1/jobs/{job}").json()["status"] == "running")
    page.wait_for_timeout(1500)
    expect(says).not_to_contain_text("cancelled")
    # the list keeps the focus while it is renewed
    unfold(page, "Jobs")
    other = verified_tiles.get_by_role("button").first
    other.focus()
    name = page.evaluate("document.activeElement.value")
    page.wait_for_timeout(2500)
    assert page.evaluate("document.activeElement.value") == name
    page.evaluate(f"location.hash = '{QUICK}'")


def test_a_service_with_keys_is_asked_with_the_key_that_one_enters(small: Watched, url: str) -> None:
    page, keys = small.page, []

    def check(route: Any) -> None:
        keys.append(route.request.headers.get("authorization"))
        if keys[-1] == "Bearer open sesame":
            route.continue_()
        else:
            route.fulfill(status=401, json={"title": "Key required"})

    page.route("**/v1/**", check)
    page.goto(f"{url}/#{QUICK}")
    title = page.locator("#key-title")
    first = title.inner_text()
    page.get_by_label("Key", exact=True).fill("sesame")
    page.get_by_role("button", name="Continue").click()
    expect(title).to_be_visible()
    expect(title).not_to_have_text(first)
    page.get_by_label("Key", exact=True).fill("open sesame")
    page.get_by_role("button", name="Continue").click()
    verified(page)
    assert set(keys) == {None, "Bearer sesame", "Bearer open sesame"}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_the_page_without_scrolling_sideways(small: Watched, url: str, scheme: Any) -> None:
    page = small.page
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": 360, "height": 740})
    show(small, url, QUICK)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (np.mean([int(part) for part in re.findall(r"\d+", background)][:3]) > 128) == (scheme == "light")


def test_the_legend_explains_what_is_in_sight_only(small: Watched, url: str) -> None:
    page = show(small, url, USUAL, wait=False)
    explained = page.locator("#curve-legend li:visible")
    expect(explained.filter(has_text="Circles")).to_have_count(1, timeout=WAIT)
    points = answered(url, "grazing-curves", {"omega": {"start": 0.25, "stop": 0.3125, "points": 33}})["points"]
    types = {point["bifurcation"] for point in points if 1.25 < point["clearance"] < 2} - {None}
    assert len(types) > 1
    assert {text.partition(":")[0] for text in explained.all_inner_texts()} == types | {"Circles", "Bold line"}
    page.evaluate(f"location.hash = '{QUICK}'")  # above the curve and its marks
    expect(explained).to_have_count(0)


def test_the_legend_names_few_motions_until_more_are_asked_for(watched: Watched, url: str) -> None:
    page = show(watched, url, USUAL)
    named = page.locator("#legend button[value]")
    expect(named).to_have_count(8)
    others = page.locator("#legend li").filter(has_text="others")
    rest = int(re.search(r"\d+", others.inner_text())[0])  # type: ignore[index]
    others.get_by_role("button").click()
    expect(named).to_have_count(24)
    expect(others).to_contain_text(str(rest + 8 - 24))
    page.get_by_role("button", name="fewer").click()
    expect(named).to_have_count(8)
    expect(others).to_contain_text(str(rest))


@pytest.mark.parametrize("width", [900, 1280])
def test_menus_open_inside_the_window_one_at_a_time_and_close(small: Watched, url: str, width: int) -> None:
    small.page.set_viewport_size({"width": width, "height": 480})
    page = show(small, url, QUICK, wait=False)
    cards = page.locator("details.menu[open] > .card")
    for menu in page.locator("details.menu").all():
        menu.locator("summary").click()
        expect(cards).to_have_count(1)
        soon(page, lambda: inside(cards.bounding_box(), width, 480))
    page.keyboard.press("Escape")
    expect(cards).to_have_count(0)
    unfold(page, "View")
    page.mouse.click(*place(page, 0.27, 2.1))
    expect(cards).to_have_count(0)


def inside(box: Any, width: int, height: int) -> bool:
    """Return whether a box is whole inside the window."""
    return bool(
        box and min(box["x"], box["y"]) >= 0 and box["x"] + box["width"] <= width and box["y"] + box["height"] <= height
    )
