"""Parts of the page by themselves, in a browser without a service: axes, units, points, programs, tables."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from grazemap.colours import PALETTE
from grazemap_core.simulation.motion import REASONS
from tests.support.page_modules import modules

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

STEEL = {"units": "SI", "masses": [0.5], "stiffnesses": [2000], "damping": [1.5], "forcing": [5], "restitution": 0.7}
HAMMER = {"oscillator": STEEL, "stops": "right", "left": None, "periods": 400}
USUAL = {"horizontal": "omega", "vertical": "clearance", "omega": None, "clearance": None}
POWER = {"name": "dissipated_power", "unit": "W", "description": "Energy that impacts dissipate."}


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with modules(browser) as page:
        page.evaluate("palette => { window.palette = palette; }", PALETTE)
        yield page


LAID = """async (options) => {
    const { layout, drawnAxes, paintAxes } = await import("/axes.js");
    const laid = layout(options);
    const drawn = drawnAxes(laid).map((part) => [part.tagName, part.textContent, part.getAttribute("text-anchor")]);
    const painted = [];
    const pen = {
        save() {}, restore() {}, translate() {}, rotate() {}, fillRect() {},
        fillText(text) { painted.push([text, this.textAlign]); },
    };
    paintAxes(pen, laid);
    return { laid, drawn, painted };
}"""


def test_axes_are_the_same_on_a_canvas_and_in_svg_and_their_ticks_stand_at_their_values(page: Page) -> None:
    frame = {"left": 40, "right": 440, "top": 10, "bottom": 210}
    answer = page.evaluate(
        LAID,
        {
            "view": {"x": [0.25, 0.3125], "y": [0, 4e-6]},
            "frame": frame,
            "names": {"x": "ω", "y": "clearance (m)"},
            "places": {"x": {"x": 240, "y": 240}, "y": {"x": 8, "y": 110}},
            "gaps": {"x": 14, "y": 6},
            "most": {"x": 5, "y": 5},
            "font": 11,
        },
    )
    texts = answer["laid"]["texts"]
    below = [text for text in texts[2:] if text["anchor"] == "middle"]
    beside = [text for text in texts[2:] if text["anchor"] == "end"]
    assert len(below) > 2
    assert len(beside) > 2
    for text in below:
        assert 0.25 + (text["x"] - 40) / 400 * 0.0625 == pytest.approx(float(text["text"]))
    for text in beside:  # in the power of ten that the name says
        assert (210 - text["y"]) / 200 * 4e-6 == pytest.approx(1e-6 * float(text["text"]))
    assert texts[1]["text"] == "clearance (10⁻⁶ m)"
    assert [text["turned"] for text in texts[:2]] == [False, True]
    names = {"start": "left", "middle": "center", "end": "right"}
    drawn = [(text, names[anchor]) for tag, text, anchor in answer["drawn"] if tag == "text"]
    assert drawn == [tuple(part) for part in answer["painted"]]
    assert len([tag for tag, *_ in answer["drawn"] if tag == "line"]) == len(below) + len(beside)


def test_a_name_beside_its_texts_covers_none_of_them(page: Page) -> None:
    answer = page.evaluate(
        LAID,
        {
            "view": {"x": [0.25, 0.3125], "y": [1, 2]},
            "frame": {"left": 0, "right": 500, "top": 0, "bottom": 300},
            "clear": {"left": 60, "bottom": 274},
            "names": {"x": "forcing frequency", "y": "clearance"},
            "places": {"x": {"x": 490, "y": 288, "anchor": "end"}, "y": {"x": 8, "y": 140}},
            "gaps": {"x": 14, "y": 6},
            "most": {"x": 8, "y": 8},
            "font": 12,
        },
    )
    name, _, *texts = answer["laid"]["texts"]
    width = 0.6 * 12
    below = [text for text in texts if text["anchor"] == "middle"]
    assert below
    for text in below:
        half = width * len(text["text"]) / 2
        assert text["x"] - half >= 59
        assert text["x"] + half <= name["x"] - width * len(name["text"])


CHART = """async ([x, y, names, size]) => {
    const { chart } = await import("/charts.js");
    const svg = chart({ title: "", x, y, names, ...(size && { size }) });
    svg.style.cssText = `font: 11px system-ui, sans-serif; width: ${svg.viewBox.baseVal.width}px; display: block`;
    document.body.style.margin = 0;
    document.body.replaceChildren(svg);
    const { width, height } = svg.getBoundingClientRect();
    const boxes = [...svg.querySelectorAll("text")].map((text) => {
        const { left, right, top, bottom } = text.getBoundingClientRect();
        const isBelow = text.getAttribute("text-anchor") === "middle";
        return { text: text.textContent, left, right, top, bottom, isBelow };
    });
    return { width, height, boxes };
}"""
HALF, LOW = {"width": 160, "height": 132}, {"width": 320, "height": 110}


@pytest.mark.parametrize("size", [HALF, LOW, None])
@pytest.mark.parametrize("ends", [[-0.0052, 0.0018], [-1.7e-4, 4.7e-4], [-2, 2], [0.1234567, 0.1234569], [-0.05, 1.06]])
def test_texts_of_a_chart_fit_and_do_not_meet(page: Page, ends: list[float], size: dict[str, int] | None) -> None:
    names = {"x": "displacement of mass 1 (mm)", "y": "displacement (mm)"}
    answer = page.evaluate(CHART, [ends, ends, names, size])
    for box in answer["boxes"]:
        assert box["left"] >= -0.6, box
        assert box["right"] <= answer["width"] + 0.6, box
        assert box["top"] >= -0.6, box
        assert box["bottom"] <= answer["height"] + 0.6, box
    below = [box for box in answer["boxes"][2:] if box["isBelow"]]
    beside = [box for box in answer["boxes"][2:] if not box["isBelow"]]
    assert min(len(below), len(beside)) >= 2
    assert all(left["right"] + 2 < right["left"] for left, right in itertools.pairwise(below))
    assert all(upper["bottom"] - 3 < lower["top"] for upper, lower in itertools.pairwise(beside[::-1]))


@pytest.mark.parametrize(
    ("quantity", "unit", "text", "number"),
    [
        ("frequency", "rad/s", " rad/s", 100.0),
        ("frequency", "Hz", " Hz", 100 / (2 * np.pi)),
        ("frequency", "rpm", " rpm", 100 * 60 / (2 * np.pi)),
        ("length", "mm", " mm", 1e5),
        ("m", "mm", " mm", 1e5),
        ("W", "mm", " W", 100.0),
    ],
)
def test_numbers_in_other_units_come_back_as_they_were(
    page: Page, quantity: str, unit: str, text: str, number: float
) -> None:
    answer = page.evaluate(
        """async ([machine, quantity, unit]) => {
            const { UNITS, USUAL_UNITS, choose, shown, inSI, unitOf, entry } = await import("/units.js");
            const kind = Object.keys(UNITS).find((name) => unit in UNITS[name]);
            choose({ ...USUAL_UNITS, [kind]: unit });
            const there = shown(machine, quantity, 100);
            const answer = {
                there, back: inSI(machine, quantity, there), text: unitOf(machine, quantity),
                without: [shown({ oscillator: null }, quantity, 100), unitOf({ oscillator: null }, quantity)],
                entered: inSI(machine, quantity, Number(entry(machine, quantity, 0.0098))),
            };
            choose(USUAL_UNITS);
            return answer;
        }""",
        [HAMMER, quantity, unit],
    )
    assert answer["there"] == pytest.approx(number)
    assert answer["back"] == pytest.approx(100)
    assert answer["entered"] == pytest.approx(0.0098, rel=1e-10)
    assert answer["text"] == text
    assert answer["without"] == [100, ""]


def test_the_points_of_a_window_are_those_of_its_tiles(page: Page) -> None:
    windows = [([0.2501, 0.3117], -5), ([1.5, 2.25], -2), ([0.93, 1.0], -3)]
    for window, exponent in windows:
        many, few, tiles = page.evaluate(
            """async ([window, exponent]) => {
                const { POINTS, indices, pointsOf, range } = await import("/lattice.js");
                const domain = [0, window[1] === 1 ? 1 : Infinity];
                const tiles = indices(window, exponent, domain).map((index) => range(index, exponent, POINTS));
                return [pointsOf(window, exponent, domain), pointsOf(window, exponent, domain, 50), tiles];
            }""",
            [window, exponent],
        )

        def values(range_: dict[str, Any]) -> np.ndarray:
            return np.linspace(range_["start"], range_["stop"], range_["points"])

        of_tiles = np.concatenate([values(tile) for tile in tiles])
        inside = of_tiles[(window[0] <= of_tiles) & (of_tiles <= window[1])]
        np.testing.assert_array_equal(values(many), inside)
        assert few["points"] <= 50
        assert set(values(few)) <= set(inside)


def test_a_table_in_si_has_units_in_its_heads_and_the_quantity_that_is_shown(page: Page) -> None:
    tile = {"points": 2, "x": [40, 50], "y": [0.01, 0.02], "labels": ["1-1r-(-1)l"], "motion": [0] * 4}
    tile |= {"verified": [1] * 4, "sensitive": [0] * 4, "lyapunov": [-0.5] * 4, "least_impact_velocity": [0.1] * 4}
    tile["dissipated_power"] = [1, 2, 3, 4]
    for units, heads, first in (
        ({"frequency": "rad/s", "length": "m"}, ["omega (rad/s)", "clearance (m)"], [42.5, 0.0125]),
        ({"frequency": "Hz", "length": "mm"}, ["omega (Hz)", "clearance (mm)"], [42.5 / (2 * np.pi), 12.5]),
    ):
        text = page.evaluate(
            """async ([tile, view, power, units]) => {
                const { addObservables } = await import("/layers.js");
                const { choose } = await import("/units.js");
                addObservables([power]);
                choose(units);
                const { asCsv } = await import("/takehome.js");
                return asCsv([tile], view);
            }""",
            [
                tile,
                {"plane": USUAL, "x": tile["x"], "y": tile["y"], "machine": HAMMER, "layer": "dissipated_power"},
                POWER,
                units,
            ],
        )
        rows = list(csv.DictReader(text.splitlines()))
        assert list(rows[0])[:2] == heads
        assert [float(rows[0][head]) for head in heads] == pytest.approx(first)
        assert [row["dissipated_power (W)"] for row in rows] == ["1", "2", "3", "4"]
        assert rows[0]["least_impact_velocity (m/s)"] == "0.1"


def test_texts_are_broken_within_their_width(page: Page) -> None:
    text = "a caption of some words http://127.0.0.1:8000/#" + "x" * 300
    lines = page.evaluate(
        'async (text) => (await import("/picture.js")).broken(text, 400, 12)',
        text,
    )
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert max(map(len, lines)) <= 400 / (0.56 * 12)


def test_values_far_from_zero_have_a_scale_of_their_own(page: Page) -> None:
    def scale(layer: str, field: str, values: list[float]) -> list[float]:
        ends: list[float] = page.evaluate(
            'async ([layer, field, values]) => (await import("/layers.js")).rangeOf(layer, [{ [field]: values }])',
            [layer, field, values],
        )
        return ends

    near = np.linspace(0, 0.9, 5000).tolist()
    far = np.linspace(1.31, 1.34, 5000).tolist()
    assert scale("speed", "least_impact_velocity", near)[:2] == [0, 1]
    low, high, _ = scale("speed", "least_impact_velocity", far)
    assert 1.29 < low <= 1.311
    assert 1.339 <= high < 1.36
    assert scale("number", "motions_found", [0, 1, 2, 3] * 1000) == [0, 3, False]


def test_reasons_in_plain_words_are_reasons_of_the_service(page: Page) -> None:
    parts = page.evaluate('async () => Object.keys((await import("/others.js")).PLAIN)')
    assert parts
    for part in parts:
        assert sum(part in reason for reason in REASONS.values()) == 1


def test_motions_side_by_side_are_named_with_their_shares(page: Page) -> None:
    answer = {
        "attractors": [
            {"label": "1-1r-1l", "kind": "periodic"},
            {"label": None, "kind": "chaotic"},
            {"label": "1-1r-1l", "kind": "periodic"},
            {"label": "2-1r-1l", "kind": "periodic"},
        ],
        "share": [[0.2, 0], [0.5, 0.1], [0.1, 0.9], [0, 1]],
        "unresolved": [0.2, 0],
    }
    motions = page.evaluate('async (answer) => (await import("/others.js")).motionsOf(answer)', answer)
    assert [(motion["label"], motion["share"]) for motion in motions["motions"]] == [
        ("chaotic", 0.5),
        ("1-1r-1l", 0.2),
        ("1-1r-1l, 2", 0.1),
    ]
    assert motions["unresolved"] == 0.2
