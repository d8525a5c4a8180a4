"""The styles of pictures: how wide a figure is, and how large its texts, lines and symbols are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.constants import PictureStyle

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.text import Text

# Width in inches of what a figure has beside its legend, and least width of a line and of a tick in points.
_WIDTH_WITHOUT_LEGEND, _THINNEST = 9.0, 0.4


@dataclass(frozen=True)
class Style:
    """A style. Sizes are in inches and points."""

    title: float
    """Size of titles."""
    legend: float
    """Size of the texts of legends."""
    width: float | None = None
    """Width of a figure; None: that which the picture has on a screen."""
    texts: tuple[float, float] | None = None
    """The least and the largest size of all texts; None: those of matplotlib's settings."""
    scale: float = 1.0
    """Widths of lines and sizes of symbols, relative to those on a screen."""
    dpi: float = 150.0
    """Dots per inch of a PNG, and of the pixels in a PDF or SVG."""

    def figure_size(self, width: float, height: float) -> tuple[float, float]:
        """Return the size of a figure that has some width and height on a screen, without a legend below its axes."""
        if self.width is None:
            return width, height
        return self.width, self.width * height / min(width, _WIDTH_WITHOUT_LEGEND)

    def dress(self, ax: Axes, artists: Iterable[Artist]) -> None:
        """Give axes, and artists on them, the sizes of the style."""
        if self.texts is None:
            return
        for axis in (ax.xaxis, ax.yaxis):
            self._dress_axis(axis)
        for spine in ax.spines.values():
            spine.set_linewidth(max(_THINNEST, spine.get_linewidth() * self.scale))
        for artist in (ax.title, *artists):
            self._dress(artist)

    def _dress_axis(self, axis: Axis) -> None:
        least, largest = self.texts or (0.0, 0.0)
        sizes: dict[str, Any] = {"labelsize": least, "width": 0.5, "pad": 2.0}
        axis.set_tick_params(which="major", length=2.5, **sizes)
        axis.set_tick_params(which="minor", length=1.5, **sizes)
        axis.offsetText.set_fontsize(least)
        axis.label.set_fontsize(largest)
        axis.labelpad = 3.0

    def _dress(self, artist: Artist) -> None:
        from matplotlib.collections import Collection, PathCollection
        from matplotlib.lines import Line2D
        from matplotlib.text import Annotation, Text

        if isinstance(artist, Line2D):
            artist.set_linewidth(self._thinner(artist.get_linewidth()))
            artist.set_markersize(artist.get_markersize() * self.scale)
            artist.set_markeredgewidth(artist.get_markeredgewidth() * self.scale)
        elif isinstance(artist, Collection):
            artist.set_linewidth([self._thinner(float(width)) for width in np.ravel(artist.get_linewidth())])
            if isinstance(artist, PathCollection):  # areas of symbols
                artist.set_sizes(artist.get_sizes() * self.scale**2)
        elif isinstance(artist, Text):
            self.dress_text(artist)
            if isinstance(artist, Annotation) and artist.arrow_patch is not None:
                offset: Any = artist.xyann
                artist.xyann = (offset[0] * self.scale, offset[1] * self.scale)
                artist.arrow_patch.set_mutation_scale(artist.arrow_patch.get_mutation_scale() * self.scale)
                artist.arrow_patch.set_linewidth(self._thinner(artist.arrow_patch.get_linewidth()))

    def dress_text(self, text: Text) -> None:
        """Give a text a size that the style allows."""
        if self.texts is not None:
            least, largest = self.texts
            text.set_fontsize(min(largest, max(least, float(text.get_fontsize()) * self.scale)))

    def _thinner(self, width: float) -> float:
        return width and max(_THINNEST, width * self.scale)


STYLES: dict[PictureStyle, Style] = {
    "screen": Style(title=10.0, legend=8.0),
    # 3.4 inches are the width of a column of the usual journals in two columns
    "column": Style(title=8.0, legend=7.0, width=3.4, texts=(7.0, 8.0), scale=0.65, dpi=300.0),
}

_CURRENT: ContextVar[Style] = ContextVar("style of pictures", default=STYLES["screen"])


@contextmanager
def drawing_in(style: Style) -> Iterator[None]:
    """Within this block pictures are drawn in a style."""
    token = _CURRENT.set(style)
    try:
        yield
    finally:
        _CURRENT.reset(token)


def current_style() -> Style:
    """Return the style in which pictures are drawn."""
    return _CURRENT.get()
