"""Modules of the page by themselves, in a browser without a service: looks of motions, tables of points."""

from __future__ import annotations

import csv
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import grazemap_service
from grazemap.colours import PALETTE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

STATIC = Path(grazemap_service.__file__).parent / "static" / "explorer"
LEGEND = 24
"""Motions that the legend of the page names."""
# what met in one window, of which pairs had one colour, and many more
MET = ["2-3r-4l", "3-7r-7l", "9-13r-13l", "5-8r-8l", "2-5r-5l", "2-(-1)r-1l", "1-1r-1l", "1-(-1)r-(-1)l"]
MANY = [f"{n}-{n + k}r-{n}l" for n in range(4, 14) for k in range(5)]


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=STATIC)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        page = browser.new_page()
        page.goto(f"http://127.0.0.1:{server.server_address[1]}/tiles.js")
        page.evaluate("palette => { window.palette = palette; }", PALETTE)
        yield page
        page.close()
        server.shutdown()
        thread.join()


SEEN = """async (views) => {
    const { Colours } = await import("/labels.js");
    const { swatch } = await import("/dom.js");
    const colours = new Colours(palette);
    return views.map((labels) => {
        colours.see(labels);
        return labels.map((label) => {
            const look = colours.of(label);
            const { backgroundColor, backgroundImage } = swatch(look.colour, look.image).style;
            const places = Array.from({ length: 24 }, (_, k) => k);
            const points = places.flatMap((row) => places.map((column) => String(look.at(row, column))));
            return { colour: look.colour, swatch: backgroundColor + backgroundImage, points: points.join(";") };
        });
    });
}"""


def test_no_two_motions_of_a_legend_look_the_same_and_no_other_as_one_of_them(page: Page) -> None:
    named = {**PALETTE["kinds"], **PALETTE["motions"]}
    everything = [*MANY, *(label for label in named if label not in MET), "not decided yet", *MET]
    for labels in (MET, MANY, everything, everything[::-1], ["not decided yet", "unresolved"]):
        (looks,) = page.evaluate(SEEN, [labels])
        for what in ("swatch", "points"):  # of the legend, and of the plane
            first = {look[what] for look in looks[:LEGEND]}
            assert len(first) == min(LEGEND, len(labels))
            assert not first & {look[what] for look in looks[LEGEND:]}
        assert all(look["colour"] == named[label] for label, look in zip(labels, looks, strict=True) if label in named)
    (looks,) = page.evaluate(SEEN, [MET + MANY])
    assert len({look["colour"] for look in looks[:LEGEND]}) == LEGEND  # without stripes while there are colours


def test_a_look_depends_on_what_is_seen_together_and_stays_while_that_is_seen(page: Page) -> None:
    named = PALETTE["motions"]
    seen = [*MET, *MANY[:10]]
    first, _, backwards, again = page.evaluate(SEEN, [seen, MANY, seen[::-1], seen])
    assert first == backwards[::-1] == again
    # more complicated motions leave a simple one its look
    simple = ["2-3r-4l", "3-7r-7l"]
    alone, among = page.evaluate(SEEN, [simple, [*simple, *MANY[:10]]])
    assert alone == among[:2]
    # those that come into the legend have a colour without stripes, whatever had it before
    few, many = MANY[:LEGEND], MANY[LEGEND:]
    _, looks = page.evaluate(SEEN, [[*many, *few], [*few, *many]])
    assert len({look["colour"] for look in looks[:LEGEND]}) == LEGEND
    # what the legend names before and after a change of the view keeps its look, beside others that come and go
    first, then = page.evaluate(SEEN, [MANY[5:17], [*MANY[:5], *MANY[17:20], *MANY[5:15]]])
    assert first[:10] == then[8:]
    assert len({look["swatch"] for look in then}) == len(then)
    # but not against a motion that the palette names
    _, then = page.evaluate(SEEN, [MANY[:LEGEND], [*MANY[:10], *MET]])
    assert all(
        look["colour"] == named[label] for label, look in zip([*MANY[:10], *MET], then, strict=True) if label in named
    )
    # the largest shares choose first, however complicated their motions are
    rest = "1-∞r-(-1)l"
    ((alone,),), ((largest, *_),) = (
        page.evaluate(SEEN, [[rest, *few]]) for few in ([], [f"1-{n}r-(-1)l" for n in range(2, LEGEND)])
    )
    assert largest == alone
    # a motion that had a colour takes it again, also after a view without it
    first, _, then = page.evaluate(SEEN, [MANY[:12], MANY[20:32], [*MANY[12:16], *MANY[:12]]])
    assert then[4:] == first
    # the name gives the colour wherever that is free
    ((alone,),), ((also,),) = page.evaluate(SEEN, [["7-9r-8l"]]), page.evaluate(SEEN, [["7-9r-8l"]])
    assert alone == also


