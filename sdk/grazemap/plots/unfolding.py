"""The unfolding map: regions of a plane of two parameters, coloured by the motion there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.colours import colours_of_map
from grazemap.plots.axes import Drawing, cell_borders, chance_text, draws, legend_square, rimmed, share_text
from grazemap.plots.hatching import hatch_sensitive
from grazemap.plots.layout import Name, points_of
from grazemap.plots.map_axes import describe_map, draw_curves_and_points, leave_out_of_legend
from grazemap.plots.observables import plot_over_plane
from grazemap.plots.palette import INK, OTHER, PAPER, entry_text, hexadecimal, is_dark, is_without_impacts, motion_text
from grazemap.plots.pen import Pen
from grazemap.results import (
    BifurcationCurves,
    CodimensionTwoPoints,
    GrazingCurve,
    MotionShare,
    StopGrazingCurves,
    UnfoldingMap,
)
from grazemap.results.observables import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# A region is named in the picture where a square of this share of the map's shorter side fits into it.
_NAMED_REGION = 0.05
# At least so many points fit along its side.
_LEAST_ROOM = 3
# The room for a name is so many times as wide as it is high, on axes that are as wide as they are high.
_WIDE_ROOM = 2.8
# A map with more points than this is drawn as an image, and its regions are measured on a coarser grid.
_MAX_CELLS = 1 << 20
_MEASURED_SIDE = 1024
_INFERRED = OTHER


@draws(UnfoldingMap, width=10.5, height=6.5)
def plot_unfolding_map(
    umap: UnfoldingMap,
    drawing: Drawing,
    *,
    quantity: Quantity | None = None,
    curve: GrazingCurve | StopGrazingCurves | None = None,
    points: CodimensionTwoPoints | None = None,
    curves: BifurcationCurves | Sequence[BifurcationCurves] | None = None,
    motions: int,
    colours: Mapping[str, str] | None,
    merge_mirror_images: bool,
    hatching: bool = True,
    title: str | None = None,
    overlay: Callable[[Pen], None] | None = None,
    margins: bool = True,
) -> Axes:
    """Draw the regions of a map, or a quantity, and over them the curves and points; see `UnfoldingMap.plot`.

    All motions without a colour of their own are drawn as "other". Of `curves` those of admissible motions are drawn.
    `overlay` is called before the legend is made, and draws more with the pen. With `margins` the grazing curves of a
    map with axes are drawn: the lines on which its margins are 0.
    """
    if quantity is not None:
        return plot_over_plane(umap, drawing, quantity, curve, points, curves)
    ax = drawing.ax
    shares = umap.motions(merge_mirror_images=merge_mirror_images)
    assigned = colours_of_map(
        [motion.label for motion in shares], [motion.kind for motion in shares], motions, hexadecimal(colours)
    )
    coloured = {motion: colour for motion, colour in zip(shares, assigned, strict=True) if colour is not None}
    shown = {motion: coloured[motion] for motion in sorted(coloured, key=_place_in_legend)}
    pen = describe_map(umap, drawing, _title(umap) if title is None else title)
    shares_of_entries = _draw_regions(pen, umap, shown, [motion for motion in shares if motion not in shown])
    if hatching:
        hatch_sensitive(pen, umap.horizontal, umap.vertical, umap.sensitive)
    drawn_before = len(ax.lines)
    across, up = cell_borders(umap.horizontal), cell_borders(umap.vertical)
    draw_curves_and_points(pen, umap, curve, points, curves, margins)
    if overlay is not None:
        overlay(pen)
    pen.set_xlim(across[0], across[-1])
    pen.set_ylim(up[0], up[-1])
    if drawing.labels:
        free = ~_crossed(pen, umap, drawn_before)
        for motion, colour in shown.items():
            if motion.kind == "periodic":
                _name_region(drawing, pen, umap, motion, colour, free)
    leave_out_of_legend(ax)
    # curves are told apart by their dashes
    drawing.show_legend(shares_of_entries, handlelength=1.4 if curves is None else 2.6, labelspacing=0.35)
    return ax


def _title(umap: UnfoldingMap) -> str:
    what = "Unfolding map" if not umap.preview else "Preview of an unfolding map"
    policy = umap.meta["request"].get("policy", "rest")
    start = {"rest": "from rest", "ensemble": "from random states"}.get(policy, policy)
    return f"{what}: motions $n$-$p_r$-$q_l$ {start}, {len(umap.vertical)} × {len(umap.horizontal)} points"


@draws(UnfoldingMap, "plot_computed", width=8.0, height=6.5)
def plot_computed(umap: UnfoldingMap, drawing: Drawing) -> Axes:
    """Draw which points of an adaptive map were computed, on axes like those of the map.

    Raises
    ------
    ValueError
        The map is not adaptive.
    """
    if umap.computed is None:
        raise ValueError("every point of this map was computed: it is not adaptive")
    ax = drawing.ax
    codes = umap.computed.astype(np.int8)
    pen = describe_map(umap, drawing, f"Computed points of {len(umap.vertical)} × {len(umap.horizontal)}")
    _draw_codes(pen, umap, codes, [_INFERRED, INK])
    computed = umap.computed.mean()
    sample = umap.inferred_wrong
    wrong = "" if sample is None else f"\n{sample.wrong} of {sample.sampled} in a sample wrong"
    legend_square(ax, INK, f"computed ({computed:.1%})", edge=1.0)
    legend_square(ax, _INFERRED, f"inferred ({1.0 - computed:.1%}){wrong}", edge=1.0)
    drawing.show_legend(handlelength=1.4)
    return ax


def _draw_regions(
    pen: Pen, umap: UnfoldingMap, shown: Mapping[MotionShare, str], rest: list[MotionShare]
) -> dict[str, float]:
    """Draw the regions, and return the entries of the legend with their shares."""
    entries = {
        f"{entry_text(motion)}{_images(motion)} ({share_text(motion.share)})"
        f"{chance_text(motion.kind, umap.chance_to_settle)}": motion.share
        for motion in shown
    }
    colours = list(shown.values())
    codes = np.full(umap.kind.shape, len(shown), dtype=np.int16)
    for code, motion in enumerate(shown):
        codes[umap.mask(motion)] = code
    if rest:
        share = sum(motion.share for motion in rest)
        entries[f"{len(rest)} other motions ({share:.1%})"] = share
        colours.append(OTHER)
    _draw_codes(pen, umap, codes, colours)
    for colour, text in zip(colours, entries, strict=True):
        legend_square(pen.ax, colour, text)
    return entries


def _images(motion: MotionShare) -> str:
    return ", mirror images" if motion.mirror_images else ""


def _draw_codes(pen: Pen, umap: UnfoldingMap, codes: NDArray[np.integer[Any]], colours: list[str]) -> None:
    """Colour every point by its code."""
    from matplotlib.colors import ListedColormap

    draw = pen.pcolormesh if codes.size <= _MAX_CELLS else pen.pcolorfast
    draw(
        cell_borders(umap.horizontal),
        cell_borders(umap.vertical),
        codes,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        rasterized=True,
    )


def _place_in_legend(motion: MotionShare) -> tuple[bool, str, int, int, int]:
    right, left = motion.impacts_right or 0, motion.impacts_left or 0
    return motion.kind != "periodic", motion.kind, motion.period or 0, right + left, -right


def _crossed(pen: Pen, umap: UnfoldingMap, drawn_before: int) -> NDArray[np.bool_]:
    """Return which points of a map a curve or a symbol passes; `drawn_before` as in `points_of`."""
    places = pen.places(pen.ax.transData.inverted().transform(points_of(pen.ax, drawn_before)))
    crossed = np.zeros(umap.kind.shape, dtype=np.bool_)
    columns, rows = _cells_at(umap, places)
    crossed[rows, columns] = True
    return crossed


def _cells_at(umap: UnfoldingMap, places: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """Return the columns and the rows of the points of a map that are nearest to places in SI, (n, 2)."""
    cells = zip((umap.horizontal, umap.vertical), places.T, strict=True)
    return [(np.searchsorted(cell_borders(values), at) - 1).clip(0, len(values) - 1) for values, at in cells]


def _name_region(
    drawing: Drawing, pen: Pen, umap: UnfoldingMap, motion: MotionShare, ground: str, free: NDArray[np.bool_]
) -> None:
    """Write a motion's label in the middle of its region, if that is large enough to read.

    It is beside curves where there is room: on points that are `free` of them, of the shape of the map.
    """
    step = -(-max(umap.kind.shape) // _MEASURED_SIDE)
    mask = umap.mask(motion)[::step, ::step]
    row, column, side = _largest_room(mask & free[::step, ::step])
    if side < max(_LEAST_ROOM, _NAMED_REGION * mask.shape[0]):
        row, column, side = largest_square(mask)
    if side < max(_LEAST_ROOM, _NAMED_REGION * min(mask.shape)):
        return
    row, column = step * row, step * column
    name = pen.text(
        float(umap.horizontal[column]),
        float(umap.vertical[row]),
        "no impacts" if is_without_impacts(motion) else motion_text(motion),
        ha="center",
        va="center",
        fontsize=8,
        color=PAPER if is_dark(ground) else INK,
        path_effects=rimmed(2.0, ground)[:1],
        zorder=4,
    )

    def is_there(shown: NDArray[np.float64]) -> NDArray[np.bool_]:
        columns, rows = _cells_at(umap, pen.places(shown))
        inside: NDArray[np.bool_] = umap.mask(motion)[rows, columns]
        return inside

    drawing.names.append(Name(name, is_there))


def _largest_room(mask: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Return (row, column, height) of the middle of the largest room for a name among true entries; 0 for none."""
    rows, columns = mask.shape
    wide = max(1, round(_WIDE_ROOM * columns / rows))
    blocks: NDArray[np.bool_] = np.all(mask[:, : columns // wide * wide].reshape(rows, -1, wide), axis=2)
    row, column, height = largest_square(blocks) if blocks.size else (0, 0, 0)
    return row, wide * column + wide // 2, height


def largest_square(mask: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Return (row, column, side) of the middle of the largest square of true entries; the side is 0 for none.

    Of several it is the most central.
    """
    sides = np.zeros(mask.shape, dtype=np.int64)
    remaining, side = mask, 0
    while remaining.any():
        side += 1
        sides[remaining] = side
        smaller = np.zeros_like(remaining)
        smaller[1:, 1:] = remaining[1:, 1:] & remaining[:-1, 1:] & remaining[1:, :-1] & remaining[:-1, :-1]
        remaining = smaller
    largest = int(sides.max())
    places = np.argwhere(sides == largest)
    row, column = places[np.argmin(np.sum((places - places.mean(axis=0)) ** 2, axis=1))].tolist()
    return row - largest // 2, column - largest // 2, largest
