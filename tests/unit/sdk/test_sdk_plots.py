"""Pictures: the right things on them, colours with the same meaning everywhere, and no global state."""

import inspect
import itertools
import json
import pickle
import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from coloraide import Color
from matplotlib import pyplot
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.text import Annotation

from grazemap import Oscillator
from grazemap.plots import palette, save_picture, unfolding
from grazemap.plots.axes import new_figure
from grazemap.plots.hatching import one_in_each_block
from grazemap.plots.smooth import smooth_line
from grazemap.plots.trajectory import history_with_impacts
from grazemap.results import MotionShare
from grazemap.results.observables import Quantity
from grazemap.results.orbits import CLOSED
from grazemap.results.pictures import PICTURES, draw, plots
from grazemap.results.stretches import Stretch
from grazemap.wire import motion_label
from grazemap.wire.job import INFINITE
from grazemap.wire.linear import steady_amplitude
from tests.support.sdk_documents import (
    ADAPTIVE,
    CHANCE,
    DRAWN,
    MANY,
    MOTIONS,
    POINTS,
    document,
    in_si,
    periodic,
    result_like,
    result_of,
)
from tests.support.thorough import every_fourth


def motion(period: int, right: int, left: int, pixels: int = 1) -> MotionShare:
    return MotionShare(motion_label(period, right, left), "periodic", period, right, left, pixels, 0.0)


CURVE = r"grazing curve $b = A(\omega)$"


def plain(text: str) -> str:
    """Return a text of a picture with the labels n-p_r-q_l of motions in plain text."""
    return re.sub(r"\$([^$]*)_\\mathrm{(r|l)}\$", r"\1\2", text).replace(r"\infty", "∞")


def legend(ax) -> list[str]:
    return [plain(text.get_text()) for text in ax.get_legend().get_texts()]


def map_of(counts, shape=(40, 60)):
    """Return a map whose columns are divided evenly between motions (period, right, left)."""
    codes = np.array(counts)[np.arange(shape[1]) * len(counts) // shape[1]]
    columns = dict(zip(("period", "impacts_right", "impacts_left"), codes.T, strict=True))
    return result_like(
        "UnfoldingMap",
        omega=np.linspace(0.2, 0.3, shape[1]),
        clearance=np.linspace(1.0, 2.0, shape[0]),
        kind=np.ones(shape),
        kinds=["unresolved", "periodic"],
        reasons=[""],
        **{name: np.tile(values, (shape[0], 1)) for name, values in columns.items()},
        **dict.fromkeys(("least_impact_velocity", "settled_after", "verified"), np.ones(shape)),
        **dict.fromkeys(("sensitive", "transient_growth"), np.zeros(shape)),
    )


IN_UNITS = [name for name in DRAWN if not name.startswith("periodic-orbits")]


@pytest.mark.parametrize("ending", ["png", "svg"])
@pytest.mark.parametrize(
    "process",
    # those that have units are drawn on axes of the caller below
    [pytest.param(name, marks=pytest.mark.thorough if name in IN_UNITS else ()) for name in DRAWN],
)
def test_every_result_is_drawn(process, ending, tmp_path):
    path = tmp_path / f"picture.{ending}"
    save_picture(result_of(process), path)
    assert path.read_bytes().startswith(b"\x89PNG" if ending == "png" else b"<?xml")


def test_the_map_has_regions_curve_points_and_shares():
    umap, curve = result_of("unfolding-maps"), result_of("grazing-curves")
    ax = umap.plot(curve=curve, points=result_of("codimension-two-points"))
    entries = legend(ax)
    assert entries[:4] == [
        "no impacts, 1-(-1)r-(-1)l (16.7%)",
        "1-2r-2l (33.3%)",
        "3-4r-4l (16.7%)",
        "unresolved (33.3%)",
    ]
    assert CURVE in entries
    # the axes end with the map's cells, and what is beyond them gets no entry
    assert ax.get_xlim() == pytest.approx((0.175, 0.325))
    assert ax.get_ylim() == pytest.approx((1.45, 1.65))
    assert not any("recurrence" in entry for entry in entries)
    far = result_of("grazing-curves", {"clearance": curve.clearance + 5.0})
    assert CURVE not in legend(umap.plot(curve=far))
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"forcing frequency $\omega$", "clearance $b$")
    # small regions are drawn together and counted
    assert legend(umap.plot(motions=1)) == [entries[1], entries[3], "2 other motions (33.3%)"]


def test_a_result_of_another_kind_over_a_map_is_refused_by_name():
    umap, branch = (result_of(process) for process in ("unfolding-maps", "orbit-branches"))
    for keywords in ({"curves": branch}, {"curves": [branch]}, {"curve": branch}, {"points": branch}):
        with pytest.raises(TypeError, match=r"^\w+ is a OrbitBranch, and plot draws \w+ there$"):
            umap.plot(**keywords)


def test_an_adaptive_map_shows_what_was_computed():
    umap = result_of(ADAPTIVE)
    ax = umap.plot_computed()
    assert legend(ax) == ["computed (66.7%)", "inferred (33.3%)\n1 of 2 in a sample wrong"]
    assert ax.get_xlim() == pytest.approx((0.175, 0.325))
    np.testing.assert_array_equal(ax.collections[0].get_array().reshape(2, 3), umap.computed)
    assert legend(umap.plot()) == legend(result_of("unfolding-maps").plot())


def strokes_of(ax):
    """Return the lines of strokes of a picture, without their sample in the legend."""
    return [line for line in ax.lines if isinstance(line.get_marker(), list) and len(line.get_xdata())]


@pytest.mark.parametrize("process", ["unfolding-maps", "basins"])
def test_sensitive_points_are_hatched_and_their_share_is_in_the_legend(process):
    sensitive = np.array([[False, True, False], [False, False, True]])
    result = result_of(process, {"sensitive": sensitive})
    ax = result.plot()
    assert legend(ax)[-1] == "sensitive (33.3%)"
    (strokes,) = strokes_of(ax)
    x, y = (result.omega, result.clearance) if process == "unfolding-maps" else (result.horizontal, result.vertical)
    np.testing.assert_array_equal(strokes.get_xydata(), [(x[1], y[0]), (x[2], y[1])])
    for bare in (result_of(process).plot(), result.plot(hatching=False)):
        assert not any("sensitive" in entry for entry in legend(bare))


