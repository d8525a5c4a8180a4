"""Pictures for a column of a journal: their size, their fonts, and that nothing is cut, covered or written over."""

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.text import Text

from grazemap.plots import save_picture
from grazemap.plots.layout import legend_below, settle
from grazemap.plots.styles import STYLES
from grazemap.results import UnfoldingMap
from grazemap.results.pictures import PICTURES, plots
from tests.support.picture_layout import faults
from tests.support.sdk_documents import ADAPTIVE, CURVES_OF_ONE, DRAWN, ONE_STOP, in_si, result_of
from tests.support.thorough import every_fourth

plots()
COLUMN = STYLES["column"]
METHODS = [
    (sample, method)
    for sample in DRAWN
    for kind, method in PICTURES
    if kind is type(result_of(sample)) and (method != "plot_computed" or sample == ADAPTIVE)
]


def figure_of(drawn):
    ax = drawn[0] if isinstance(drawn, tuple) else drawn
    return ax.get_figure(root=True)


@pytest.mark.parametrize(("sample", "method"), every_fourth(METHODS))
def test_nothing_is_cut_or_covered_on_a_screen(sample, method):
    assert faults(figure_of(getattr(result_of(sample), method)())) == []


@pytest.mark.parametrize(("sample", "method"), every_fourth([*METHODS[2:], *METHODS[:2]]))
def test_a_column_has_its_width_legible_texts_and_nothing_cut_or_covered(sample, method):
    # with units the texts are longer
    figure = figure_of(getattr(in_si(sample).in_units("rpm", "mm"), method)(style="column"))
    assert faults(figure) == []
    width, height = figure.get_size_inches()
    assert width == COLUMN.width
    assert 1.5 < height < 6.0
    sizes = {text.get_fontsize() for text in figure.findobj(Text) if text.get_text() and text.get_visible()}
    assert min(COLUMN.texts) <= min(sizes)
    assert max(sizes) <= max(COLUMN.texts)


def test_faults_of_a_layout_are_seen():
    figure, ax = pyplot.subplots(figsize=(2.0, 2.0), layout="constrained")
    ax.plot([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], label="a line")
    assert faults(figure) == []
    ax.legend(loc="center")
    ax.set_title("a title that is too long for a figure of this width")
    ax.text(0.1, 0.8, "one text")
    ax.text(0.15, 0.8, "another")
    found = " ".join(faults(figure))
    assert all(fault in found for fault in ("beyond the canvas", "covers 1 points", "'one text' and 'another' overlap"))


def many_regions(count: int = 24) -> UnfoldingMap:
    columns = np.arange(1, count + 1)
    fields = {name: np.tile(columns, (20, 1)) for name in ("impacts_right", "impacts_left")}
    shape = (20, count)
    return result_of(
        "unfolding-maps",
        {
            "omega": np.linspace(0.2, 0.3, count),
            "clearance": np.linspace(1.5, 1.6, 20),
            "kind": np.ones(shape, np.int8),
            "period": np.ones(shape, np.int32),
            **fields,
            **{name: np.zeros(shape, np.bool_) for name in ("symmetric", "sticking", "verified", "sensitive")},
            **{name: np.zeros(shape) for name in ("least_impact_velocity", "transient_growth", "settled_after")},
            "reason": np.zeros(shape, np.int8),
        },
    )


@pytest.mark.parametrize("style", STYLES)
def test_names_of_regions_and_long_legends_have_room_or_are_left_out(style):
    umap = many_regions()
    for curves in ({}, {"curve": result_of("grazing-curves"), "curves": result_of("bifurcation-curves")}):
        assert faults(figure_of(umap.plot(**curves, style=style))) == []


