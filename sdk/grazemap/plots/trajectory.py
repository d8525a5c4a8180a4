"""Trajectories: the time history of the contact between the stops, or of one mass, and its phase portrait."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap.described import described
from grazemap.plots.axes import Drawing, axis_label, drawing, draws, new_figure, point_text, shown_axes
from grazemap.plots.layout import settle, wrap
from grazemap.plots.palette import INK, LINE, NAMED, OTHER, SECOND_LINE, UNRESOLVED, motion_colours, motion_text
from grazemap.plots.pen import Pen
from grazemap.plots.styles import current_style
from grazemap.plots.wordings import Wording
from grazemap.results import Trajectories, Trajectory
from grazemap.results.pictures import LegendPlace
from grazemap.wire import ClearancePair, Oscillator
from grazemap.wire.structure import SIDES, as_pair, restitutions

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_EARLIER, _STOP, _IMPACT = NAMED["1-1r-1l"], UNRESOLVED, SECOND_LINE
# Maximum number of forcing periods that are legible in the time history.
_HISTORY_PERIODS = 12
# Longest period of a motion that is searched for, in forcing periods. A record that is no longer may be too short to
# identify its motion.
_MAX_PERIOD = 32

Floats = NDArray[np.float64]


@described
class TrajectoryAxes(NamedTuple):
    """The axes of a trajectory's picture."""

    history: Axes
    """The axes of the motion over time."""
    portrait: Axes
    """The axes of the phase portrait."""

    def _ipython_display_(self) -> None:
        from grazemap.plots.picture_axes import show_in_notebook

        show_in_notebook(self.history)


class TrajectoryDrawing(NamedTuple):
    """Where the two parts of a trajectory's picture are drawn."""

    history: Drawing
    """The drawing of the motion over time."""
    portrait: Drawing
    """The drawing of the phase portrait."""

    @property
    def ax(self) -> Axes:
        """The axes of the motion over time."""
        return self.history.ax

    @property
    def axes(self) -> TrajectoryAxes:
        """The axes of both."""
        return TrajectoryAxes(self.history.ax, self.portrait.ax)

    def finish(self) -> None:
        """Finish both drawings, and break the title of a new figure where it is too long."""
        for part in self:
            part.finish()
        figure = self.ax.get_figure(root=True)
        if self.history.own_figure and figure is not None and figure._suptitle is not None:  # type: ignore[attr-defined]
            wrap(figure._suptitle, 0.97 * figure.bbox.width)  # type: ignore[attr-defined]
            settle(figure)


def trajectory_drawing(
    ax: tuple[Axes, Axes] | Axes | None, legend: LegendPlace | None, labels: bool, shown_units: tuple[str, ...]
) -> TrajectoryDrawing:
    """Return where to draw a time history and a phase portrait: the caller's axes, or those of a new figure.

    If only one axes is given, the phase portrait is drawn on a hidden figure.
    """
    pair: Iterable[Axes]
    if ax is None:
        legend = legend or "outside"
        shown = {"axes_class": shown_axes()}
        if current_style().width is None:
            pair = new_figure(11.0, 4.6).subplots(1, 2, width_ratios=(1.7, 1.0), subplot_kw=shown)
        else:
            pair = new_figure(9.0, 10.5).subplots(2, 1, height_ratios=(1.0, 1.3), subplot_kw=shown)
    elif isinstance(ax, Iterable):
        pair = ax
    else:
        from matplotlib.figure import Figure

        pair = ax, Figure().add_subplot()
    history, portrait = (drawing(axes, legend, labels, shown_units, own_figure=ax is None) for axes in pair)
    return TrajectoryDrawing(history, portrait)


@draws(Trajectory, place=trajectory_drawing)
def plot_trajectory(trajectory: Trajectory, drawing: TrajectoryDrawing, mass: int | None) -> TrajectoryAxes:
    """Draw the last periods of the contact, or of one mass, over time, and the whole record in its phase plane.

    The stops and the impacts are drawn for the contact only. Raises ValueError: there is no such mass.
    """
    contact = _Contact.from_trajectory(trajectory)
    mass = _checked_mass(contact, mass)
    history, portrait = _describe(drawing, trajectory, mass, _title(trajectory, mass))
    time, displacement, velocity = history_with_impacts(trajectory, mass)
    shown = _last_periods(trajectory, time)
    history.plot(time[shown], displacement[shown], color=LINE, linewidth=1.0)
    portrait.plot(displacement[~shown], velocity[~shown], color=_EARLIER, linewidth=0.6, label="earlier")
    portrait.plot(displacement[shown], velocity[shown], color=LINE, linewidth=1.2, label="last periods, as over time")
    if not shown.all():
        drawing.portrait.show_legend(columns=2)
    if mass == contact.mass:
        _draw_stops(history, portrait, contact, True)
        _draw_impacts(history, trajectory, contact, float(time[shown][0]) if shown.any() else 0.0)
        portrait.axhline(0.0, color=INK, linewidth=0.4, zorder=0)
        drawing.history.show_legend(columns=2)
    return drawing.axes