def test_many_sensitive_points_have_a_stroke_a_block_and_single_ones_their_own():
    sensitive = np.zeros((40, 60), np.bool_)
    sensitive[:12, :16] = True
    sensitive[31, 2] = True
    sensitive[[24, 27], [56, 59]] = True
    rows, columns, shares = one_in_each_block(sensitive, 4, 8)
    points = list(zip(rows.tolist(), columns.tolist(), strict=True))
    assert {(31, 2), (27, 59)} < set(points)
    assert sensitive[rows, columns].all()
    assert len({(row // 4, column // 8) for row, column in points}) == len(points) == 3 * 2 + 2
    assert sorted(shares.tolist()) == [1 / 32, 2 / 32, *[1.0] * 6]


def test_a_single_sensitive_point_of_a_dense_map_is_not_drawn_as_an_area():
    umap = map_of([(1, 1, 1)], shape=(400, 600))
    sensitive = np.zeros(umap.kind.shape, np.bool_)
    sensitive[:100, :100] = True
    sensitive[300, 500] = True
    ax = replace(umap, sensitive=sensitive).plot()
    longest = {
        place: max(line.get_markersize() for line in strokes_of(ax) if np.any(inside(line.get_xdata())))
        for place, inside in (
            ("area", lambda x: x < umap.omega[90]),
            ("alone", lambda x: x == umap.omega[500]),
        )
    }
    assert longest["alone"] <= 0.5 * longest["area"]
    assert sum(len(line.get_xdata()) for line in strokes_of(ax) if np.any(line.get_xdata() == umap.omega[500])) == 1


def test_a_large_map_is_drawn_as_an_image_with_its_regions_named(monkeypatch):
    monkeypatch.setattr(unfolding, "_MAX_CELLS", 1)
    monkeypatch.setattr(unfolding, "_MEASURED_SIDE", 20)
    ax = map_of([(1, 1, 1), (3, 3, 3)]).plot()
    assert not ax.collections
    drawn = ax.images[0].get_array()
    assert (drawn == (np.arange(60) >= 30)).all()
    left, right = sorted(ax.texts, key=lambda text: text.get_position()[0])
    assert (plain(left.get_text()), plain(right.get_text())) == ("1-1r-1l", "3-3r-3l")
    assert 0.2 < left.get_position()[0] < 0.25 < right.get_position()[0] < 0.3
    assert 1.0 < left.get_position()[1] < 2.0


def test_points_are_drawn_differently_by_kind_and_on_the_curve():
    ax = result_of("codimension-two-points").plot()
    assert legend(ax) == [CURVE, "resonant, saddle-node (SN), one-sided", "recurrence of order 2"]
    omega, clearance = ax.lines[0].get_data()
    curve = result_of("grazing-curves")
    chain = Oscillator.model_validate(curve.meta["request"]["oscillator"])
    np.testing.assert_array_equal(clearance, steady_amplitude(chain, omega))
    assert set(ax.lines[-1].get_xdata()) <= set(omega)
    assert any("recurrence of order" in text for text in legend(curve.plot()))
    assert not any("order 2" in text or "resonant" in text for text in legend(curve.plot(points=False)))
    nothing = result_of("codimension-two-points", {"points": []}).plot()
    assert legend(nothing) == [CURVE]
    assert "Codimension-two" in nothing.get_title()


def test_an_impact_is_a_jump_between_its_two_velocities():
    time, displacement, velocity = history_with_impacts(result_of("trajectories"), 1)
    assert (np.diff(time) >= 0).all()
    assert displacement[time == 5.0].tolist() == [1.6, 1.6]
    assert velocity[time == 5.0].tolist() == [0.5, -0.8 * 0.5]
    # the sample at the very moment of an impact comes after it
    assert velocity[time == 20.0].tolist() == [-0.25, 0.2, 1.0]


def test_a_graze_is_drawn_differently_from_an_impact():
    impacts = {**document("trajectories")["impacts"], "kind": np.array(["impact", "graze"])}
    history, _ = result_of("trajectories", {"impacts": impacts}).plot()
    assert legend(history) == ["right and left stop", "impacts", "grazes"]
    faces = {line.get_label(): line.get_markerfacecolor() for line in history.get_lines()}
    assert faces["grazes"] == "white" != faces["impacts"]
    assert history.get_figure().get_suptitle().endswith("1 impact, 1 graze")
    none = {name: values[:0] for name, values in impacts.items()}
    history, _ = result_of("trajectories", {"impacts": none}).plot()
    assert history.get_figure().get_suptitle().endswith("no impacts")


def test_a_record_that_is_too_short_to_decide_its_motion_is_not_called_unresolved():
    unresolved = {**dict.fromkeys(document("trajectories")["motion"]), "kind": "unresolved", "verified": False}
    short = result_of("trajectories", {"motion": unresolved})
    assert short.plot().history.get_figure().get_suptitle().endswith(": 2 forcing periods, 2 impacts")
    long = replace(short, meta={**short.meta, "request": {**short.meta["request"], "transient_periods": 31}})
    assert "unresolved" in long.plot().history.get_figure().get_suptitle()


def test_many_trajectories_are_drawn_in_the_colours_of_their_motions():
    result = result_of(MANY)
    history, portrait = result.plot()
    assert legend(history) == ["1-1r-1l", "unresolved"]
    colours = [line.get_color() for line in portrait.get_lines()]
    assert colours[:3] == [palette.NAMED["1-1r-1l"], palette.UNRESOLVED, palette.UNRESOLVED]
    # 5 samples and both sides of 2 impacts
    assert len(portrait.get_lines()[0].get_xdata()) == 9
    assert "3 trajectories" in history.get_figure().get_suptitle()
    # each by itself too, one that ended before its record among them
    for single in result.trajectories:
        single.plot(mass=2)


def test_a_saved_picture_leaves_no_figure_open_and_a_plot_is_pyplot_s(tmp_path):
    curve = result_of("grazing-curves")
    save_picture(curve, tmp_path / "curve.png")
    assert pyplot.get_fignums() == []
    ax = curve.plot()
    assert pyplot.gcf() is ax.figure
    axes = pyplot.figure().add_subplot()
    assert curve.plot(axes) is axes
    assert len(pyplot.get_fignums()) == 2


def areas_and_lines() -> tuple[list[str], list[str]]:
    """Return the colours of areas, and those of lines and marks, which have a rim; the ink once."""
    whole = json.loads(files("grazemap").joinpath("palette.json").read_text())
    areas = [*whole.pop("motions").values(), *whole.pop("other motions"), *whole.pop("kinds").values()]
    nested = [values.values() if isinstance(values, dict) else values for values in whole.values()]
    lines = itertools.chain.from_iterable([value] if isinstance(value, str) else value for value in nested)
    return areas, list(dict.fromkeys(lines))


@pytest.mark.parametrize(("simulation", "least"), [(None, 12.0), ("brettel", 8.0), ("vienot", 8.0), ("machado", 8.0)])
def test_any_two_colours_of_the_palette_differ(simulation, least):
    areas, lines = areas_and_lines()
    assert (len(areas), len(lines)) == (33, 17)
    for colours in (areas, lines):
        seen = [Color(colour) for colour in colours]
        if simulation:
            seen = [colour.filter("deutan", 1.0, method=simulation) for colour in seen]
        distances = [colour.delta_e(other, method="2000") for colour, other in itertools.combinations(seen, 2)]
        assert min(distances) >= least


def test_lines_are_legible_on_paper():
    assert min(Color(colour).contrast(palette.PAPER) for colour in (palette.LINE, palette.SECOND_LINE)) >= 3.0


def test_motions_that_fill_maps_are_quieter_than_rare_ones():
    def chroma(label):
        return Color(palette.NAMED[label]).convert("lch")["chroma"]

    fill = ["1-(-1)r-(-1)l", "1-1r-1l", "1-2r-2l", "1-1r-(-1)l", "1-(-1)r-1l"]
    rare = [label for label in palette.NAMED if label[0] in "23456789"]
    assert max(map(chroma, fill)) < min(map(chroma, rare))


def test_a_named_motion_has_its_colour_in_every_picture():
    others = [motion(7, n, n + 3) for n in range(15)]
    for before in (others, others[::-1], []):
        colours = palette.motion_colours([*before, motion(1, 1, 1), motion(2, 3, 3)])
        assert colours[-2:] == [palette.NAMED["1-1r-1l"], palette.NAMED["2-3r-3l"]]


def test_motions_without_a_colour_of_their_own_have_different_ones():
    rng = np.random.default_rng(11)
    for _ in range(50):
        drawn = {(int(p), int(r), int(q)) for p, r, q in zip(*rng.integers(1, 30, (3, 20)), strict=True)}
        colours = palette.motion_colours([motion(*counts) for counts in drawn])
        assert len(set(colours)) == len(drawn)
        assert set(colours) <= set(areas_and_lines()[0])
    # a motion by itself has the colour that its label gives, however many points it has
    assert palette.motion_colours([motion(7, 25, 25, 3)]) == palette.motion_colours([motion(7, 25, 25, 9000)])


def test_motions_with_equal_labels_and_those_beyond_the_palette():
    assert len(set(palette.motion_colours([motion(1, 2, 1)] * 3))) == 3
    assert palette.motion_colours([motion(9, n, n) for n in range(40)])[-1] == palette.OTHER


def test_white_text_on_dark_grounds_and_rims_for_light_dots():
    assert [palette.is_dark(c) for c in ("#000000", "#661199", "#FFEE00")] == [True, True, False]
    assert [palette.is_light(c) for c in ("#000000", "#FFF3C8", "#FF9600")] == [False, True, False]


def test_a_curve_is_drawn_smooth_through_its_points():
    # 20 points, 18 degrees apart, as far as neighbours of a branch may be
    turn = np.linspace(0.0, 2.0 * np.pi, 21)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    line = smooth_line(circle, circle)
    assert np.abs(np.hypot(*line.T) - 1.0).max() < 1e-3
    assert all(np.abs(line - point).sum(axis=1).min() < 1e-12 for point in circle)
    steps = np.diff(line, axis=0)
    angles = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    assert np.degrees(angles.max()) < 3.0
    # a cusp of the picture is smooth in the length along the curve
    t = np.linspace(-1.0, 1.0, 15)
    cusp = np.stack([t**2, t**3], axis=1)
    x, y = smooth_line(np.column_stack([cusp, t]), cusp).T
    assert np.abs(x - np.cbrt(np.abs(y)) ** 2).max() < 5e-3


def test_a_smooth_curve_is_interrupted_where_points_are_not_shown():
    t = np.linspace(0.0, 1.0, 7)
    curve = np.stack([t, t**2], axis=1)
    shown = np.array([True, True, False, False, True, True, False])
    line = smooth_line(curve, curve, shown)
    there = line[np.isfinite(line[:, 0]), 0]
    assert there.min() == 0.0
    assert there.max() == pytest.approx(t[5])
    assert not np.any((there > t[1]) & (there < t[4]))
    for equal in (np.zeros((1, 2)), np.ones((3, 2))):
        assert smooth_line(equal, equal).tolist() == equal.tolist()


def test_the_error_of_a_mapping_is_drawn_with_its_fitted_exponents():
    ax = result_of("discontinuity-mappings").plot()
    entries = legend(ax)
    assert entries[:2] == ["displacement by the mapping", r"error of $x + \beta u$, exponent 1.000"]
    assert entries[-1] == "map (exact), return 2"
    assert ax.get_xscale() == ax.get_yscale() == "log"
    assert "left stop" in ax.get_title()


def curve_of_type(ax, type: str):
    """Return the line of the only unfolded curve of a type."""
    colour = palette.BIFURCATIONS[type][1]
    (unfolded,) = [line for line in ax.lines if line.get_color() == colour and len(line.get_xdata()) > 2]
    return unfolded


def test_crowded_unfoldings_are_thinned_and_say_so():
    recurrence, resonant = POINTS
    many = [{**resonant, "omega": 0.21 + 0.0005 * k, "multiple": 1 + k % 4} for k in range(120)]
    many += [{**recurrence, "omega": 0.22 + 0.001 * k} for k in range(50)]
    ax = result_of("codimension-two-points", {"points": many}).plot_unfolding()
    assert ax.get_title().endswith(", 40 of 120 points (shortest periods)")
    texts = sorted(text.get_position()[0] for text in ax.texts if text.get_text())
    assert len(texts) > 1
    places = sorted(text.xy[0] for text in ax.texts if text.get_text())
    assert np.diff(places).min() > 0.05 * 0.1
    assert "of motions of period 3" not in legend(ax)  # those of the shortest periods are drawn


def test_curves_that_leave_a_resonant_point_are_drawn_against_the_grazing_curve():
    ax = result_of("codimension-two-points").plot_unfolding()
    assert legend(ax) == [
        CURVE,
        "side on which motions exist",
        "saddle-node (SN)",
        "of motions of period 1",
    ]
    curve = curve_of_type(ax, "SN")
    x, y = curve.get_data()
    assert x[0] == 0.28
    np.testing.assert_allclose(y, 120.0 * (x - 0.28) ** 2, rtol=1e-9, atol=1e-15)
    assert ax.get_xlim() == (0.2, 0.3)


@pytest.mark.parametrize(("same_motions", "side", "ends"), [(True, -1, True), (True, 1, False), (False, -1, False)])
def test_a_curve_is_drawn_no_further_than_the_saddle_node_of_its_motions(same_motions, side, ends):
    _, resonant = POINTS
    # the saddle-node curve is on one side of its point only
    saddle_node = {**resonant, "unfolding": {**resonant["unfolding"], "curve_omega": side}}
    unfolding = {
        **resonant["unfolding"], "curve_omega": 1, "contact": "transversal", "slope": 0.5, "quadratic": None
    }  # fmt: skip
    symmetric = saddle_node["symmetric"] == same_motions
    doubling = {**saddle_node, "omega": 0.278, "bifurcation": "PD", "unfolding": unfolding, "symmetric": symmetric}
    points = result_of("codimension-two-points", {"points": [doubling, saddle_node]})
    x, y = curve_of_type(points.plot_unfolding(omega=(0.27, 0.29)), "PD").get_data()
    assert np.all(y[x < 0.28] <= 120.0 * (x[x < 0.28] - 0.28) ** 2) == ends
    assert (x[-1] < 0.28) == ends


def test_points_without_an_unfolding_leave_the_grazing_curve_alone():
    points = [{name: value for name, value in point.items() if name != "unfolding"} for point in POINTS]
    ax = result_of("codimension-two-points", {"points": points}).plot_unfolding(omega=(0.24, 0.29))
    assert legend(ax) == [CURVE]


def test_basins_show_twins_in_two_shades_and_what_is_unresolved():
    ax = result_of("basins").plot()
    assert legend(ax) == [
        "1-2r-1l (50.0%)",
        "1-2r-1l, 2 (16.7%)",
        "chaotic (16.7%), 1 of 4 settle later",
        "unresolved (16.7%)",
    ]
    colours = [line.get_color() for line in ax.lines]
    assert len(set(colours)) == 4
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("initial displacement $x_{1}$", "initial velocity $v_{2}$")
    assert ax.get_xlim() == (-1.5, 1.5)


def test_basin_fractions_are_areas_that_fill_the_picture():
    result = result_of("basin-fractions")
    ax = result.plot()
    assert legend(ax) == [
        "1-2r-1l (75.0%)",
        "1-2r-1l, 2 (12.5%)",
        "chaotic (6.2%), 1 of 4 settle later",
        "unresolved (6.2%)",
    ]
    assert len({line.get_color() for line in ax.lines}) == 4
    assert ax.get_xlabel() == "clearance $b$"
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.5, 1.6), (0.0, 1.0))
    assert ax.get_title() == r"Basin fractions, $\omega$ = 0.29, 8 states"
    tops = [max(y for _, y in area.get_paths()[0].vertices) for area in ax.collections]
    assert tops == pytest.approx([1.0, 1.0, 1.0, 1.0])
    assert legend(result.plot(motions=1))[1] == "2 other motions"


def test_legends_have_the_chance_of_chaos_to_settle():
    told = ", 1 of 4 settle later"
    chaotic = {"kinds": np.array(["chaotic", "periodic"]), "chance_to_settle": CHANCE}
    umap = result_of("unfolding-maps", chaotic)
    assert [text.endswith(told) for text in legend(umap.plot()) if "settle" in text or "chaotic" in text] == [True]
    sections = document("bifurcation-diagrams")["sections"]
    sections[1]["motion"]["kind"] = "chaotic"
    diagram = result_of("bifurcation-diagrams", {"sections": sections, "chance_to_settle": CHANCE})
    assert legend(diagram.plot())[-2:] == ["chaotic (1 value)" + told, "sensitive (1 value)"]
    assert all("settle" not in text for text in legend(result_of("unfolding-maps").plot()))


@pytest.mark.parametrize(
    ("quantity", "label"),
    [
        ("displacement", "displacement $x_{1}$, once a forcing period"),
        ("velocity", "velocity $v_{1}$, once a forcing period"),
        ("impact_velocity", "velocity $v_{1}$, before impacts"),
    ],
)
def test_a_bifurcation_diagram_shows_a_quantity_in_the_colours_of_motions(quantity, label):
    ax = result_of("bifurcation-diagrams").plot(quantity=quantity)
    assert legend(ax) == ["1-1r-0l (1 value)", "unresolved (1 value)", "sensitive (1 value)"]
    assert ax.lines[-1].get_xdata().tolist() == [1.5]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("clearance $b$", label)


@pytest.mark.parametrize(
    ("process", "place"),
    [
        ("bifurcation-diagrams", r"$\omega$ = 0.29 rad/s"),
        ("basins", r"$\omega$ = 0.29 rad/s, $b$ = 1.6 m"),
        ("discontinuity-mappings", r"$\omega$ = 0.29 rad/s, $b$ = 1.99 m"),
        ("orbit-branches", r"$\omega$ = 0.27 rad/s"),
        ("trajectories", r"$\omega$ = 0.29 rad/s, $b$ = 1.6 m"),
    ],
)
def test_titles_have_units_where_axes_have_them(process, place):
    for result, in_units in ((result_of(process), False), (in_si(process), True)):
        axes = result.plot()
        title = axes[0].get_figure().get_suptitle() if isinstance(axes, tuple) else axes.get_title()
        assert (place in title, " rad/s" in title) == (in_units, in_units)


@pytest.mark.parametrize("counts", [(1, 2, 2), (12, -1, 10), (1, INFINITE, 0)])
def test_a_label_in_plain_text_and_the_motion_look_the_same(counts):
    assert palette.label_text(motion_label(*counts)) == palette.motion_text(motion(*counts))
    assert palette.label_text(f"of {motion_label(*counts)}, too").startswith("of ")
    assert palette.label_text("a motion not found") == "a motion not found"


@pytest.mark.parametrize(("stops", "name"), [([1, 1], "1-2r-(-1)l"), ([-1, -1], "1-(-1)r-2l")])
def test_a_branch_of_one_stop_is_named_as_its_orbits_are(stops, name):
    branch = result_of("orbit-branches", {"stops": np.array(stops), "symmetric": False})
    assert plain(branch.plot().get_title()).startswith(f"Branch of {name}, ")


def test_a_branch_is_solid_where_stable_dashed_where_not_and_pale_where_no_motion():
    ax = result_of("orbit-branches").plot()
    assert legend(ax) == [
        "stable",
        "unstable",
        "not admissible",
        "saddle-node (SN)",
        "graze (GR)",
        "impacts on the right stop",
        "impacts on the left stop",
    ]
    styles = {line.get_label(): line.get_linestyle() for line in ax.lines}
    assert (styles["stable"], styles["unstable"]) == ("-", "--")
    assert plain(ax.get_title()).startswith("Branch of 1-1r-1l, ")
    assert [text.get_text() for text in ax.texts] == ["l, r"]  # of a symmetric motion both are equally fast


def branch_with_its_mirror_image():
    """Return a branch that turns at an SB and goes back as its mirror image, not as far."""
    parameter = np.array([1.0, 1.2, 1.4, 1.4, 1.1])
    apart = 0.3 * np.sqrt(1.5 - parameter) * [1, 1, 1, -1, -1]
    phases = [0.5, 0.5 + np.pi]
    return result_like(
        "OrbitBranch",
        {"multiplier": 6},
        parameter=parameter,
        stops=[1, -1],
        symmetric=False,
        phases=np.tile(phases, (5, 1)),
        velocities=np.column_stack([0.25 + apart, apart - 0.25]),
        special_points=[{"type": "SB", "parameter": 1.5, "segment": 2, "phases": phases, "velocities": [0.25, -0.25]}],
        ends=["begin", "end"],
    )


def test_a_branch_that_goes_back_as_its_mirror_image_has_two_stretches_and_is_drawn_once():
    branch = branch_with_its_mirror_image()
    begin, end = branch.ends
    assert branch.stretches() == [
        Stretch("stable", 1.0, 1.5, begin, "SB"),
        Stretch("stable", 1.5, 1.1, "SB", end),
    ]
    ax = branch.plot()
    drawn = [line.get_xdata()[1:] for line in ax.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2]
    assert len(drawn) == 2
    assert [(line[0], line[-1]) for line in drawn] == [(1.0, 1.5)] * 2
    assert "and its mirror image" in ax.get_title()
    speeds = {text.get_text(): text.xy[1] - 0.25 for text in ax.texts}
    assert speeds == pytest.approx({"r": 0.3 * np.sqrt(0.5), "l": -0.3 * np.sqrt(0.5)})
    assert not branch.plot(labels=False).texts


def round_trip(turns, away=0.0):
    """Return a closed branch along a circle of the parameter and the speed, at parts of a turn.

    `away` is what is added to the phases of the impact in a turn.
    """
    around = 2.0 * np.pi * turns
    return result_like(
        "OrbitBranch",
        {"multiplier": 6},
        parameter=2.0 + np.cos(around),
        stops=[1],
        symmetric=False,
        phases=(0.5 + 0.1 * np.sin(around) + away * turns)[:, None],
        velocities=0.25 + 0.1 * np.sin(around)[:, None],
        ends=[CLOSED, CLOSED],
    )


@pytest.mark.parametrize("away", [0.0, 2.0 * np.pi])
def test_a_closed_branch_is_drawn_closed(away):
    branch = round_trip(np.arange(1, 25) / 24.0, away)
    (line,) = (line for line in branch.plot().lines if line.get_label() == "stable")
    drawn = line.get_xydata()[1:]
    np.testing.assert_allclose(drawn[-1], drawn[0])
    assert np.hypot(drawn[:, 0] - 2.0, (drawn[:, 1] - 0.25) / 0.1) == pytest.approx(1.0, abs=0.01)
    assert branch.stretches()[-1].ends == branch.parameter[0]


def test_nothing_goes_back_to_the_beginning_where_a_closed_branch_overlaps_itself():
    branch = round_trip(np.arange(1, 26) / 24.2)
    (line,) = (line for line in branch.plot().lines if line.get_label() == "stable")
    turned = np.unwrap(np.arctan2(line.get_ydata()[1:] - 0.25, 0.1 * (line.get_xdata()[1:] - 2.0)))
    assert (np.diff(turned) > 0.0).all()


def test_a_closed_bifurcation_curve_is_drawn_closed():
    around = np.linspace(0.0, 6.0, 20)
    curve = dict(document(MOTIONS)["curves"][0], ends=np.array(["closed", "closed"]))
    curve |= {"omega": 0.25 + 0.02 * np.cos(around), "clearance": 1.55 + 0.02 * np.sin(around)}
    curve |= {name: np.tile(curve[name][0], (20, 1)) for name in ("phases", "velocities")}
    curve["impact_velocity"] = np.full(20, 0.1)
    line = result_of(MOTIONS, {"curves": [curve]}).plot().lines[0].get_xydata()
    np.testing.assert_array_equal(line[-1], line[0])


def test_a_quantity_of_a_closed_branch_is_drawn_closed():
    branch = round_trip(np.arange(24) / 24.0)
    power = {"dissipated_power": np.sin(np.linspace(0.0, 6.0, 24))}
    ax = replace(branch, **power).plot("dissipated_power")
    (line,) = (line for line in ax.lines if line.get_label() == "stable")
    np.testing.assert_array_equal(line.get_xydata()[-1], line.get_xydata()[0])


def test_a_branch_of_a_single_orbit_has_a_picture():
    branch = result_of("orbit-branches")
    alone = {name: array[:1] for name, array in vars(branch).items() if np.shape(array)[:1] == branch.parameter.shape}
    assert replace(branch, special_points=(), **alone).plot().get_title() == branch.plot().get_title()


def test_branches_on_one_axes_share_the_legend_and_differ_by_colour_and_name():
    branch = result_of("orbit-branches")
    ax = branch.plot(branch.plot(), legend="outside")
    assert len(legend(ax)) == len(set(legend(ax)))
    ax = branch.plot(branch.plot(label="left"), colour="red", label="right", legend="outside")
    entries = legend(ax)
    assert {"left, stable", "right, stable"} < set(entries)
    assert entries.count("graze (GR)") == 1
    assert "along branches" in ax.get_title()
    assert {line.get_color() for line in ax.lines if line.get_label() in ("right, stable", "right, unstable")} == {
        "red"
    }
    again = branch.plot(branch.plot(), colour="red", legend="outside")
    assert legend(again).count("stable") == 2  # of different colours


def test_multipliers_are_drawn_inside_and_outside_of_the_unit_circle():
    ax = result_of("periodic-orbits").plot()
    assert plain(ax.get_title()) == "Multipliers of 1-1r-1l, unstable"
    outside = ax.lines[-1]
    assert outside.get_xdata().tolist() == [-1.5]


def test_multipliers_along_a_branch_are_coloured_by_its_parameter():
    ax = result_of("orbit-branches").plot_multipliers()
    pale, motions = ax.collections
    assert (pale.get_alpha(), len(pale.get_offsets()), len(motions.get_offsets())) == (0.3, 6, 18)
    assert motions.get_clim() == (1.8, 1.88)
    assert r"$\omega$ = 0.27" in ax.get_title()
    far = result_of("orbit-branches", {"multipliers": np.full((4, 6, 2), 1e9)})
    assert sum(len(points.get_offsets()) for points in far.plot_multipliers().collections) == 0


def test_curves_of_motions_are_named_by_them():
    curves = result_of("bifurcation-curves of motions")
    ax = curves.plot()
    assert plain(ax.get_title()) == "Bifurcation curves of 1-2r-2l, a motion not found"
    assert legend(ax) == ["Neimark-Sacker (NS) of 1-2r-2l", "graze (GR) of 1-2r-2l"]


def test_curves_that_are_no_borders_are_drawn_on_request():
    curves = result_of("bifurcation-curves")
    assert legend(curves.plot()) == [f"{name} of 1-1r-(-1)l" for name in ("saddle-node (SN)", "graze (GR)")]
    assert "period doubling (PD) of 1-1r-(-1)l" in legend(curves.plot(admissible=False))
    umap = result_of("unfolding-maps")
    ax = umap.plot(curves=curves)
    assert "graze (GR) of 1-1r-(-1)l" in legend(ax)
    both = umap.plot(curves=[curves, result_of("bifurcation-curves of motions")])
    assert {"Neimark-Sacker (NS) of 1-2r-2l", "graze (GR) of 1-1r-(-1)l"} < set(legend(both))
    many = [
        replace(curves.curves[0], motion=f"{n}-1r-0l", type=kind) for n in range(1, 5) for kind in ("SN", "GR", "PD")
    ]
    apart = legend(replace(curves, curves=tuple(many)).plot(admissible=False))
    assert {"saddle-node (SN)", "of 1-1r-0l", "of 4-1r-0l"} < set(apart)
    assert len(apart) <= 3 + 4 + 1
    assert ax.get_xlim() == pytest.approx((0.175, 0.325))


def test_a_diagram_draws_its_borders_by_their_explanations():
    result = result_of("unfolding-diagrams")
    ax = result.plot()
    entries = legend(ax)
    for text in (
        CURVE,
        "saddle-node (SN), 1 curve",
        "basin boundary: both motions attract (1 step)",
        "unexplained border (1 step)",
    ):
        assert entries.count(text) == 1
    assert not any("graze (GR)" in text for text in entries)  # the grazing curve is drawn as such
    line = next(line for line in ax.lines if line.get_label().startswith("saddle-node"))
    np.testing.assert_array_equal(np.isnan(line.get_ydata()), [False, True, False])
    drawn = [collection.get_segments() for collection in ax.collections if hasattr(collection, "get_segments")]
    between = [np.round(segments[0], 6).tolist() for segments in drawn[::2]]
    # between rows 0 and 1 of column 1, and between columns 0 and 1 of row 0
    assert between == [[[0.225, 1.55], [0.275, 1.55]], [[0.225, 1.45], [0.225, 1.55]]]
    bare = type(result).from_document({k: v for k, v in result._document.items() if k != "borders"}, result.meta)
    assert "saddle-node (SN) of 1-1r-(-1)l" in legend(bare.plot())


@pytest.mark.parametrize("process", every_fourth(name for name in DRAWN if name not in ("trajectories", MANY)))
def test_on_the_caller_s_axes_nothing_is_drawn_outside_of_them(process):
    figure = new_figure(8, 4)
    left, right = figure.subplots(1, 2)
    right.plot([0.0, 1.0])
    result = result_of(process)
    assert result.plot(left) is left
    assert figure.axes == [left, right]
    figure.canvas.draw()
    shown = left.get_legend()
    if shown is not None:
        inside, box = shown.get_window_extent(), left.get_window_extent()
        assert box.x0 <= inside.x0 <= inside.x1 <= box.x1
    assert (left.get_title() != "") == (left.get_xlabel() != "") == True  # noqa: E712


def test_a_trajectory_is_drawn_on_two_given_axes_or_its_time_history_on_one():
    result = result_of("trajectories")
    figure = new_figure(8, 4)
    pair = tuple(figure.subplots(1, 2))
    assert tuple(result.plot(pair)) == pair
    assert figure.get_suptitle() == ""
    assert "Mass 1" in pair[0].get_title()
    assert all(ax.get_legend() is None for ax in result.plot(tuple(new_figure(8, 4).subplots(1, 2)), legend="none"))
    alone = new_figure(8, 4).add_subplot()
    assert result.plot(alone).history is alone
    assert alone.figure.axes == [alone]
    # with a legend outside, nothing else of the caller's figure changes
    mine = new_figure(8, 4)
    mine.suptitle("mine")
    result.plot(tuple(mine.subplots(1, 2)), legend="outside")
    assert mine.get_suptitle() == "mine"


def test_names_of_regions_are_written_in_a_colour_that_their_ground_shows():
    umap = map_of([(1, 1, 1), (2, 1, 1)])
    left, right = sorted(umap.plot().texts, key=lambda text: text.get_position()[0])
    assert (left.get_color(), right.get_color()) == (palette.INK, palette.PAPER)


def test_the_name_of_a_region_is_beside_a_curve_that_crosses_it():
    curve = result_of("grazing-curves")
    umap = map_of([(1, 1, 1), (2, 1, 1)])
    alone = umap.plot()
    middle = alone.texts[0].get_position()[1]
    crossed = umap.plot(curve=replace(curve, clearance=np.full_like(curve.clearance, middle)))
    for ax in (alone, crossed):
        ax.figure.draw_without_rendering()
    assert len(alone.texts) == len(crossed.texts) == 2
    up = crossed.transData.transform((0.0, middle))[1]
    for text in crossed.texts:
        box = text.get_window_extent()
        assert not box.y0 < up < box.y1


def test_where_nothing_was_found_nothing_but_the_reason_is_drawn():
    nothing = {"converged": False, "reason": "steps become too short"}
    ax = result_of("periodic-orbits", nothing).plot()
    assert not ax.lines
    assert not ax.axison
    assert [text.get_text() for text in ax.texts] == ["no orbit was found: steps become too short"]


def test_the_title_of_a_map_says_where_trajectories_start():
    umap = result_of("unfolding-maps")
    assert "from rest" in umap.plot().get_title()
    swept = {**umap.meta, "request": {**umap.meta["request"], "policy": "sweep-down"}}
    assert "sweep-down" in replace(umap, meta=swept).plot().get_title()


def test_a_branch_says_where_its_motions_are_stable_and_at_what_they_end():
    branch = result_of("orbit-branches")
    stretches = branch.stretches()
    assert {stretch.kind for stretch in stretches} == {"stable", "unstable", "not admissible"}
    assert [stretch.ends for stretch in stretches[:-1]] == [stretch.begins for stretch in stretches[1:]]
    assert (stretches[0].begins, stretches[0].at_begin) == (branch.parameter[0], branch.ends[0])
    assert (stretches[-1].ends, stretches[-1].at_end) == (branch.parameter[-1], branch.ends[-1])
    special = {point.type: point.parameter for point in branch.special_points}
    assert all(stretch.ends == special[stretch.at_end] for stretch in stretches[:-1] if stretch.at_end)
    assert branch.to_dataframe("stretches")["kind"].tolist() == [stretch.kind for stretch in stretches]


def ticks(axis, draw: bool = True) -> dict[str, float]:
    """Return the places of the ticks of an axis by their texts, which are there when the figure is drawn."""
    if draw:
        axis.figure.canvas.draw()
    return {
        label.get_text().replace("\N{MINUS SIGN}", "-"): float(place)
        for label, place in zip(axis.get_ticklabels(), axis.get_ticklocs(), strict=True)
        if label.get_text()
    }


def factors(ax) -> tuple[float, float]:
    """Return the factors from SI to the units of axes, which are in Hz, rpm and mm."""
    by_unit = {"Hz": 1.0 / (2.0 * np.pi), "rpm": 30.0 / np.pi, "mm": 1e3}
    across, up = (by_unit.get(axis.get_units(), 1.0) for axis in (ax.xaxis, ax.yaxis))
    return across, up


def line_of(ax):
    """Return the grazing curve on axes."""
    return next(line for line in ax.lines if line.get_label() == CURVE)


def test_a_line_and_a_log_scale_are_in_the_units_of_the_axes():
    curve = in_si("grazing-curves").in_units("rpm", "mm")
    ax = curve.plot(points=False)
    drawn = line_of(ax)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"forcing frequency $\omega/2\pi$ (rpm)", "clearance $b$ (mm)")
    np.testing.assert_allclose(drawn.get_xydata(), np.column_stack([curve.omega, curve.clearance]) * factors(ax))
    assert factors(ax) == (30.0 / np.pi, 1e3)
    line, limits = ax.axhline(1600.0), ax.get_xlim()
    ax.set_yscale("log")
    ax.set_ylim(1e3, 1e4)
    heights = drawn.get_transform().transform(drawn.get_xydata())[:, 1]
    (_, across), _ = line.get_transform().transform(line.get_xydata())
    np.testing.assert_array_equal(heights > across, curve.clearance > 1.6)
    assert ticks(ax.yaxis)[r"$\mathdefault{10^{3}}$"] == 1e3
    assert ax.get_xlim() == limits
    assert pickle.loads(pickle.dumps(ax.figure)).axes[0].xaxis.get_units() == "rpm"