def test_axes_of_the_caller_keep_their_figure_and_what_is_on_it():
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(7.0, 2.5), layout="constrained")
    (own,) = left.plot([0.2, 0.3], [1.5, 1.6], linewidth=3.0)
    result_of("orbit-branches").plot(right, style="column")
    result_of("grazing-curves").plot(left, style="column")
    assert tuple(figure.get_size_inches()) == (7.0, 2.5)
    assert own.get_linewidth() == 3.0
    assert left.lines[1].get_linewidth() < 1.0
    assert faults(figure) == []


@pytest.mark.parametrize("style", STYLES)
def test_a_long_title_is_broken_on_small_axes_of_the_caller(style):
    ax = pyplot.figure(figsize=(3.4, 2.6), layout="constrained").add_subplot()
    result_of("unfolding-maps").plot(ax, style=style)
    title = ax.title.get_window_extent()
    ax.figure.canvas.draw()
    assert 0.0 <= title.x0 < title.x1 <= ax.figure.bbox.width
    assert [fault for fault in faults(ax.figure) if "canvas" in fault] == []


def test_a_legend_inside_keeps_off_the_data_and_one_outside_leaves_room_for_the_axes():
    branch = result_of("orbit-branches")
    ax = pyplot.figure(figsize=(5.0, 4.0), layout="constrained").add_subplot()
    branch.plot(ax)
    assert faults(ax.figure) == []
    narrow = pyplot.figure(figsize=(3.4, 3.4), layout="constrained").add_subplot()
    branch.plot(narrow, legend="outside")
    narrow.figure.canvas.draw()
    assert narrow.get_window_extent().width > 0.6 * narrow.figure.bbox.width
    assert faults(narrow.figure) == []


def test_a_legend_below_has_columns_also_where_one_text_is_long():
    ax = pyplot.figure(figsize=(COLUMN.width, 2.6), layout="constrained").add_subplot()
    names = [f"curve {number}" for number in range(7)] + ["a curve with a name that is long, so that it has two lines"]
    lines = [ax.plot([0.0, 1.0], [number, number], label=name)[0] for number, name in enumerate(names)]
    settle(ax.figure)
    alone = ax.legend(lines, names, fontsize=COLUMN.legend, labelspacing=0.0).get_window_extent()
    legend = legend_below(ax, lines, names, fontsize=COLUMN.legend)
    assert legend.get_window_extent().height < 0.6 * alone.height
    assert legend.get_window_extent().width <= ax.figure.bbox.width
    assert [text.get_text() for text in legend.get_texts()][:7] == names[:7]
    assert " ".join(legend.get_texts()[-1].get_text().split()) == names[-1]


def test_impact_speeds_do_not_run_below_zero():
    ax = result_of("orbit-branches").plot(style="column")
    ax.figure.canvas.draw()
    low, high = ax.get_ylim()
    assert low < 0.0 < high
    assert min(place for place in ax.get_yticks() if low <= place <= high) == 0.0


@pytest.mark.parametrize("sample", ["unfolding-maps", "grazing-curves"])
def test_a_pdf_has_pixels_for_dense_pictures_only(sample, tmp_path):
    save_picture(result_of(sample), tmp_path / "x.pdf", style="column")
    content = (tmp_path / "x.pdf").read_bytes()
    assert (b"/Subtype /Image" in content) == (sample == "unfolding-maps")
    assert b"/Subtype /Type3" not in content


def test_curves_of_one_stop_are_drawn_over_its_map():
    curve = result_of(ONE_STOP)
    umap = result_of("unfolding-maps")
    assert umap.plot(curve=curve, style="column").get_legend() is not None
    assert curve.at(0.25) == curve.at([0.25])[0]
    label = result_of(CURVES_OF_ONE).plot(style="column").get_ylabel()
    assert " ".join(label.split()) == "clearance $b$ of the right stop"


def test_a_quantity_that_was_not_asked_for_says_how_to_ask():
    with pytest.raises(ValueError, match=r'observables=\["dissipated_power"\]'):
        result_of("unfolding-maps").plot("dissipated_power")
