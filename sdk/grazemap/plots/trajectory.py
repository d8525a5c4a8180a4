"""A trajectory: the time history of one mass between the stops, and its phase portrait."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import INK, axis_label, new_figure
from grazemap.plots.palette import motion_text
from grazemap.results import MotionShare, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BLUE, _EARLIER, _STOP, _IMPACT = "#0072B2", "#A9C9DD", "#8C8C8C", "#D55E00"
# More forcing periods than these in the time history would run into each other.
_HISTORY_PERIODS = 12

Floats = NDArray[np.float64]


def plot_trajectory(trajectory: Trajectory, figure: Figure | None = None, mass: int = 1) -> tuple[Axes, Axes]:
    """Draw the last periods of one mass over time, and all that was recorded in its phase plane.

    Parameters
    ----------
    trajectory : Trajectory
    figure : Figure, optional
    mass : int
        1 to N. The stops and the impacts are those of mass 1 and are drawn for it only.

    Returns
    -------
    (Axes, Axes)
        Time history and phase portrait.

    Raises
    ------
    ValueError
        There is no such mass.
    """
    if not 1 <= mass <= len(trajectory.displacement):
        raise ValueError(f"the oscillator has masses 1 to {len(trajectory.displacement)}")
    figure = figure if figure is not None else new_figure(11.0, 4.6)
    history, portrait = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    time, displacement, velocity = with_impacts(trajectory, mass)
    shown = time >= time[-1] - _HISTORY_PERIODS * 2 * np.pi / trajectory.meta["request"]["omega"]
    history.plot(time[shown], displacement[shown], color=_BLUE, linewidth=1.0)
    portrait.plot(displacement[~shown], velocity[~shown], color=_EARLIER, linewidth=0.6, label="earlier")
    portrait.plot(displacement[shown], velocity[shown], color=_BLUE, linewidth=1.2, label="the periods on the left")
    if not shown.all():
        portrait.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, fontsize=8)
    if mass == 1:
        _draw_stops(history, portrait, trajectory, float(time[shown][0]))
    units = trajectory.units
    history.set(xlabel=axis_label("time", units), ylabel=axis_label("displacement", units, mass))
    portrait.set(xlabel=axis_label("displacement", units, mass), ylabel=axis_label("velocity", units, mass))
    history.margins(x=0.0)
    figure.suptitle(_title(trajectory, mass), fontsize=10)
    if mass == 1:
        history.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, fontsize=8)
    return history, portrait


def with_impacts(trajectory: Trajectory, mass: int) -> tuple[Floats, Floats, Floats]:
    """Return time, displacement and velocity of a mass, for mass 1 with both sides of every impact put in.

    Between two samples an impact would look like a round corner; with its position and its velocities before and
    after it is the straight jump that it is. Each array has the shape (samples + 2 impacts,), or (samples,).
    """
    displacement, velocity = trajectory.displacement[mass - 1], trajectory.velocity[mass - 1]
    if mass != 1 or not len(trajectory.impacts):
        return trajectory.time, displacement, velocity
    request, impacts = trajectory.meta["request"], trajectory.impacts
    after = -request["oscillator"]["restitution"] * impacts.velocity
    position = impacts.stop * float(request["clearance"])
    time = np.concatenate([trajectory.time, impacts.time, impacts.time])
    # A sample at the very moment of an impact holds the state after it.
    rank = np.repeat([2, 0, 1], [len(trajectory.time), len(impacts), len(impacts)])
    order = np.lexsort([rank, time])
    return (
        time[order],
        np.concatenate([displacement, position, position])[order],
        np.concatenate([velocity, impacts.velocity, after])[order],
    )


def _draw_stops(history: Axes, portrait: Axes, trajectory: Trajectory, start: float) -> None:
    clearance, impacts = float(trajectory.meta["request"]["clearance"]), trajectory.impacts
    for side, text in ((1, "stops A, C"), (-1, None)):
        history.axhline(side * clearance, color=_STOP, linewidth=2.0, label=text, zorder=0)
        portrait.axvline(side * clearance, color=_STOP, linewidth=2.0, zorder=0)
    inside = impacts.time >= start
    if inside.any():
        history.plot(
            impacts.time[inside],
            impacts.stop[inside] * clearance,
            linestyle="none",
            marker="o",
            markersize=3.0,
            color=_IMPACT,
            label="impacts",
        )
    portrait.axhline(0.0, color=INK, linewidth=0.4, zorder=0)


def _title(trajectory: Trajectory, mass: int) -> str:
    motion, request = trajectory.motion, trajectory.meta["request"]
    named = MotionShare("", motion.kind, motion.period, motion.impacts_right, motion.impacts_left, 0, 0.0)
    where = rf"$\omega$ = {request['omega']:g}, $b$ = {request['clearance']:g}"
    return f"Mass {mass} at {where}: {motion_text(named)}, {len(trajectory.impacts)} impacts"