def test_results_on_one_axes_have_the_units_of_the_first():
    umap, curve, points = (in_si(name) for name in ("unfolding-maps", "grazing-curves", "codimension-two-points"))
    at = np.column_stack([curve.omega, curve.clearance])
    for first, second, units in (
        (("Hz", "mm"), ("rpm", "m"), ("Hz", "mm")),
        (("rpm",), ("Hz", "mm"), ("rpm", "m")),
        ((), ("Hz", "mm"), ("rad/s", "m")),
    ):
        ax = umap.in_units(*first).plot()
        before, cells = ax.get_title(), ax.collections[0].get_coordinates().copy()
        over = curve.in_units(*second).plot(ax, points=False)
        assert over is ax
        assert (ax.xaxis.get_units(), ax.yaxis.get_units()) == units
        assert ax.get_ylabel().endswith(f"({units[1]})")
        np.testing.assert_allclose(line_of(ax).get_xydata(), at * factors(ax))
        np.testing.assert_array_equal(ax.collections[0].get_coordinates(), cells)
        whole = umap.in_units(*first).plot(curve=curve.in_units(*second), points=points.in_units(*second))
        np.testing.assert_allclose(line_of(whole).get_xydata(), at * factors(ax))
        assert whole.get_title() == before


def test_axes_that_share_an_axis_have_one_unit_and_empty_axes_take_any():
    upper, lower = new_figure(5, 5).subplots(2, 1, sharex=True)
    in_si("grazing-curves").in_units("rpm", "mm").plot(upper)
    in_si("codimension-two-points").in_units("Hz").plot(lower)
    assert upper.get_xlabel() == lower.get_xlabel() == r"forcing frequency $\omega/2\pi$ (rpm)"
    assert (upper.get_ylabel(), lower.get_ylabel()) == ("clearance $b$ (mm)", "clearance $b$ (m)")
    upper.clear()
    lower.clear()
    assert in_si("grazing-curves").plot(upper).get_xlabel().endswith("(rad/s)")
    ax = new_figure(5, 5).add_subplot()
    result_of("grazing-curves").plot(ax)
    assert in_si("grazing-curves").in_units("Hz").plot(ax).get_xlabel().endswith("(Hz)")