TABLE = """async ({ tiles, view }) => {
    const { asCsv } = await import("/takehome.js");
    return asCsv(tiles, view);
}"""


def tile(across: int, up: int, motion: str | None) -> dict[str, Any]:
    axes = {"points": 2, "x": [across, across + 1], "y": [up, up + 1]}
    if motion is None:
        return axes
    values = {"verified": [1] * 4, "sensitive": [0] * 4, "lyapunov": [-0.5] * 4, "least_impact_velocity": [None] * 4}
    return {**axes, "labels": [motion], "motion": [0] * 4, **values}


def test_a_table_has_every_point_of_the_view_and_says_which_were_not_computed(page: Page) -> None:
    # as they come: in no order, one not at all
    tiles = [tile(2, 1, "1-1r-1l"), tile(1, 1, None), tile(1, 2, "1-2r-2l"), tile(2, 2, "1-3r-3l")]
    view = {"plane": {"horizontal": "omega", "vertical": "clearance"}, "x": [1.0, 2.9], "y": [1.3, 3.0]}
    text = page.evaluate(TABLE, {"tiles": tiles, "view": view})
    rows = list(csv.DictReader(text.splitlines()))
    points = [(float(row["omega"]), float(row["clearance"])) for row in rows]
    across, up = [1.25, 1.75, 2.25, 2.75], [1.75, 2.25, 2.75]
    assert points == [(x, y) for y in up for x in across]
    expected = {(1, 1): "not computed", (2, 1): "1-1r-1l", (1, 2): "1-2r-2l", (2, 2): "1-3r-3l"}
    assert [row["motion"] for row in rows] == [expected[int(x), int(y)] for x, y in points]
    for row in rows:
        known = row["motion"] != "not computed"
        assert (row["verified"], row["sensitive"], row["lyapunov"]) == (("1", "0", "-0.5") if known else ("", "", ""))
        assert row["least_impact_velocity"] == ""


OFFERED = """async (tiles) => {
    const saved = ["png", "svg", "csv", "npz", "later"].map((kind) => `save-${kind}`);
    const names = ["copy-link", "copy-frame", "copy-python", "copy-curl", ...saved, "copied"];
    document.body.replaceChildren(...[...names, "to-copy"].map((id) => {
        const made = document.createElement(id === "copied" ? "p" : "button");
        made.id = id;
        return made;
    }));
    const { offer } = await import("/takehome.js");
    const files = [];
    HTMLAnchorElement.prototype.click = function () { files.push(this.download); };
    const state = { plane: { horizontal: "omega", vertical: "clearance" }, x: [1, 3], y: [1, 3] };
    offer(() => ({ state, tiles }));
    const said = {};
    for (const name of ["csv", "npz"]) {
        document.getElementById(`save-${name}`).click();
        await new Promise((resolve) => setTimeout(resolve, 300));
        said[name] = document.getElementById("copied").textContent;
    }
    return { files, said };
}"""


def test_what_is_taken_home_of_a_part_says_so_and_no_other_tile_is_the_one_in_the_middle(page: Page) -> None:
    there, middle = tile(1, 1, "1-1r-1l"), tile(2, 1, None)
    offered = page.evaluate(OFFERED, [there, middle])
    assert offered["files"] == ["grazemap-1-of-2-tiles.csv"]
    assert "1 of the 2 tiles" in offered["said"]["csv"]
    assert "middle" in offered["said"]["npz"]
    assert page.evaluate(OFFERED, [there])["files"][:1] == ["grazemap.csv"]
    assert page.evaluate(OFFERED, [middle])["files"] == []


