"""Pictures of results on matplotlib axes.

Each function draws on the axes that it is given, or on those of a new pyplot figure, and returns the axes. A notebook
shows the figure below the cell; ``axes.figure.savefig("picture.png")`` writes it. Needs the extra "plot".
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grazemap.plots.axes import kept_from_pyplot
from grazemap.results import Result
from grazemap.whole_files import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def save_picture(result: Result, path: str | PathLike[str], **options: Any) -> None:
    """Draw a result on a figure of its own and write the picture; the ending of the path gives the format.

    `options` are keywords of the result's `plot`. Fonts are embedded in a PDF in the form that journals take.
    """
    figure = draw_without_pyplot(result, **options)
    from matplotlib import rc_context

    with rc_context({"pdf.fonttype": 42}), whole_file(Path(path)) as picture:
        figure.savefig(picture)


def draw_without_pyplot(result: Result, **options: Any) -> Figure:
    """Draw a result on a figure that pyplot does not know; `options` are the keywords of the result's `plot`.

    Raises TypeError for a result without a picture.
    """
    if not hasattr(result, "plot"):
        raise TypeError(f"no picture of a {type(result).__name__}")
    with kept_from_pyplot():
        drawn = result.plot(**options)
    # a trajectory has two axes, in one figure
    return _figure_of(drawn[0] if isinstance(drawn, tuple) else drawn)


def save_axes(axes: Axes, path: str | PathLike[str]) -> None:
    """Write the figure that axes belong to as a picture; the ending of the path gives the format."""
    figure = _figure_of(axes)
    with whole_file(Path(path)) as picture:
        figure.savefig(picture)


def _figure_of(axes: Axes) -> Figure:
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    return figure
