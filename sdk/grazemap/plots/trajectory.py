"""Trajectories: the time history of one mass between the stops, and its phase portrait."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import (
    Drawing,
    LegendPlace,
    axis_label,
    drawing,
    new_figure,
    place_text,
    shown_axes,
)
from grazemap.plots.palette import INK, LINE, NAMED, SECOND_LINE, UNRESOLVED, motion_colours, motion_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from grazemap.results import Trajectories, Trajectory

_EARLIER, _STOP, _IMPACT = NAMED["1-1r-1l"], UNRESOLVED, SECOND_LINE
# Maximum number of forcing periods that are legible in the time history.
_HISTORY_PERIODS = 12
# Forcing periods of a longest motion that is looked for; a record of no more of them need not decide its motion.
_LONGEST_MOTION = 32

Floats = NDArray[np.float64]


class TrajectoryAxes(NamedTuple):
    """The axes of a trajectory's picture."""

    history: Axes
    portrait: Axes

    def _ipython_display_(self) -> None:
        from grazemap.plots.picture_axes import show_in_notebook

        show_in_notebook(self.history)


class TrajectoryDrawing(NamedTuple):
    """Where the two parts of a trajectory's picture are drawn."""

    history: Drawing
    portrait: Drawing
    own_figure: bool

    @property
    def axes(self) -> TrajectoryAxes:
        """The axes of both."""
        return TrajectoryAxes(self.history.ax, self.portrait.ax)


def trajectory_drawing(
    ax: tuple[Axes, Axes] | Axes | Figure | None, legend: LegendPlace | None, labels: bool, figure: Figure | None
) -> TrajectoryDrawing:
    """Return where to draw a time history and a phase portrait: the caller's axes, or those of a new figure.

    With one axes the phase portrait is drawn on a figure that nobody sees.
    """
    from matplotlib.figure import Figure as AnyFigure

    if isinstance(ax, AnyFigure):  # version 0.1 had the figure in its place
        ax, figure = None, ax
    if ax is not None and not isinstance(ax, Iterable):
        ax = ax, AnyFigure().add_subplot()
    if figure is not None:
        warnings.warn("figure= is deprecated: pass ax=figure.subplots(1, 2)", DeprecationWarning, stacklevel=3)
    if ax is not None:
        history, portrait = ax
        return TrajectoryDrawing(drawing(history, legend, labels), drawing(portrait, legend, labels), own_figure=False)
    new = figure if figure is not None else new_figure(11.0, 4.6)
    pair = new.subplots(1, 2, width_ratios=(1.7, 1.0), subplot_kw={"axes_class": shown_axes()})
    made = [drawing(one, legend or "outside", labels) for one in pair]
    return TrajectoryDrawing(made[0], made[1], own_figure=True)


def plot_trajectory(trajectory: Trajectory, drawing: TrajectoryDrawing, mass: int = 1) -> TrajectoryAxes:
    """Draw the last periods of one mass over time, and the whole record in its phase plane.

    Parameters
    ----------
    trajectory : Trajectory
    drawing : TrajectoryDrawing
    mass : int
        1 to N. The stops and the impacts are those of mass 1 and are drawn for it only.

    Returns
    -------
    TrajectoryAxes

    Raises
    ------
    ValueError
        There is no such mass.
    """
    _check_mass(trajectory, mass)
    history, portrait = drawing.axes
    time, displacement, velocity = with_impacts(trajectory, mass)
    shown = _last_periods(trajectory, time)
    history.plot(time[shown], displacement[shown], color=LINE, linewidth=1.0)
    portrait.plot(displacement[~shown], velocity[~shown], color=_EARLIER, linewidth=0.6, label="earlier")
    portrait.plot(displacement[shown], velocity[shown], color=LINE, linewidth=1.2, label="last periods, as on the left")
    if not shown.all():
        _legend(drawing.portrait, 2)
    if mass == 1:
        _draw_stops(history, portrait, trajectory, "stops A, C")
        _draw_impacts(history, trajectory, float(time[shown][0]) if shown.any() else 0.0)
        portrait.axhline(0.0, color=INK, linewidth=0.4, zorder=0)
        _legend(drawing.history, 2)
    _label(drawing, trajectory, mass, _title(trajectory, mass))
    return drawing.axes


def plot_trajectories(
    result: Trajectories, drawing: TrajectoryDrawing, mass: int = 1, given: Mapping[str, str] | None = None
) -> TrajectoryAxes:
    """Draw the last periods of one mass of every trajectory, over time and in its phase plane, coloured by motion.

    `given` are colours by label or kind. The rest as for `plot_trajectory`.
    """
    first = result.trajectories[0]
    _check_mass(first, mass)
    history, portrait = drawing.axes
    different = {motion_text(trajectory.motion): trajectory.motion for trajectory in result.trajectories}
    colours = dict(zip(different, motion_colours(list(different.values()), given), strict=True))
    seen: set[str] = set()
    for trajectory in result.trajectories:
        time, displacement, velocity = with_impacts(trajectory, mass)
        shown = _last_periods(trajectory, time)
        text = motion_text(trajectory.motion)
        style: dict[str, Any] = {"color": colours[text], "linewidth": 0.8}
        history.plot(time[shown], displacement[shown], label=None if text in seen else text, **style)
        portrait.plot(displacement[shown], velocity[shown], **style)
        seen.add(text)
    if mass == 1:
        _draw_stops(history, portrait, first)
    _label(drawing, first, mass, f"Mass {mass} {_where(first)}: {len(result)} trajectories")
    _legend(drawing.history, 6)
    return drawing.axes


