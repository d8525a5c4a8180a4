"""Pictures of results on matplotlib axes, without pyplot: nothing is kept behind the caller's back.

Each function draws on the axes it is given or makes a figure of its own, and returns the axes;
``axes.figure.savefig("picture.png")`` writes it. Needs the extra "plot".
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from grazemap.results import (
    Basins,
    BifurcationCurves,
    BifurcationDiagram,
    CodimensionTwoPoints,
    DiscontinuityMapping,
    GrazingCurve,
    OrbitBranch,
    PeriodicOrbit,
    Result,
    Trajectories,
    Trajectory,
    UnfoldingDiagram,
    UnfoldingMap,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def save_picture(result: Result, path: str | PathLike[str]) -> None:
    """Draw a result by itself and write it as a picture; the ending of the path decides the format."""
    match result:
        case GrazingCurve() | CodimensionTwoPoints() | DiscontinuityMapping() | BifurcationCurves():
            axes = result.plot()
        case BifurcationDiagram() | UnfoldingMap() | UnfoldingDiagram() | Basins() | PeriodicOrbit() | OrbitBranch():
            axes = result.plot()
        case Trajectory() | Trajectories():
            axes, _ = result.plot()
        case _:
            raise TypeError(f"no picture of a {type(result).__name__}")
    save_axes(axes, path)


def save_axes(axes: Axes, path: str | PathLike[str]) -> None:
    """Write the figure that axes belong to as a picture; the ending of the path decides the format."""
    figure = axes.get_figure(root=True)
    if figure is None:
        raise ValueError("the axes belong to no figure")
    figure.savefig(path)