BASINS = """async ([names, seen = []]) => {
    document.body.innerHTML = '<div id="basins"></div>';
    const { showBasins } = await import("/further.js");
    const { Colours } = await import("/labels.js");
    const colours = new Colours(palette);
    colours.see(seen);
    const label = names.map((_, k) => [k, k, -1]);
    const attractors = names.map((label) => ({ label, kind: "periodic", share: 1 / names.length }));
    const machine = { oscillator: null, stops: "equal", left: null, periods: 400 };
    const answer = { label, attractors, horizontal: [0, 1, 2], vertical: names.map((_, k) => k), displacement: [[0]] };
    await showBasins({ machine, at: [0.29, 1.6], colours, compute: async () => answer });
    const { swatch } = await import("/dom.js");
    const styleOf = ({ style }) => style.backgroundColor + style.backgroundImage;
    const inView = seen.map((label) => [label, styleOf(swatch(colours.of(label).colour, colours.of(label).image))]);
    const entries = [...document.querySelectorAll("#basins li")].map((entry) => ({
        text: entry.textContent,
        swatch: styleOf(entry.querySelector(".swatch")),
    }));
    return { entries, inView: Object.fromEntries(inView) };
}"""


def test_attractors_of_one_name_look_different_and_are_numbered(page: Page) -> None:
    names = ["1-1r-1l", "1-2r-1l", "1-2r-1l", "1-2r-1l", "7-9r-8l", "7-9r-8l"]
    *entries, unresolved = page.evaluate(BASINS, [names])["entries"]
    assert unresolved["text"] == "unresolved: 33.3 % of these starts"
    assert len({entry["swatch"] for entry in entries}) == len(names)
    labels = [entry["text"].partition(":")[0] for entry in entries]
    assert labels == ["1-1r-1l", "1-2r-1l", "1-2r-1l, 2", "1-2r-1l, 3", "7-9r-8l", "7-9r-8l, 2"]


def test_motions_of_basins_look_as_in_the_view_and_others_as_none_of_it(page: Page) -> None:
    names = [*MET[:4], *MANY[:4]]
    answer = page.evaluate(BASINS, [names, [*MET, "unresolved"]])
    looks = dict(zip(names, (entry["swatch"] for entry in answer["entries"][:-1]), strict=True))
    in_view = answer["inView"]
    assert {label: looks[label] for label in MET[:4]} == {label: in_view[label] for label in MET[:4]}
    assert not {looks[label] for label in MANY[:4]} & set(in_view.values())


STORED = """async ([machine, plane, policy]) => {
    const requests = await import("/requests.js");
    const { viewOf } = await import("/stored.js");
    const across = { start: 0.25, stop: 0.75, points: 3 };
    const up = { start: 1.125, stop: 1.875, points: 4 };
    return viewOf(requests.map(machine, plane, across, up, { policy }));
}"""


@pytest.mark.parametrize("policy", ["rest", "sweep-up", "ensemble"])
@pytest.mark.parametrize(
    ("horizontal", "vertical"),
    [("omega", "clearance"), ("restitution", "clearance"), ("omega", "damping"), ("masses[2]", "forcing")],
)
@pytest.mark.parametrize("stops", ["equal", "right", "left", "unequal"])
def test_a_map_that_the_page_asks_for_is_opened_in_the_view_that_asked(
    page: Page, stops: str, horizontal: str, vertical: str, policy: str
) -> None:
    machine = {"oscillator": {"masses": [1, 2]}, "stops": stops, "left": 1.5 if stops == "unequal" else None}
    machine["periods"] = 300
    varied = (horizontal, vertical)
    plane = {"horizontal": horizontal, "vertical": vertical}
    plane |= {"omega": None if "omega" in varied else 0.3, "clearance": None if "clearance" in varied else 1.25}
    view = page.evaluate(STORED, [machine, plane, policy])
    assert view == {"machine": machine, "plane": plane, "policy": policy, "x": [0.125, 0.875], "y": [1, 2]}