def _check_mass(trajectory: Trajectory, mass: int) -> None:
    size = len(trajectory.meta["request"]["oscillator"]["masses"])
    if not 1 <= mass <= size:
        raise ValueError(f"the oscillator has masses 1 to {size}")


def _last_periods(trajectory: Trajectory, time: Floats) -> NDArray[np.bool_]:
    """Return which times are in the last periods of a trajectory; none where it has ended early."""
    end = time[-1] if len(time) else 0.0
    shown: NDArray[np.bool_] = time >= end - _HISTORY_PERIODS * 2 * np.pi / trajectory.meta["request"]["omega"]
    return shown


def _label(drawing: TrajectoryDrawing, trajectory: Trajectory, mass: int, title: str) -> None:
    units = trajectory.units
    displacement, velocity = (axis_label(name, units, mass) for name in ("displacement", "velocity"))
    drawing.history.describe(axis_label("time", units), displacement, None if drawing.own_figure else title)
    drawing.portrait.describe(displacement, velocity)
    drawing.history.ax.margins(x=0.0)
    drawing.portrait.ax.locator_params(axis="x", nbins=5)
    figure = drawing.history.ax.get_figure(root=False)
    if drawing.own_figure and drawing.history.labels and figure is not None:
        figure.suptitle(title, fontsize=10)


def _legend(drawing: Drawing, columns: int) -> None:
    if drawing.legend == "outside":
        high = 1.08 if drawing.ax.get_title() else 1.0
        drawing.show_legend(loc="lower left", bbox_to_anchor=(0.0, high), ncols=columns)
    else:
        drawing.show_legend()


def with_impacts(trajectory: Trajectory, mass: int) -> tuple[Floats, Floats, Floats]:
    """Return time, displacement and velocity of a mass, for mass 1 with the values before and after every impact.

    Without these values an impact between two samples would look like a rounded corner instead of a jump. Each array
    has the shape (samples + 2 impacts,), or (samples,).
    """
    displacement, velocity = trajectory.displacement[mass - 1], trajectory.velocity[mass - 1]
    if mass != 1 or not len(trajectory.impacts):
        return trajectory.time, displacement, velocity
    request, impacts = trajectory.meta["request"], trajectory.impacts
    after = -request["oscillator"]["restitution"] * impacts.velocity
    position = impacts.stop * float(request["clearance"])
    time = np.concatenate([trajectory.time, impacts.time, impacts.time])
    # A sample at the time of an impact has the state after it.
    rank = np.repeat([2, 0, 1], [len(trajectory.time), len(impacts), len(impacts)])
    order = np.lexsort([rank, time])
    return (
        time[order],
        np.concatenate([displacement, position, position])[order],
        np.concatenate([velocity, impacts.velocity, after])[order],
    )


def _draw_stops(history: Axes, portrait: Axes, trajectory: Trajectory, label: str | None = None) -> None:
    clearance = float(trajectory.meta["request"]["clearance"])
    for side, text in ((1, label), (-1, None)):
        history.axhline(side * clearance, color=_STOP, linewidth=2.0, label=text, zorder=0)
        portrait.axvline(side * clearance, color=_STOP, linewidth=2.0, zorder=0)


def _draw_impacts(history: Axes, trajectory: Trajectory, start: float) -> None:
    clearance, impacts = float(trajectory.meta["request"]["clearance"]), trajectory.impacts
    grazing = impacts.kind == "graze"
    for chosen, text, face in ((~grazing, "impacts", _IMPACT), (grazing, "grazes", "white")):
        inside = chosen & (impacts.time >= start)
        if inside.any():
            history.plot(
                impacts.time[inside],
                impacts.stop[inside] * clearance,
                linestyle="none",
                marker="o",
                markersize=3.5,
                color=_IMPACT,
                markerfacecolor=face,
                clip_on=False,
                label=text,
            )


def _where(trajectory: Trajectory) -> str:
    request = trajectory.meta["request"]
    return "at " + place_text(trajectory.units, omega=request["omega"], clearance=request["clearance"])


def _title(trajectory: Trajectory, mass: int) -> str:
    named, grazes = motion_text(trajectory.motion), int(np.sum(trajectory.impacts.kind == "graze"))
    impacts = len(trajectory.impacts) - grazes
    counts = [
        f"{count} {text[: -1 if count == 1 else None]}"
        for count, text in ((impacts, "impacts"), (grazes, "grazes"))
        if count
    ]
    request = trajectory.meta["request"]
    if trajectory.motion.kind == "unresolved" and request["transient_periods"] + request["periods"] <= _LONGEST_MOTION:
        named = f"{request['periods']} forcing period{'s' * (request['periods'] > 1)}"
    return f"Mass {mass} {_where(trajectory)}: {named}, {', '.join(counts) or 'no impacts'}"
