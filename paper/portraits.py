"""Phase portraits of mass 1, all motions of one frequency in one picture, as in Figure 9."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from grazemap.plots.axes import axis_label, new_figure
from grazemap.plots.palette import INK, label_text
from grazemap.plots.trajectory import history_with_impacts
from grazemap.wire import motion_label
from paper.paper import Region
from paper.samples import DRAWN, Sample, short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINE, STOP = "#0072B2", "#8C8C8C"
COLUMNS = 4


def portraits(samples: Sequence[Sample]) -> Axes:
    """Draw displacement and velocity of mass 1 for each sample, with the stops; the last panel says what is what."""
    rows = -(-(len(samples) + 1) // COLUMNS)
    figure = new_figure(11.0, 3.0 * rows)
    panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True)
    for ax, sample in zip(panels.flat, samples, strict=False):
        _portrait(ax, sample)
    for ax in panels.flat[len(samples) :]:
        ax.set_axis_off()
    _legend(panels.flat[len(samples)])
    figure.supxlabel(axis_label("displacement", "nondimensional").text(), fontsize=10)
    figure.supylabel(axis_label("velocity", "nondimensional").text(), fontsize=10)
    figure.suptitle(rf"Figure 9: phase portraits of mass 1, $\omega$ = {samples[0].omega:g}", fontsize=11)
    first: Axes = panels.flat[0]
    return first


def _portrait(ax: Axes, sample: Sample) -> None:
    _, displacement, velocity = history_with_impacts(sample.path, 1)
    width = 0.25 if sample.turns is None else 1.0
    for side in (1, -1):
        ax.axvline(side * sample.clearance, color=STOP, linewidth=2.0, zorder=0)
    ax.axhline(0.0, color=INK, linewidth=0.4, zorder=0)
    ax.plot(displacement, velocity, color=LINE, linewidth=width)
    if sample.turns is not None:
        hit = sample.path.impacts
        ax.plot(hit.stop * sample.clearance, hit.velocity, ".", color="#D55E00", markersize=4)
    text = f"{named(sample)}, $b$ = {short(sample.clearance)}"
    ax.set_title(f"({sample.region.letter}) printed: {_printed(sample.region)}\n{text}", fontsize=8.5)
    ax.tick_params(labelsize=8)


def _printed(region: Region) -> str:
    if region.n is None or region.right is None or region.left is None:
        right, left = ("multi" if count is None else str(count) for count in (region.right, region.left))
        return rf"multi-{right}$_r$-{left}$_l$"
    return label_text(motion_label(region.n, region.right, region.left))


def named(sample: Sample) -> str:
    """Return a sample's label as mathtext."""
    if sample.counts is None:
        return sample.kind
    return label_text(motion_label(*sample.counts))


def _legend(ax: Axes) -> None:
    ax.plot([], [], color=LINE, linewidth=1.0, label="one period of the motion;\nwhere it does not close,\n"
            f"{DRAWN} forcing periods (thin)")  # fmt: skip
    ax.plot([], [], ".", color="#D55E00", markersize=4, label="velocity before an impact")
    ax.plot([], [], color=STOP, linewidth=2.0, label="stops C (left), A (right)")
    ax.legend(loc="center", frameon=False, fontsize=8)