@pytest.mark.parametrize(("horizontal", "clearance"), [("omega", 2.5), ("clearance", None)])
def test_a_map_over_the_left_stop_has_it_in_the_middle(page: Page, horizontal: str, clearance: float | None) -> None:
    machine = {"oscillator": {"masses": [1, 2]}, "stops": "unequal", "left": 1.5, "periods": 300}
    plane = {"horizontal": horizontal, "vertical": "clearance_left", "clearance": clearance}
    plane["omega"] = None if horizontal == "omega" else 0.3
    view = page.evaluate(STORED, [machine, plane, "rest"])
    assert (view["machine"], view["plane"]) == (machine, plane)


NO_VIEW = """async (request) => (await import("/stored.js")).viewOf(request)"""


@pytest.mark.parametrize(
    "changed",
    [
        {"horizontal": {"vary": "omega", "values": [0.25, 0.5]}},  # no range
        {"horizontal": {"vary": "contact_mass", "values": {"start": 1, "stop": 2, "points": 3}}},  # no parameter
        {"vertical": {"vary": "clearance", "values": {"start": 0.1, "stop": 2.1, "points": 3}}},  # it begins below zero
        {"policy": "ensemble", "initial_conditions": [[0, 0]]},
        {"policy": "grid"},
    ],
)
def test_a_map_that_the_page_cannot_ask_for_has_no_view(page: Page, changed: dict[str, object]) -> None:
    request = {
        "horizontal": {"vary": "omega", "values": {"start": 0.25, "stop": 0.75, "points": 3}},
        "vertical": {"vary": "clearance", "values": {"start": 1.125, "stop": 1.875, "points": 4}},
        "max_periods": 400,
    }
    assert page.evaluate(NO_VIEW, request) is not None
    assert page.evaluate(NO_VIEW, request | changed) is None


WORDS = """async ([label, stops]) => (await import("/motionwords.js")).inWords(label, { stops })"""


@pytest.mark.parametrize(
    ("label", "stops", "words"),
    [
        ("1-1r-1l", "equal", "Every period: 1 hit on the right, 1 hit on the left"),
        ("3-(-1)r-2l", "unequal", "Every 3 periods: no hit on the right, 2 hits on the left"),
        ("2-3r-(-1)l", "right", "Every 2 periods: 3 hits"),
        ("2-(-1)r-3l", "left", "Every 2 periods: 3 hits"),
        ("1-∞r-(-1)l", "right", "Every period: a series of hits that comes to rest"),
        ("1-0r-2l", "equal", "Every period: rest without a hit on the right, 2 hits on the left"),
        ("1-(-1)r-(-1)l", "equal", "Every period the same, and no stop is hit"),
        ("chaotic", "equal", "It never repeats, and small differences grow"),
        ("an own name", "equal", ""),
    ],
)
def test_a_motion_is_told_in_words(page: Page, label: str, stops: str, words: str) -> None:
    assert page.evaluate(WORDS, [label, stops]) == words


SPEEDS = """async (impacts) => (await import("/motionwords.js")).speedsOf(impacts, " m/s")"""


def test_the_speeds_of_hits_are_told(page: Page) -> None:
    impacts = {"kind": ["impact", "stick", "impact"], "velocity": [0.25, 0.001, -0.125]}
    assert page.evaluate(SPEEDS, impacts) == ", at speeds of 0.125 m/s to 0.25 m/s"
    assert page.evaluate(SPEEDS, {"kind": ["impact"], "velocity": [-0.5]}) == ", at a speed of 0.5 m/s"
    slow = {"kind": ["impact", "impact"], "velocity": [0.25, 0.001]}
    assert page.evaluate(SPEEDS, slow) == ", at speeds up to 0.25 m/s"
    assert page.evaluate(SPEEDS, {"kind": [], "velocity": []}) == ""