def places(figure) -> list[np.ndarray]:
    """Return where everything on the axes of a figure is, as shares of the width and height, and what colours show."""
    insets = [inset for ax in figure.axes for inset in ax.child_axes]
    parts = []
    for ax in [*figure.axes, *insets]:
        shares = ax.transData - ax.transAxes
        parts += [(line.get_transform() - ax.transAxes).transform(line.get_xydata()) for line in ax.lines]
        parts += [shares.transform(text.xy) for text in ax.texts if isinstance(text, Annotation)]
        parts += [
            (text.get_transform() - ax.transAxes).transform(text.get_position())
            for text in ax.texts
            if not isinstance(text, Annotation)
        ]
        for drawn in ax.collections:
            if isinstance(drawn, QuadMesh):
                corners = drawn.get_coordinates().reshape(-1, 2)
            elif isinstance(drawn, PathCollection):
                corners = drawn.get_offsets()
            else:
                corners = np.concatenate([np.empty((0, 2)), *(path.vertices for path in drawn.get_paths())])
            parts.append(shares.transform(np.ma.filled(corners, np.nan)))
            if drawn.get_array() is not None:
                parts.append(np.ma.filled(drawn.norm(drawn.get_array()), np.nan))
    return parts


@pytest.mark.parametrize("units", [("Hz", "mm"), pytest.param(("rpm", "mm"), marks=pytest.mark.thorough)])
@pytest.mark.parametrize("style", ["screen", pytest.param("column", marks=pytest.mark.thorough)])
@pytest.mark.parametrize("process", every_fourth(IN_UNITS))
def test_a_picture_in_other_units_differs_in_its_numbers_only(process, style, units):
    plots()
    plain = in_si(process)
    methods = {name for kind, name in PICTURES if kind is type(plain)} - (
        {"plot_computed"} if process != ADAPTIVE else set()
    )
    for method in methods:
        figures = []
        for result in (plain, plain.in_units(*units)):
            drawn = getattr(result, method)(style=style, labels=False, legend="inside")
            figures.append((drawn[0] if isinstance(drawn, tuple) else drawn).figure)
            figures[-1].canvas.draw()
        for before, after in zip(*(figure.axes for figure in figures), strict=True):
            across, up = factors(after)
            np.testing.assert_allclose(after.get_xlim(), np.multiply(before.get_xlim(), across), atol=1e-15)
            np.testing.assert_allclose(after.get_ylim(), np.multiply(before.get_ylim(), up), atol=1e-15)
        for expected, actual in zip(*map(places, figures), strict=True):
            np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("process", every_fourth(IN_UNITS))
