"""What is taken home is the very picture: its points, its legend, its machine, and the programs that compute it."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote
from xml.etree import ElementTree

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Response, expect

from tests.support.explorer_page import beside_axes, window
from tests.support.watched_page import Watched
from tests.system.browser.conftest import watched_page

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

WAIT = 240_000
NEAR = "omega=0.28125..0.296875&clearance=1.9375..2"  # about the grazing curve
STEEL = {"units": "SI", "masses": [0.5], "stiffnesses": [2000], "damping": [1.5], "forcing": [5], "restitution": 0.7}
HAMMER = quote(json.dumps({"oscillator": STEEL, "stops": "right"}))
FINE = 128  # points along a side of a tile
SVG = "{http://www.w3.org/2000/svg}"


@dataclass
class Tiles:
    """The bytes of the fine verified tiles that a page got, each with its request."""

    kept: list[tuple[dict[str, Any], bytes]] = field(default_factory=list)

    def note(self, answer: Response) -> None:
        if answer.request.method != "POST" or not answer.url.endswith("/v1/unfolding-maps") or not answer.ok:
            return
        body = answer.request.post_data_json
        is_fine = body["horizontal"]["values"]["points"] == FINE
        if is_fine and not body.get("preview") and answer.headers.get("content-type") == "application/x-npz":
            self.kept.append((body, answer.body()))

    def labels(self, *names: str) -> dict[tuple[float, float], tuple[Any, ...]]:
        """Return the values at each point of all tiles."""
        points: dict[tuple[float, float], tuple[Any, ...]] = {}
        for _, data in self.kept:
            points |= labels(data, *names)
        return points


def labels(data: bytes, *names: str) -> dict[tuple[float, float], tuple[Any, ...]]:
    with np.load(io.BytesIO(data), allow_pickle=False) as umap:
        arrays = [umap[name] for name in names]
        across, up = umap["omega"], umap["clearance" if "clearance" in umap else "clearance_right"]
        return {
            (float(x), float(y)): tuple(array[i, j].tobytes() for array in arrays)
            for i, y in enumerate(up)
            for j, x in enumerate(across)
        }


NAMES = ("kind", "period", "impacts_right", "impacts_left", "verified", "sensitive")


@pytest.fixture
def tiny(browser: Browser, url: str) -> Iterator[Watched]:
    """A page whose plane has very few tiles."""
    yield from watched_page(browser, url, 800, 250)


def shown(watched: Watched, url: str, state: str) -> Tiles:
    """Open a view, and wait for all of its tiles."""
    page, tiles = watched.page, Tiles()
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.on("response", tiles.note)
    page.goto(f"{url}/#{state}")
    expect(page.locator("#progress")).to_have_class("done", timeout=WAIT)
    page.wait_for_timeout(300)
    page.get_by_text("Take home", exact=True).click()
    return tiles


def copied(page: Page, name: str) -> str:
    page.get_by_role("button", name=name).click()
    expect(page.locator("#copied")).to_contain_text("copied", timeout=30_000)
    text: str = page.evaluate("navigator.clipboard.readText()")
    return text


def saved(page: Page, name: str, folder: Path) -> Path:
    with page.expect_download() as download:
        page.get_by_role("button", name=name, exact=True).click()
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


@pytest.mark.parametrize(
    ("state", "more"),
    [
        (f"{NEAR}&curves=all", ()),
        (f"{NEAR}&layer=rms_displacement", ("rms_displacement",)),
        (f"{NEAR}&layer=exponent", ("lyapunov",)),
        (f"{NEAR}&policy=sweep-down", ()),
        (f"{NEAR}&policy=ensemble&layer=number", ("motions_found",)),
        (f"omega=60..75&clearance=0.012..0.02&machine={HAMMER}", ()),
    ],
)
def test_the_copied_program_and_command_compute_the_points_that_are_seen(
    tiny: Watched, url: str, tmp_path: Path, state: str, more: tuple[str, ...]
) -> None:
    page = tiny.page
    tiles = shown(tiny, url, state)
    seen = tiles.labels(*NAMES, *more)
    assert len(seen) >= 128 * 128
    program = copied(page, "Copy as Python")
    subprocess.run([sys.executable, "-c", f'{program}\numap.save("map.npz")\n'], cwd=tmp_path, check=True)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    command = copied(page, "Copy as curl")
    body = json.loads(re.search(r"-d '(.*)'", command, re.DOTALL)[1])  # type: ignore[index]
    headers = {"Accept": "application/x-npz", "Prefer": "wait=30, return=representation"}
    # the program has asked for the same map
    by_command = httpx2.post(f"{url}/v1/unfolding-maps", json=body, headers=headers, timeout=60).content
    of_program = labels((tmp_path / "map.npz").read_bytes(), *NAMES, *more)
    of_command = labels(by_command, *NAMES, *more)
    assert of_program == of_command
    ends = window(page) if "sweep" in state else beside_axes(page)
    inside = {at for at in seen if all(low <= value <= high for value, (low, high) in zip(at, ends, strict=True))}
    assert set(of_program) == inside
    wrong = [at for at in inside if of_program[at] != seen[at]]
    assert wrong == []


def test_the_command_is_one_that_a_shell_runs(tiny: Watched, url: str) -> None:
    shown(tiny, url, f"{NEAR}&policy=sweep-down")
    command = copied(tiny.page, "Copy as curl").replace("curl -s", "curl -sf", 1)
    answer = json.loads(subprocess.run(command, shell=True, capture_output=True, check=True).stdout)
    assert answer.get("omega") or answer["process"] == "unfolding-maps"


def test_the_pictures_have_the_legend_the_machine_the_window_and_the_link(
    tiny: Watched, url: str, tmp_path: Path
) -> None:
    page = tiny.page
    shown(tiny, url, f"omega=60..75&clearance=0.012..0.02&units=Hz,mm&machine={HAMMER}")
    path = saved(page, "SVG", tmp_path)
    root = ElementTree.fromstring(path.read_text())
    texts = [text.text or "" for text in root.iter(f"{SVG}text")]
    whole = " ".join(texts)
    for label in page.locator("#legend button").evaluate_all("all => all.map(({ value }) => value)"):
        assert label in texts
    assert {"Hz", "mm"} <= set(re.findall(r"\((Hz|mm)\)", whole))
    version = httpx2.get(f"{url}/v1").json()["version"]
    assert version in whole
    assert root.findtext(f"{SVG}desc") == page.url
    assert "masses [0.5]" in whole
    assert root.find(f".//{SVG}svg") is not None  # the sketch
    assert root.find(f".//{SVG}image").get("href", "").startswith("data:image/png")  # type: ignore[union-attr]
    curves = [part for part in root.iter(f"{SVG}path") if part.find(f"{SVG}title") is not None]
    assert curves
    png = saved(page, "PNG", tmp_path).read_bytes()
    width, height = (int.from_bytes(png[start : start + 4], "big") for start in (16, 20))
    assert (width, height) == (2 * int(root.get("width", "0")), 2 * int(root.get("height", "0")))


def test_the_colour_bar_of_a_picture_has_numbers(tiny: Watched, url: str, tmp_path: Path) -> None:
    page = tiny.page
    shown(tiny, url, f"{NEAR}&layer=exponent")
    expect(page.locator("#ramp-ends span")).to_have_count(3)
    expect(page.locator("#ramp-missing")).to_have_text("Grey: it was not measured.")  # all tiles are there
    ends = page.locator("#ramp-ends span").all_inner_texts()
    drawn = ElementTree.fromstring(saved(page, "SVG", tmp_path).read_text())
    places = {text.text: float(text.get("x", "nan")) for text in drawn.iter(f"{SVG}text")}
    (bar,) = (part for part in drawn.iter(f"{SVG}rect") if part.get("fill") == "url(#ramp)")
    left, width = (float(bar.get(name, "nan")) for name in ("x", "width"))
    assert [places[end] for end in ends] == pytest.approx([left, left + width / 2, left + width])


def test_a_picture_that_waits_for_its_tiles_is_given_up_aloud(tiny: Watched, url: str, tmp_path: Path) -> None:
    page = tiny.page
    page.route("**/v1/unfolding-maps", lambda route: None)  # an answer that does not come
    page.goto(f"{url}/#{NEAR}")
    page.get_by_text("Take home", exact=True).click()
    saved(page, "PNG", tmp_path)
    page.locator("#save-later").click()
    before = page.locator("#says").inner_text()
    page.locator("#plane").press("-")
    expect(page.locator("#says")).to_contain_text("not saved")
    assert "not saved" not in before
    page.unroute_all(behavior="ignoreErrors")


def test_the_window_that_was_asked_for_is_the_one_that_is_shown_and_taken_home(
    tiny: Watched, url: str, tmp_path: Path
) -> None:
    page = tiny.page
    shown(tiny, url, NEAR)
    page.locator("#view-section > summary").click()
    ends = ["0.285", "0.295", "1.95", "1.99"]
    fields = page.locator("#window-form input").all()
    for entry, text in zip(fields, ends, strict=True):
        entry.fill(text)
    page.get_by_role("button", name="Show this window").first.click()
    expect(page.locator("#progress")).to_have_class("done", timeout=WAIT)
    page.locator("#view-section > summary").click()
    assert [entry.input_value() for entry in fields] == ends
    page.get_by_text("Take home", exact=True).click()
    rows = saved(page, "CSV", tmp_path).read_text().splitlines()[1:]
    points = np.array([[float(value) for value in row.split(",")[:2]] for row in rows])
    for values, (low, high) in zip(points.T, ((0.285, 0.295), (1.95, 1.99)), strict=True):
        assert low <= values.min() < low + 0.01 * (high - low)
        assert high - 0.01 * (high - low) < values.max() <= high
    expect(page.locator("#copied")).to_contain_text("saved")


def test_a_picture_of_a_part_says_so(tiny: Watched, url: str, tmp_path: Path) -> None:
    page = tiny.page
    page.route("**/v1/unfolding-maps", lambda route: None)  # an answer that does not come
    page.goto(f"{url}/#{NEAR}")
    page.get_by_text("Take home", exact=True).click()
    path = saved(page, "SVG", tmp_path)
    count = re.fullmatch(r"grazemap-0-of-(\d+)-tiles.svg", path.name)
    assert count is not None
    assert f"0 of the {count[1]} tiles" in path.read_text()
    page.unroute_all(behavior="ignoreErrors")