@draws(Trajectories, place=trajectory_drawing)
def plot_trajectories(
    result: Trajectories, drawing: TrajectoryDrawing, mass: int | None, colours: Mapping[str, str] | None
) -> TrajectoryAxes:
    """Draw the last periods of every trajectory over time and in its phase plane, coloured by motion.

    The stops are drawn as by `plot_trajectory`, but no impacts. Raises ValueError: there is no such mass.
    """
    first = result.trajectories[0]
    contact = _Contact.from_trajectory(first)
    mass = _checked_mass(contact, mass)
    title = f"{_name(mass)} at " + point_text(first) + f": {len(result)} trajectories"
    history, portrait = _describe(drawing, first, mass, title)
    different = {motion_text(trajectory.motion): trajectory.motion for trajectory in result.trajectories}
    shades = dict(zip(different, motion_colours(list(different.values()), colours), strict=True))
    seen: set[str] = set()
    for trajectory in result.trajectories:
        time, displacement, velocity = history_with_impacts(trajectory, mass)
        shown = _last_periods(trajectory, time)
        text = motion_text(trajectory.motion)
        style: dict[str, Any] = {"color": shades[text], "linewidth": 0.8}
        text = text if shades[text] != OTHER else f"{list(shades.values()).count(OTHER)} other motions"
        history.plot(time[shown], displacement[shown], label=None if text in seen else text, **style)
        portrait.plot(displacement[shown], velocity[shown], **style)
        seen.add(text)
    if mass == contact.mass:
        _draw_stops(history, portrait, contact)
    drawing.history.show_legend(columns=6)
    return drawing.axes


def mass_of(row: Floats) -> int | None:
    """Return the mass, counted from 1, whose displacement is the contact coordinate of a row; None for other rows."""
    masses = np.flatnonzero(row)
    return int(masses[0]) + 1 if len(masses) == 1 and row[masses[0]] == 1.0 else None


class _Contact(NamedTuple):
    """The part of the structure that hits the stops."""

    row: Floats
    """(N,) The contact coordinate is row @ displacement."""
    mass: int | None
    """The mass whose displacement is the contact coordinate, counted from 1; None where it is not that of one mass."""
    clearances: tuple[float, float]
    """The clearances of the right and the left stop; infinite for an absent stop."""
    restitutions: tuple[float, float]
    """The restitutions of the right and the left stop."""

    @classmethod
    def from_trajectory(cls, trajectory: Trajectory) -> _Contact:
        request = trajectory.meta["request"]
        oscillator = Oscillator.model_validate(request["oscillator"])
        row = np.array(oscillator.contact_row)
        clearance = request["clearance"]
        stops = as_pair(ClearancePair(**clearance) if isinstance(clearance, dict) else clearance)
        right, left = (np.inf if gap is None else float(gap) for gap in (stops.right, stops.left))
        return cls(row, mass_of(row), (right, left), restitutions(oscillator.restitution))

    def stop_values(self, values: tuple[float, float], stops: NDArray[Any]) -> Floats:
        """Return the value of each stop, +1 or -1."""
        return np.where(stops > 0, values[0], values[1])


def _checked_mass(contact: _Contact, mass: int | None) -> int | None:
    """Return the mass to draw; None for a contact coordinate that is not the displacement of one mass."""
    size = len(contact.row)
    if mass is not None and not 1 <= mass <= size:
        raise ValueError(f"the oscillator has masses 1 to {size}")
    return contact.mass if mass is None else mass


def _name(mass: int | None) -> str:
    return "Contact" if mass is None else f"Mass {mass}"


def _last_periods(trajectory: Trajectory, time: Floats) -> NDArray[np.bool_]:
    """Return which times are in the last periods of a trajectory."""
    end = time[-1] if len(time) else 0.0
    request = trajectory.meta["request"]
    period = Oscillator.model_validate(request["oscillator"]).forcing_period(request["omega"])
    shown: NDArray[np.bool_] = time >= end - _HISTORY_PERIODS * period
    return shown