@pytest.mark.parametrize("labels", [True, pytest.param(False, marks=pytest.mark.thorough)])
def test_no_picture_is_left_in_radians_per_second_or_metres(process, labels):
    drawn = in_si(process).plot(labels=labels, engineering_units=True)
    pair = drawn if isinstance(drawn, tuple) else (drawn,)
    texts = texts_of(pair)
    for ax in pair:
        for axis in (ax.xaxis, ax.yaxis):
            assert axis.get_units() not in ("rad/s", "m")
            if axis.get_units() in ("Hz", "mm") and axis.get_scale() == "linear":
                shown = ticks(axis, draw=False)
                np.testing.assert_allclose([float(text) for text in shown], list(shown.values()), rtol=1e-9)
                assert len({len(text.partition(".")[2]) for text in shown}) == 1
    assert not [text for text in texts if "rad/s" in text or "(m)" in text or text.endswith(" m")]
    assert any(axis.get_units() for ax in pair for axis in (ax.xaxis, ax.yaxis))
    other = result_of(process).plot(labels=labels)
    for ax, plain in zip(pair, other if isinstance(other, tuple) else (other,), strict=True):
        np.testing.assert_allclose(ax.get_xlim(), np.array(plain.get_xlim()) * factors(ax)[0])


def texts_of(pair) -> list[str]:
    """Draw axes of one figure, and return their titles, labels and ticks."""
    pair[0].figure.canvas.draw()
    texts = [pair[0].figure.get_suptitle()]
    for ax in pair:
        texts += [ax.get_title(), ax.get_xlabel(), ax.get_ylabel(), *ticks(ax.xaxis, False), *ticks(ax.yaxis, False)]
    return texts


