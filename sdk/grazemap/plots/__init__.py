"""Pictures of results on matplotlib axes, without pyplot: no figure stays open.

Each function draws on the axes it is given or makes a figure of its own, and returns the axes;
``axes.figure.savefig("picture.png")`` writes it. Needs the extra "plot".
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import Result


def save_picture(result: Result, path: str | PathLike[str]) -> None:
    """Draw a result by itself and write it as a picture; the ending of the path gives the format."""
    if not hasattr(result, "plot"):
        raise TypeError(f"no picture of a {type(result).__name__}")
    drawn = result.plot()
    # a trajectory has two axes, in one figure
    save_axes(drawn[0] if isinstance(drawn, tuple) else drawn, path)


def save_axes(axes: Axes, path: str | PathLike[str]) -> None:
    """Write the figure that axes belong to as a picture; the ending of the path gives the format."""
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    figure.savefig(path)