MOVING = """async (oscillator) => {
    const { moving } = await import("/moving.js");
    const path = {
        time: [0, 1, 2],
        displacement: [[1, 2, 3], [4, 5, 6]],
        impacts: { time: [], stop: [], velocity: [] },
        motion: { kind: "periodic", period: 1 },
        meta: { request: { samples_per_period: 2 } },
    };
    const shown = moving({ oscillator, stops: "equal", left: null }, [1, 7], path, "#000000");
    const { masses, struck, bearer, period, loop } = shown;
    return { masses: masses.length, struck, bearer, period, loop };
}"""


@pytest.mark.parametrize(
    ("fields", "shown"),
    [
        ({}, {"masses": 2, "struck": 0, "bearer": None}),
        ({"contact": 2}, {"masses": 2, "struck": 1, "bearer": None}),
        ({"contact": [1, 2]}, {"masses": 2, "struck": 0, "bearer": 1}),  # the stops are on mass 2
        ({"contact": {"row": [1, -0.5]}}, {"masses": 1, "struck": 0, "bearer": None}),
        ({"matrices": {}}, {"masses": 1, "struck": 0, "bearer": None}),
    ],
)
def test_the_animation_shows_the_masses_and_where_the_stops_are(
    page: Page, fields: dict[str, object], shown: dict[str, object]
) -> None:
    # a forcing period has two samples, whatever omega is: forces may repeat within 2 pi/omega
    assert page.evaluate(MOVING, {"masses": [1, 2]} | fields) == shown | {"period": 2, "loop": 2}


COLOURS_OF_VALUES = """async (preview) => {
    const { LAYERS, paint } = await import("/layers.js");
    const { Colours } = await import("/labels.js");
    const tile = {
        points: 2, preview, labels: ["1-1r-1l", "1-(-1)r-(-1)l"], motion: [0, 0, 1, 1], verified: [1, 1, 1, 1],
        lyapunov: [-0.5, NaN, NaN, NaN],
    };
    const drawn = paint(tile, "exponent", { hidden: new Set(), range: [-1, 1, false], colours: new Colours(palette) });
    return [...drawn.getContext("2d").getImageData(0, 0, 2, 2).data];
}"""


def test_points_without_a_value_show_where_nothing_is_hit_and_what_a_preview_knows(page: Page) -> None:
    calm, valued, none = ((0, 0), (1, 0), (1, 1))
    image = np.reshape(page.evaluate(COLOURS_OF_VALUES, False), (2, 2, 4))
    assert image[valued][3] == image[calm][3] == 255
    assert np.unique(image[none][:3]).size == 1  # grey
    paler = np.reshape(page.evaluate(COLOURS_OF_VALUES, True), (2, 2, 4))
    assert np.array_equal(paler[valued], image[valued])
    assert np.unique(paler[none][:3]).size > 1  # pale: the motion that the preview knows
    assert paler[calm][:3].min() > image[calm][:3].min()


ZEROS = """async ([n, slope, limit]) => {
    const { zeros } = await import("/contours.js");
    const at = (k) => (k + 0.5) / n;
    const values = Float64Array.from({ length: n * n }, (_, k) => at(Math.floor(k / n)) - slope * at(k % n) - 0.25);
    const others = limit === undefined ? null : Float64Array.from({ length: n * n }, (_, k) => at(k % n) - limit);
    return [...zeros(values, n, others)];
}"""


def test_a_line_of_zeros_reaches_the_edges_of_its_tile(page: Page) -> None:
    ends = np.reshape(page.evaluate(ZEROS, [4, 0.5]), (-1, 2))
    assert np.allclose(ends[:, 1], 0.5 * ends[:, 0] + 0.25)
    assert (ends[:, 0].min(), ends[:, 0].max()) == (0.0, 1.0)


EXTENT = """async (values) => (await import("/charts.js")).extent(values)"""


def test_a_chart_does_not_draw_round_off(page: Page) -> None:
    low, high = page.evaluate(EXTENT, [0.45721612555, 0.45721612555 + 6e-17, None, 0.45721612555])
    assert low < 0.3 < 0.6 < high
    low, high = page.evaluate(EXTENT, [0.4, 0.5])
    assert (low, high) == pytest.approx((0.395, 0.505))