@pytest.mark.parametrize(
    ("process", "method", "keywords", "text"),
    [
        ("unfolding-maps", "plot_computed", {}, "not adaptive"),
        ("unfolding-maps", "plot", {"colours": {"1-2r-2l": "no colour"}}, "no colour"),
        ("trajectories", "plot", {"mass": 4}, "1 to 3"),
        (MANY, "plot", {"mass": 4}, "1 to 3"),
        ("trajectories", "plot", {"legend": "nowhere"}, "outside, inside, none"),
        ("grazing-curves", "plot", {"engineering_units": True}, "nondimensional result has no Hz or mm"),
        ("grazing-curves", "plot", {"style": "poster"}, "screen or column"),
        ("bifurcation-diagrams", "plot", {"quantity": "energy"}, "displacement, velocity, impact_velocity"),
    ],
)
def test_a_picture_that_is_refused_leaves_no_figure(process, method, keywords, text):
    before = pyplot.get_fignums()
    with pytest.raises(ValueError, match=text):
        getattr(result_of(process), method)(**keywords)
    assert pyplot.get_fignums() == before


def test_names_of_regions_and_quantities_are_in_the_shown_units():
    umap = map_of([(1, 1, 1), (2, 2, 2), (1, 2, 3)])
    request = {**umap.meta["request"], "oscillator": {**umap.meta["request"]["oscillator"], "units": "SI"}}
    umap = replace(umap, meta={**umap.meta, "request": request}).in_units("rpm", "mm")
    ax = umap.plot()
    assert len(ax.texts) == 3
    assert all(1000.0 < text.get_position()[1] < 2000.0 for text in ax.texts)
    for text, left in zip(sorted(ax.texts, key=lambda text: text.get_position()), (0.2, 7 / 30, 4 / 15), strict=True):
        assert left < text.get_position()[0] * np.pi / 30.0 < left + 1 / 30
    quantity = Quantity(np.full(umap.kind.shape, 0.25), "drop", "m")
    options = dict.fromkeys(("curve", "points", "curves"))
    ax = draw(umap, None, {}, quantity=quantity, **options, motions=1, colours=None, merge_mirror_images=False)
    (drawn,) = ax.collections
    assert drawn.colorbar.ax.get_ylabel() == "drop (mm)"
    np.testing.assert_array_equal(drawn.get_array(), 250.0)