def _describe(drawing: TrajectoryDrawing, trajectory: Trajectory, mass: int | None, title: Wording) -> tuple[Pen, Pen]:
    """Label both axes, and return what draws on them."""
    units = trajectory.units
    displacement, velocity = (axis_label(name, units, mass) for name in ("displacement", "velocity"))
    own_figure = drawing.history.own_figure
    history = drawing.history.describe(axis_label("time", units), displacement, None if own_figure else title)
    portrait = drawing.portrait.describe(displacement, velocity)
    drawing.history.ax.margins(x=0.0)
    drawing.portrait.ax.locator_params(axis="x", nbins=5)
    figure = drawing.history.ax.get_figure(root=False)
    if own_figure and figure is not None:
        drawing.history.write(partial(figure.suptitle, fontsize=drawing.history.style.title), title)
    return history, portrait


def history_with_impacts(trajectory: Trajectory, mass: int | None) -> tuple[Floats, Floats, Floats]:
    """Return time, displacement and velocity of a mass, or of the contact (None).

    For the contact, the values before and after every impact are inserted: without them an impact between two samples
    would look like a rounded corner instead of a jump. Each array has the shape (samples + 2 impacts,), for other
    masses (samples,).
    """
    contact, impacts = _Contact.from_trajectory(trajectory), trajectory.impacts
    row = contact.row if mass is None else np.eye(len(contact.row))[mass - 1]
    displacement, velocity = row @ trajectory.displacement, row @ trajectory.velocity
    if mass != contact.mass or not len(impacts):
        return trajectory.time, displacement, velocity
    rebound = -contact.stop_values(contact.restitutions, impacts.stop) * impacts.velocity
    position = impacts.stop * contact.stop_values(contact.clearances, impacts.stop)
    time = np.concatenate([trajectory.time, impacts.time, impacts.time])
    # A sample at the time of an impact has the state after it.
    rank = np.repeat([2, 0, 1], [len(trajectory.time), len(impacts), len(impacts)])
    order = np.lexsort([rank, time])
    return (
        time[order],
        np.concatenate([displacement, position, position])[order],
        np.concatenate([velocity, impacts.velocity, rebound])[order],
    )


def _draw_stops(history: Pen, portrait: Pen, contact: _Contact, labelled: bool = False) -> None:
    present = [
        (side, clearance, name)
        for side, clearance, name in zip((1, -1), contact.clearances, SIDES, strict=True)
        if clearance < np.inf
    ]
    label = f"{' and '.join(name for _, _, name in present)} stop"
    for number, (side, clearance, _) in enumerate(present):
        text = label if labelled and number == 0 else None
        history.axhline(side * clearance, color=_STOP, linewidth=2.0, label=text, zorder=0)
        portrait.axvline(side * clearance, color=_STOP, linewidth=2.0, zorder=0)


def _draw_impacts(history: Pen, trajectory: Trajectory, contact: _Contact, start: float) -> None:
    impacts = trajectory.impacts
    position = impacts.stop * contact.stop_values(contact.clearances, impacts.stop)
    grazing = impacts.kind == "graze"
    for chosen, text, face in ((~grazing, "impacts", _IMPACT), (grazing, "grazes", "white")):
        inside = chosen & (impacts.time >= start)
        if inside.any():
            history.plot(
                impacts.time[inside],
                position[inside],
                linestyle="none",
                marker="o",
                markersize=3.5,
                color=_IMPACT,
                markerfacecolor=face,
                clip_on=False,
                label=text,
            )


def _title(trajectory: Trajectory, mass: int | None) -> Wording:
    motion_name, grazes = motion_text(trajectory.motion), int(np.sum(trajectory.impacts.kind == "graze"))
    impacts = len(trajectory.impacts) - grazes
    counts = [
        f"{count} {text[: -1 if count == 1 else None]}"
        for count, text in ((impacts, "impacts"), (grazes, "grazes"))
        if count
    ]
    request = trajectory.meta["request"]
    if trajectory.motion.kind == "unresolved" and request["transient_periods"] + request["periods"] <= _MAX_PERIOD:
        motion_name = f"{request['periods']} forcing period{'s' * (request['periods'] > 1)}"
    return f"{_name(mass)} at " + point_text(trajectory) + f": {motion_name}, {', '.join(counts) or 'no impacts'}"