def test_no_line_of_zeros_is_drawn_where_the_other_stop_is_met_before(page: Page) -> None:
    ends = np.reshape(page.evaluate(ZEROS, [16, 0.5, 0.5]), (-1, 2))
    assert np.allclose(ends[:, 1], 0.5 * ends[:, 0] + 0.25)
    assert ends[:, 0].min() == pytest.approx(0.5, abs=1 / 16)
    assert ends[:, 0].max() == 1.0


GRAZES = """async ({ answers, fixed, up }) => {
    const { Curves } = await import("/curves.js");
    const curves = new Curves({ changed: () => {}, failed: () => {}, palette });
    curves.answer = (what) => answers[what] ?? null;
    return { ...Object.assign(curves, { fixed, up }), lines: curves.lines(), marks: curves.marks() };
}"""


def test_a_graze_that_another_stop_prevents_is_dashed_and_no_grazing_curve(page: Page) -> None:
    omega = [1, 2, 3, 4, 5]
    graze = {"omega": omega, "clearance_right": [1, 2, 3, 4, 5], "virtual_right": [True, True, False, False, False]}
    point = {"omega": 3, "clearance": 3}
    graze["points"] = [
        point | {"kind": "corner", "margin": -1},
        point | {"kind": "recurrence", "order": 1, "margin": 1},
    ]
    beside = {"omega": omega, "clearance_left": [5, 4, 3, 2, 1]}
    fixed = {"stop": "left", "at": 2.5}
    drawn = page.evaluate(GRAZES, {"answers": {"graze": graze, "beside": beside}, "fixed": fixed, "up": [0, 10]})
    real, virtual, upright, below = drawn["lines"]
    assert (real["y"], real["isGraze"], real.get("dashed")) == ([None, 2, 3, 4, 5], True, None)
    assert (virtual["y"], virtual.get("isGraze"), virtual["dashed"]) == ([1, 2, None, None, None], None, True)
    # the left stop is touched at omega = 3.5, where the right one is met before at clearances below 3.5
    assert (upright["x"], upright["y"], upright.get("dashed")) == ([3.5, 3.5], [3.5, 10], None)
    assert (below["x"], below["y"], below["dashed"]) == ([3.5, 3.5], [0, 3.5], True)
    corner, recurrence = drawn["marks"]
    assert corner["colour"] == PALETTE["ink"] != recurrence["colour"]
    assert corner["text"].count(".") > recurrence["text"].count(".")


TICKS = """async ([low, high]) => (await import("/ticks.js")).ticks([low, high], 8)"""


@pytest.mark.parametrize("width", [3.3e-7, 2.1e-8, 9.7e-7])
def test_texts_of_close_ticks_are_the_distances_from_their_base(page: Page, width: float) -> None:
    ticks = page.evaluate(TICKS, [0.281234 - width / 2, 0.281234 + width / 2])
    assert len(ticks["marks"]) > 2
    for mark in ticks["marks"]:
        told = float(mark["text"].replace("\u2212", "-"))
        assert told == pytest.approx(mark["value"] - ticks["base"], rel=1e-6, abs=1e-3 * width)


def test_a_series_that_comes_to_rest_is_no_simple_motion_whatever_it_is_compared_with(page: Page) -> None:
    labels = [f"5-{right}r-{left}l" for left in ("∞", 3, 12, 1) for right in (2, 7, 4, 9)]
    first, backwards = page.evaluate(SEEN, [labels, labels[::-1]])
    assert first == backwards[::-1]


ANSWERED = """
    globalThis.Worker = class {
        postMessage({ number }) {
            const tile = { labels: ["1-1r-1l"], motion: new Uint16Array(1) };
            setTimeout(() => this.onmessage({ data: { number, tile } }));
        }
    };
    const headers = { Location: "v1/jobs/1", "Preference-Applied": "return=representation" };
"""
"""A decoder whose tiles have one motion, and the headers of a result."""