def test_curves_over_a_quantity_of_a_map_are_named_in_its_legend():
    umap, curve = result_of("unfolding-maps"), result_of("grazing-curves")
    quantity = Quantity(np.full(umap.kind.shape, 0.25), "drop", "m")
    others = {"points": None, "curves": None, "motions": 1, "colours": None, "merge_mirror_images": False}
    assert draw(umap, None, {}, quantity=quantity, curve=None, **others).get_legend() is None
    ax = draw(umap, None, {}, quantity=quantity, curve=curve, **others)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["grazing curve $b = A(\\omega)$"]


def test_titles_and_colour_bars_are_in_the_shown_units():
    history, _ = in_si("trajectories").plot(engineering_units=True)
    assert r"at $\omega/2\pi$ = 0.046155 Hz, $b$ = 1600 mm" in history.figure.get_suptitle()
    branch = in_si("orbit-branches")
    for where in ("outside", "inside"):
        drawn = branch.plot_multipliers(legend=where, engineering_units=True).collections[-1]
        axis = drawn.colorbar.ax.yaxis if where == "outside" else drawn.colorbar.ax.xaxis
        assert "clearance $b$ (mm)" in (drawn.colorbar.ax.get_ylabel(), drawn.colorbar.ax.get_title())
        assert ticks(axis)["1800"] == 1800.0
        assert set(drawn.get_array()) <= set(1e3 * branch.parameter)


def test_values_in_titles_are_converted_from_the_request_not_from_their_text():
    result = in_si("basins")
    result.meta["request"]["omega"] = 2.0 * np.pi * 1.23455001  # the 7.7569 rad/s of the title are 1.2345 Hz
    assert r"$\omega$ = 7.7569 rad/s" in result.plot().get_title()
    assert r"$\omega/2\pi$ = 1.2346 Hz" in result.plot(engineering_units=True).get_title()


def test_saved_pictures_are_drawn_in_engineering_units_and_others_are_not(tmp_path):
    process, texts = "discontinuity-mappings", {}
    for units, result in (("SI", in_si(process)), ("none", result_of(process))):
        path = tmp_path / f"{units}.svg"
        with pyplot.rc_context({"svg.fonttype": "none"}):
            save_picture(result.in_units("Hz", "mm") if units == "SI" else result, path)
        texts[units] = path.read_text("utf-8")
    assert "overshoot (mm)" in texts["SI"]
    assert "(mm)" not in texts["none"]
    assert in_si(process).plot().get_xlabel() == "overshoot (m)"


@pytest.mark.parametrize("process", DRAWN)
def test_every_method_that_draws_has_a_picture_and_the_keywords_of_all_pictures(process):
    plots()
    result = result_of(process)
    kind = type(result)
    methods = [name for name in dir(kind) if name.startswith("plot")]
    assert methods == sorted(name for drawn, name in PICTURES if drawn is kind)
    for name in methods:
        keywords = list(inspect.signature(getattr(kind, name)).parameters.values())[-4:]
        expected = [("legend", None), ("labels", True), ("engineering_units", False), ("style", "screen")]
        assert [(keyword.name, keyword.default) for keyword in keywords] == expected
        with pytest.raises(TypeError, match=rf"{kind.__name__}\.{name}\(\).*'nonsense'"):
            getattr(result, name)(nonsense=1)


@pytest.mark.parametrize("process", DRAWN)
def test_without_labels_and_a_legend_there_is_no_text_inside_the_axes(process):
    result = result_of(process)
    for name in ("plot", "plot_unfolding", "plot_multipliers"):
        if hasattr(result, name):
            drawn = getattr(result, name)(labels=False, legend="none")
            for ax in drawn[0].figure.axes if isinstance(drawn, tuple) else drawn.figure.axes:
                assert ax.get_legend() is None
                for panel in (ax, *ax.child_axes):
                    texts = [*(text.get_text() for text in panel.texts)]
                    assert not any([*texts, panel.get_title(), panel.get_xlabel(), panel.get_ylabel()]), texts


def test_on_axes_of_middle_size_a_legend_keeps_the_largest_shares():
    counts = [(1, 1, 1)] * 4 + [(2, 3, 3)] * 3 + [(1, n, n + 1) for n in range(23)]
    umap, curve = map_of(counts), result_of("grazing-curves")
    ax = umap.plot(new_figure(5, 4).add_subplot(), curve=curve)
    entries = legend(ax)
    assert {"1-1r-1l (13.3%)", "2-3r-3l (10.0%)", CURVE} < set(entries)
    assert entries[-1] == f"and {22 - len(entries) + 1} more"
    inside, box = ax.get_legend().get_window_extent(), ax.get_window_extent()
    assert 0.4 * box.height < inside.height <= 0.6 * box.height
    assert len(legend(umap.plot(curve=curve))) == 22
    assert len(legend(umap.plot(new_figure(5, 4).add_subplot(), curve=curve, legend="inside"))) == 22
    assert umap.plot(new_figure(1.5, 1).add_subplot()).get_legend() is None


def looks(ax) -> list[tuple[str, ...]]:
    """Return what the entries of a legend look like."""
    names = ("color", "marker", "linestyle", "markerfacecolor")
    handles, _ = ax.get_legend_handles_labels()
    dashes = [str(handle._unscaled_dash_pattern) for handle in handles]
    seen = [tuple(str(getattr(handle, f"get_{name}")()) for name in names) for handle in handles]
    return [(*look, dash) for look, dash in zip(seen, dashes, strict=True)]


