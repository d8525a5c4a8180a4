"""Data in SI on axes that show other units. All coordinates of pictures go through here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.collections import QuadMesh
    from matplotlib.contour import QuadContourSet
    from matplotlib.image import AxesImage, PcolorImage
    from matplotlib.lines import Line2D
    from matplotlib.text import Annotation, Text

Floats = NDArray[np.float64]


def units_along(axis: Axis) -> tuple[str, ...]:
    """Return the unit in which an axis, or another axis with the same ticks, has data of results; empty for none."""
    ax, name = axis.axes, axis.axis_name  # type: ignore[attr-defined]
    sharing = getattr(ax, f"get_shared_{name}_axes")().get_siblings(ax)
    units = (each.units for each in (axis, *(getattr(sibling, f"{name}axis") for sibling in sharing)))
    return next(((unit,) for unit in units if isinstance(unit, str)), ())


@dataclass(frozen=True)
class Pen:
    """Draws coordinates of results on axes, in the units of the axes.

    The methods have the names of those of the axes, and take their keywords. What has no coordinates of a result, or
    has them in another form, is drawn with `ax`.
    """

    ax: Axes
    """The axes."""
    across: float = 1.0
    """The factor of horizontal coordinates."""
    up: float = 1.0
    """The factor of vertical coordinates."""

    def x(self, values: ArrayLike) -> Any:
        """Return horizontal coordinates in the unit of the axis."""
        return scaled(values, self.across)

    def y(self, values: ArrayLike) -> Any:
        """Return vertical coordinates in the unit of the axis."""
        return scaled(values, self.up)

    def places(self, shown: Floats) -> Floats:
        """Return the coordinates in SI of places on the axes, both of shape (n, 2)."""
        return shown / (self.across, self.up)

    def plot(self, x: ArrayLike, y: ArrayLike, **style: Any) -> list[Line2D]:
        """Draw a line or symbols."""
        return self.ax.plot(self.x(x), self.y(y), **style)

    def segments(self, ends: ArrayLike, **style: Any) -> None:
        """Draw separate lines from one point to another, shape (lines, 2, 2)."""
        from matplotlib.collections import LineCollection

        self.ax.add_collection(LineCollection(list(np.asarray(ends) * (self.across, self.up)), **style))

    def axhline(self, y: float, **style: Any) -> Line2D:
        """Draw a line across the axes."""
        return self.ax.axhline(self.y(y), **style)

    def axvline(self, x: float, **style: Any) -> Line2D:
        """Draw a line up the axes."""
        return self.ax.axvline(self.x(x), **style)

    def pcolormesh(self, x: Floats, y: Floats, values: ArrayLike, **style: Any) -> QuadMesh:
        """Draw cells between borders."""
        return self.ax.pcolormesh(self.x(x), self.y(y), values, **style)

    def pcolorfast(self, x: Floats, y: Floats, values: ArrayLike, **style: Any) -> AxesImage | PcolorImage | QuadMesh:
        """Draw many cells between borders, as an image."""
        return self.ax.pcolorfast(self.x(x), self.y(y), values, **style)

    def contour(self, x: Floats, y: Floats, values: ArrayLike, **style: Any) -> QuadContourSet:
        """Draw the lines on which values have a level."""
        return self.ax.contour(self.x(x), self.y(y), values, **style)

    def stackplot(self, x: Floats, heights: Sequence[Floats], **style: Any) -> None:
        """Draw areas on top of each other."""
        self.ax.stackplot(self.x(x), self.y(heights), **style)

    def text(self, x: float, y: float, text: str, **style: Any) -> Text:
        """Write a text at a point."""
        return self.ax.text(self.x(x), self.y(y), text, **style)

    def annotate(self, text: str, point: tuple[float, float], offset: tuple[float, float], **style: Any) -> Annotation:
        """Write a text, or draw an arrow, beside a point; the offset is in typographic points."""
        at = self.x(point[0]), self.y(point[1])
        return self.ax.annotate(text, at, offset, textcoords="offset points", **style)

    def set_xlim(self, low: float, high: float) -> None:
        """Set the ends of the horizontal axis."""
        self.ax.set_xlim(self.x(low), self.x(high))

    def set_ylim(self, low: float, high: float) -> None:
        """Set the ends of the vertical axis."""
        self.ax.set_ylim(self.y(low), self.y(high))

    def get_ylim(self) -> tuple[float, float]:
        """Return the ends of the vertical axis."""
        low, high = self.ax.get_ylim()
        return low / self.up, high / self.up


def scaled(values: ArrayLike, factor: float) -> Any:
    """Return values times a factor; in SI they are not touched."""
    return values if factor == 1.0 else np.multiply(values, factor)