SWEPT = (
    f"async (windows) => {{{ANSWERED}"
    """
    const seen = globalThis.fetch;
    globalThis.fetch = async () => new Response("npz", { headers });
    const { serve } = await import("/api.js");
    const { Tiles } = await import("/tiles.js");
    serve({ trouble: () => {} });
    const tiles = new Tiles({ changed: () => {}, failed: () => {} });
    const shown = [];
    for (const { x, y } of windows) {
        tiles.showWhole("swept", {}, { x, y }, 128);
        const before = tiles.within("swept", { x, y });
        await new Promise((resolve) => setTimeout(resolve, 100));
        shown.push([before, tiles.within("swept", { x, y })].map((some) => some.map((tile) => tile.x)));
    }
    globalThis.fetch = seen;
    return shown;
}"""
)


def test_one_sweep_is_shown_at_a_time(page: Page) -> None:
    narrow, wide, beside = ({"x": x, "y": [1, 2]} for x in ([0.4, 0.6], [0.2, 1.0], [0.5, 0.7]))
    shown = page.evaluate(SWEPT, [narrow, wide, beside, narrow])
    assert shown == [
        [[], [narrow["x"]]],
        [[narrow["x"]], [wide["x"]]],
        [[wide["x"]], [beside["x"]]],
        [[narrow["x"]], [narrow["x"]]],  # kept
    ]


LEFT = (
    f"async ([deep, wide, domains]) => {{{ANSWERED}"
    """
    const seen = globalThis.fetch;
    let isHeld = true;
    globalThis.fetch = async (path, { body }) => {
        if (isHeld && !JSON.parse(body).preview) await new Promise(() => {});
        return new Response("npz", { headers });
    };
    const { serve } = await import("/api.js");
    const { Tiles } = await import("/tiles.js");
    const { bounds } = await import("/lattice.js");
    serve({ trouble: () => {} });
    const tiles = new Tiles({ changed: () => {}, failed: () => {} });
    const drawn = [];
    for (const tile of [deep, wide]) {
        tiles.show("left", (x, y, preview) => ({ preview }), [tile], domains);
        await new Promise((resolve) => setTimeout(resolve, 200));
        const view = { x: bounds(deep.i, deep.ex), y: bounds(deep.j, deep.ey) };
        drawn.push(tiles.within("left", view).map(({ preview, x }) => [preview, x[1] - x[0]]));
        isHeld = false;
    }
    globalThis.fetch = seen;
    return drawn;
}"""
)


def test_previews_of_a_view_that_was_left_do_not_cover_what_is_verified(page: Page) -> None:
    deep, wide = {"ex": -6, "ey": -6, "i": 69, "j": 69}, {"ex": -2, "ey": -2, "i": 4, "j": 4}
    before, after = page.evaluate(LEFT, [deep, wide, {"x": [0, 10], "y": [0, 10]}])
    assert before[-1] == [True, 2**-6]
    assert after[-1] == [False, 2**-2]
    assert [True, 2**-6] in after


BUSY = """async () => {
    const seen = globalThis.fetch;
    const answers = { asked: 0 };
    globalThis.fetch = async () => {
        answers.asked += 1;
        return new Response("{}", { status: 429, headers: { "Retry-After": "120" } });
    };
    const { compute, serve } = await import("/api.js");
    serve({ trouble: () => {} });
    const abort = new AbortController();
    const waiting = compute("unfolding-maps", {}, { signal: abort.signal }).catch((error) => error.name);
    await new Promise((resolve) => setTimeout(resolve, 50));
    abort.abort();
    const end = await Promise.race([waiting, new Promise((resolve) => setTimeout(() => resolve("waits"), 2000))]);
    globalThis.fetch = seen;
    return { ...answers, end };
}"""


def test_what_is_given_up_does_not_wait_for_a_busy_service(page: Page) -> None:
    assert page.evaluate(BUSY) == {"asked": 1, "end": "AbortError"}