def many_motions(kind: str) -> list:
    """Return pictures of more motions than there are colours."""
    count = len(areas_and_lines()[0]) + 5
    named = [periodic(9, n, n) for n in range(count)]
    if kind == "map":
        umap = map_of([(9, n, n) for n in range(count)])
        return [umap.plot(motions=count), umap.plot(motions=count, merge_mirror_images=True)]
    if kind == "basins":
        axes = {"horizontal": np.linspace(-1.0, 1.0, count), "vertical": [-0.5, 0.5]}
        attractors = [{**name, "share": 1 / count} for name in named]
        label = np.arange(2 * count).reshape(2, count) % count
        return [result_like("Basins", **axes, label=label, attractors=attractors, reasons=[""]).plot()]
    if kind == "fractions":
        share, sizes = np.full((count, 2), 1.0 / count), {"mass": 3, "end": 2}
        fractions = result_like("BasinFractions", sizes, parameter=[1.5, 1.6], attractors=named, share=share)
        return [fractions.plot(motions=count)]
    if kind == "diagram":
        sections = [{"displacement": [0.1], "impact_velocity": [0.5], "motion": name} for name in named]
        parameter = np.linspace(1.5, 1.6, count)
        return [result_like("BifurcationDiagram", parameter=parameter, sections=sections).plot(motions=count)]
    result = result_of(MANY)
    first = result.trajectories[0]
    some = [replace(first, motion=replace(first.motion, **name)) for name in named]
    return [replace(result, trajectories=tuple(some)).plot()[0]]


@pytest.mark.parametrize("kind", ["map", "basins", "fractions", "diagram", "trajectories"])
def test_no_two_entries_of_a_legend_look_the_same_however_many_motions_there_are(kind):
    for ax in many_motions(kind):
        entries, drawn = legend(ax), looks(ax)
        assert len(set(drawn)) == len(drawn) == len(set(entries))
        assert sum("other" in entry for entry in entries) == 1


def test_orders_and_motions_beyond_the_colours_and_dashes_have_other_symbols():
    count = 40
    assert len({str(palette.dash(number)) for number in range(count)}) == count
    assert len({str(palette.order_style(order)) for order in range(1, count + 1)}) == count
    recurrence, _ = POINTS
    omega = np.linspace(0.26, 0.34, count)
    points = [
        {**recurrence, "active": True, "order": k + 1, "omega": float(omega[k]), "clearance": 1.5} for k in range(count)
    ]
    drawn = looks(result_of("codimension-two-points", {"points": points}).plot())
    assert len(set(drawn)) == len(drawn) == count + 1
    whole = document("structures")
    omega = np.linspace(0.2, 0.4, len(whole["omega"]))
    harmonics = [{**whole["harmonics"][0], "harmonic": k + 1} for k in range(count)]
    drawn = looks(result_of("structures", {"harmonics": harmonics, "omega": omega}).plot())
    assert len(set(drawn)) == len(drawn) >= count


def colour_of(ax) -> dict[str, str]:
    """Return the colours in the legend of a map by the text without the share."""
    handles, texts = ax.get_legend_handles_labels()
    return {text.rpartition(" (")[0]: handle.get_color() for handle, text in zip(handles, texts, strict=True)}


def test_two_maps_agree_on_colours_that_one_has_of_the_other():
    alone = {(7, n, n): palette.motion_colours([motion(7, n, n)])[0] for n in range(2, 30)}
    other, clash = next(pair for pair in itertools.combinations(alone, 2) if len({alone[key] for key in pair}) == 1)
    first, second = map_of([clash]), map_of([other, other, clash, (9, 5, 7)])
    text = palette.motion_text(motion(*clash))
    assert colour_of(first.plot())[text] != colour_of(second.plot())[text]
    agreed = colour_of(first.plot(colours=second.colours()))
    assert agreed[text] == colour_of(second.plot())[text] == second.colours()[motion_label(*clash)]
    assert colour_of(second.plot(colours=first.colours()))[text] == first.colours()[motion_label(*clash)]
    assert len(set(colour_of(second.plot(colours=first.colours())).values())) == 3


def test_a_map_with_fewer_motions_keeps_the_colours_of_the_others():
    # the smallest of the twenty have colours of their own, which others would take without them
    named = [(1, 1, 1), (1, 2, 2), (1, 3, 3), (1, 4, 4), (1, 5, 5), (1, 6, 6), (1, 2, 1), (1, 1, 2), (1, 2, 3)]
    umap = map_of([(7, n, n) for n in range(2, 9)] * 2 + named)
    whole, few = colour_of(umap.plot()), colour_of(umap.plot(motions=6))
    assert {text: whole[text] for text in list(few)[:6]} == {text: few[text] for text in list(few)[:6]}


def test_the_table_of_motions_and_json_have_the_colours_of_the_picture(tmp_path):
    # the smallest ones have colours of their own, which are given to others
    named = [(1, 3, 3), (1, 4, 4), (1, 5, 5), (1, 6, 6), (1, 2, 1), (1, 1, 2), (1, 2, 3)]
    umap = map_of([(1, 1, 1)] * 3 + [(1, n, n + 1) for n in range(4, 22)] * 2 + named)
    drawn = colour_of(umap.plot())
    for entry in umap.motions():
        assert entry.colour == drawn.get(palette.motion_text(entry))
    assert sum(entry.colour is None for entry in umap.motions()) == 6
    in_json = json.loads(umap.save(tmp_path / "map.json").read_text("utf-8"))["motions"]
    assert [entry["colour"] for entry in in_json] == [entry.colour or palette.OTHER for entry in umap.motions()]
    assert umap.to_dataframe("motions")["colour"][0] == palette.NAMED["1-1r-1l"]


@pytest.mark.parametrize("process", ["bifurcation-diagrams", "basins", "basin-fractions", MANY, "unfolding-diagrams"])
def test_colours_can_be_given(process):
    colours = {"unresolved": "red", "chaotic": "red", "1-1r-1l": "gold", "7-7r-7l": "#123456"}
    drawn = result_of(process).plot(colours=colours)
    ax = drawn[0] if isinstance(drawn, tuple) else drawn
    assert "#FF0000" in {line.get_color() for line in ax.lines}


def test_mirror_images_are_one_motion_on_request():
    umap = map_of([(1, 1, 1), (1, 1, 2), (1, 2, 1), (1, 2, 1), (1, INFINITE, 3), (1, 2, 1)])
    assert [entry.label for entry in umap.motions()] == ["1-2r-1l", "1-1r-1l", "1-1r-2l", "1-∞r-3l"]
    merged = umap.motions(merge_mirror_images=True)
    assert [(entry.label, entry.pixels, entry.mirror_images) for entry in merged] == [
        ("1-2r-1l", 1600, True),
        ("1-1r-1l", 400, False),
        ("1-∞r-3l", 400, True),
    ]
    assert merged[0].share == pytest.approx(4 / 6)
    np.testing.assert_array_equal(umap.mask(merged[0]), umap.mask("1-2r-1l") | umap.mask("1-1r-2l"))
    assert legend(umap.plot(merge_mirror_images=True)) == [
        "1-∞r-3l, mirror images (16.7%)",
        "1-1r-1l (16.7%)",
        "1-2r-1l, mirror images (66.7%)",
    ]


def test_low_orders_of_recurrence_are_larger_and_above():
    recurrence, _ = POINTS
    many = [{**recurrence, "omega": 0.2 + 0.0001 * k, "order": 1 + k % 8} for k in range(800)]
    ax = result_of("codimension-two-points", {"points": many}).plot()
    lines = [line for line in ax.lines if str(line.get_label()).startswith("recurrence of order")]
    sizes, heights = [line.get_markersize() for line in lines], [line.get_zorder() for line in lines]
    assert sizes[0] > sizes[1] > sizes[2] > sizes[3] > sizes[7]
    assert heights == sorted(heights, reverse=True)
    assert len(set(heights)) == 8
