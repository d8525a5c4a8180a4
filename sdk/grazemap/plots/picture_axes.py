"""Axes that a notebook shows as a picture, not as a line of text. Needs matplotlib."""

from __future__ import annotations

from matplotlib.axes import Axes


class PictureAxes(Axes):
    """Axes that show their figure as the value of a notebook's cell."""

    def _ipython_display_(self) -> None:
        show_in_notebook(self)


def show_in_notebook(ax: Axes) -> None:
    """Show the figure of axes in a notebook, unless pyplot will show it at the end of the cell."""
    from IPython.display import display
    from matplotlib import pyplot

    figure = ax.get_figure(root=True)
    number = getattr(figure, "number", None)
    if number is None or not pyplot.fignum_exists(number):
        display(figure)