OUTDATED = """async (times) => {
    const seen = globalThis.fetch;
    let asked = 0;
    globalThis.fetch = async () => {
        asked += 1;
        const problem = { type: "urn:grazemap:problem:core-outdated", title: "outdated" };
        const isOutdated = asked <= times;
        const body = JSON.stringify(isOutdated ? { status: "failed", problem } : { value: 1 });
        const applied = isOutdated ? {} : { "Preference-Applied": "return=representation" };
        return new Response(body, { headers: { Location: "v1/jobs/1", ...applied } });
    };
    const { compute, serve } = await import("/api.js");
    serve({ trouble: () => {} });
    const answer = await compute("grazing-curves", {}).then(({ data }) => data.value, () => "failed");
    globalThis.fetch = seen;
    return { asked, answer };
}"""


def test_a_job_of_a_version_that_is_gone_is_asked_for_once_more(page: Page) -> None:
    assert page.evaluate(OUTDATED, 1) == {"asked": 2, "answer": 1}
    assert page.evaluate(OUTDATED, 2) == {"asked": 2, "answer": "failed"}


DRAGGED = """async () => {
    const { chart, onDrag } = await import("/charts.js");
    const names = { x: "x", y: "y" };
    const drawn = chart({ title: "", x: [0, 1], y: [1000, 1000.5], names });
    drawn.style.width = "640px";
    document.body.replaceChildren(drawn);
    document.body.style.margin = "0";
    window.chosen = null;
    onDrag(drawn, [0, 1], (...ends) => { window.chosen = ends; });
    const { left, right, top, bottom } = drawn.querySelector(".frame").getBoundingClientRect();
    return { left, right, middle: (top + bottom) / 2 };
}"""


def test_a_drag_over_a_chart_chooses_what_is_below_it(page: Page) -> None:
    box = page.evaluate(DRAGGED)
    for share, step in ((0.25, page.mouse.down), (0.75, page.mouse.up)):
        page.mouse.move(box["left"] + share * (box["right"] - box["left"]), box["middle"], steps=3)
        step()
    assert page.evaluate("window.chosen") == pytest.approx([0.25, 0.75], abs=0.003)


BASIN_RANGES = """async ([contact, stops]) => {
    const { basins } = await import("/requests.js");
    const machine = { oscillator: { masses: [1, 2], contact }, stops, left: null, periods: 400 };
    const { horizontal, vertical } = basins(machine, [2, 1], 3);
    return [horizontal, vertical].map(({ values }) => [values.start, values.stop]);
}"""


@pytest.mark.parametrize(
    ("contact", "stops", "displacements", "fastest"),
    [
        (1, "equal", [-0.99, 0.99], 2),
        (1, "right", [-1, 0.99], 2),
        ([2, 1], "right", [-0.99, 1], 2),  # mass 1 moves away from the stop to the right
        ({"row": [2, -1]}, "equal", [-0.495, 0.495], 1),
        (2, "equal", [-0.99, 0.99], 2),
    ],
)
def test_the_starts_of_basins_are_between_the_stops(
    page: Page, contact: object, stops: str, displacements: list[float], fastest: float
) -> None:
    assert page.evaluate(BASIN_RANGES, [contact, stops]) == [displacements, [-fastest, fastest]]


GONE = """async (statuses) => {
    const seen = globalThis.fetch;
    const asked = [];
    globalThis.fetch = async (path, { method }) => {
        asked.push(`${method} ${path}`);
        const status = method === "GET" ? statuses.shift() : 200;
        const headers = { Location: "v1/jobs/1", "Preference-Applied": "return=representation" };
        return new Response(method === "GET" && status !== 200 ? "{}" : `from ${method}`, { status, headers });
    };
    const { mapOf, serve } = await import("/api.js");
    serve({ trouble: () => {} });
    const text = new TextDecoder().decode(await mapOf("1", {}));
    globalThis.fetch = seen;
    return { asked, text };
}"""


@pytest.mark.parametrize(("status", "source"), [(200, "GET"), (202, "POST"), (409, "POST")])
def test_a_map_that_the_service_does_not_have_any_more_is_computed_again(page: Page, status: int, source: str) -> None:
    answer = page.evaluate(GONE, [status])
    assert answer["text"] == f"from {source}"
    assert answer["asked"] == ["GET v1/jobs/1/result", "POST v1/unfolding-maps"][: 1 if source == "GET" else 2]
