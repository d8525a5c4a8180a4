"""The grazing curves of a plane of any two parameters, on which the steady motion touches a stop.

The margin of a stop is its gap from the steady motion; it is 0 on the curves.
A clearance, the factor of the forces and that of the bias are explicit: the margin of a stop is linear in them. Over
other parameters the curves pass between points of the plane at which a margin has different signs; every point of a
curve is a zero of the margin on a side of the grid, to round-off. A curve that enters and leaves between two
neighbouring points of the grid is not found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.continuation.parameters import PARAMETERS, domain
from grazemap_core.errors import CoreError
from grazemap_core.grazing.grazing_curve import steady_motion
from grazemap_core.maps.map_settings import Conditions
from grazemap_core.maps.planes import Axis, Plane
from grazemap_core.maps.tolerances import GRAZE_SAMPLES
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import EPSILON

_SIDES = {1: "right", -1: "left"}

Side = tuple[int, int, int]
"""A side of the grid: row and column of its first point, and the axis along which it runs, 0 vertical."""


class SteadyContact(NamedTuple):
    """Where the steady motion is at k points."""

    conditions: Conditions
    """The conditions of the points."""
    place: Floats
    """(k,) Contact coordinate at the static equilibrium, with the bias of the factor 1."""
    amplitude: Floats
    """(k, 2) Largest displacements from there toward the right and the left stop, with forces of the factor 1; NaN
    where there is no steady motion."""

    def margins(self) -> Floats:
        """Return the gaps of the right and of the left stop from the steady motion (k, 2); infinite if absent."""
        conditions, margins = self.conditions, self.conditions.clearance.copy()
        place, amplitude = conditions.bias * self.place, conditions.forcing[:, None] * self.amplitude
        margins[:, 0] -= place + amplitude[:, 0]
        margins[:, 1] -= amplitude[:, 1] - place
        return margins


def steady_on(plane: Plane) -> SteadyContact:
    """Return the steady motion at all points of a plane, column by column."""
    rows, columns = plane.grid
    place, amplitude = np.empty(len(rows)), np.empty((len(rows), 2))
    for group in plane.groups(rows, columns, ()):
        oscillator = plane.structure(int(rows[group[0]]), int(columns[group[0]]))
        omegas, which = np.unique(plane.values("omega", rows[group], columns[group]), return_inverse=True)
        place[group] = contact_equilibrium(oscillator)
        amplitude[group] = _amplitudes(oscillator, omegas)[which]
    return SteadyContact(plane.conditions(rows, columns), place, amplitude)


def grazing_margins(plane: Plane) -> tuple[Floats, Floats]:
    """Return the gap of the right, and of the left stop from the steady motion, shapes (n, m), [vertical, horizontal].

    The gap from the equilibrium, minus the largest displacement toward the stop (theory, "Other planes"). The steady
    motion exists where neither is negative. Infinite for an absent stop; NaN where there is no steady motion.
    """
    margins = steady_on(plane).margins()
    of_map = margins.T.reshape(2, plane.shape[1], plane.shape[0]).transpose(0, 2, 1)
    return np.ascontiguousarray(of_map[0]), np.ascontiguousarray(of_map[1])


class GrazeLine(NamedTuple):
    """A grazing curve, (m,) each."""

    stop: int
    """The stop that is touched: +1 right, -1 left."""
    plane: tuple[str, str]
    """The two parameters that vary."""
    horizontal: Floats
    """Values of the first of them."""
    vertical: Floats
    """Values of the second one."""
    admissible: Booleans
    """Whether the steady motion does not reach beyond the other stop."""


@in_own_period
def graze_lines(plane: Plane) -> Iterator[GrazeLine]:
    """Yield the grazing curves of each stop; those of symmetric stops are one, of the right stop."""
    for stop in (1,) if plane.mirrors else (1, -1):
        if np.isinf(plane.conditions(*(np.zeros(1, dtype=np.int64),) * 2).clearance[0, 0 if stop > 0 else 1]):
            continue
        place = _explicit_axis(plane, stop)
        if place is None:
            yield from _between_points(plane, stop)
        else:
            yield from _explicit(plane, stop, place)


def _explicit_axis(plane: Plane, stop: int) -> int | None:
    """Return the axis, 0 the horizontal one, in whose parameter the margin of a stop is linear."""
    names = ["clearance", f"clearance_{_SIDES[stop]}"]
    names += ["forcing"] if plane.oscillator.drive else []
    names += ["bias"] if contact_equilibrium(plane.oscillator) != 0.0 else []
    return next((place for place in (1, 0) if plane.names[place] in names), None)


def _explicit(plane: Plane, stop: int, place: int) -> Iterator[GrazeLine]:
    """Yield the curve of a stop with the parameter of an axis as a function of that of the other one.

    It is interrupted where there is no steady motion, or none that reaches the stop within the parameter's domain.
    """
    other_axis = _finer(plane.axes[1 - place])
    axis, fine = plane.axes[place]._replace(values=plane.axes[place].values[:1]), other_axis.values
    across, up = (axis, other_axis) if place == 0 else (other_axis, axis)
    extent = steady_on(replace(plane, horizontal=across, vertical=up))
    values = _solved(extent, stop, axis.name)
    there = extent.conditions
    if axis.name in ("forcing", "bias"):
        there = there._replace(**{axis.name: values})
    else:
        clearance = there.clearance.copy()
        clearance[:, [0, 1] if axis.name == "clearance" else [0 if stop > 0 else 1]] = values[:, None]
        there = there._replace(clearance=clearance)
    other = extent._replace(conditions=there).margins()[:, 1 if stop > 0 else 0]
    admissible = ~(other < 0.0) | plane.mirrors
    least, most = domain(axis.name)
    exists = (values >= least) & (values <= most)
    for run in np.split(np.arange(len(values)), np.flatnonzero(np.diff(exists)) + 1):
        if exists[run[0]]:
            sides = (fine[run], values[run]) if place == 1 else (values[run], fine[run])
            yield GrazeLine(stop, plane.names, *sides, admissible[run])


def _solved(extent: SteadyContact, stop: int, name: str) -> Floats:
    """Return the values (k,) of a parameter at which the margin of a stop is 0."""
    conditions, side = extent.conditions, 0 if stop > 0 else 1
    amplitude, place = extent.amplitude[:, side], stop * extent.place
    with np.errstate(divide="ignore", invalid="ignore"):
        if name == "forcing":
            return np.asarray((conditions.clearance[:, side] - conditions.bias * place) / amplitude)
        if name == "bias":
            return np.asarray((conditions.clearance[:, side] - conditions.forcing * amplitude) / place)
        return np.asarray(conditions.forcing * amplitude + conditions.bias * place)


def _between_points(plane: Plane, stop: int) -> Iterator[GrazeLine]:
    """Yield the curves of a stop between points of the plane with margins of different signs."""
    # a structure takes longer than all else
    across, up = (axis if axis.name not in PARAMETERS else _finer(axis) for axis in plane.axes)
    fine = replace(plane, horizontal=across, vertical=up)
    side_of_stop, other_side = (0, 1) if stop > 0 else (1, 0)
    idle = ("restitution", f"clearance_{_SIDES[-stop]}")
    moves = [not axis.name.startswith(idle) for axis in plane.axes]
    known: dict[tuple[int | None, int | None, int], float] = {}

    def solved(side: Side) -> list[float]:
        row, column, along = side
        at = [float(fine.horizontal.values[column]), float(fine.vertical.values[row])]
        key = column if moves[0] else None, row if moves[1] else None, along
        if key not in known:
            varied, place = 1 - along, column if along else row

            def margin(value: float) -> float:
                return float(_margins_at(plane, *(value if k == varied else at[k] for k in (0, 1)))[side_of_stop])

            ends = fine.axes[varied].values[place : place + 2].tolist()
            margins = [margin(end) for end in ends]
            if margins[0] * margins[1] >= 0.0:  # one of them is 0 within rounding
                known[key] = ends[int(np.argmin(np.abs(margins)))]
            else:
                least = EPSILON * max(map(abs, ends))
                # rtol is the smallest that brentq takes
                known[key] = float(brentq(margin, *ends, xtol=least, rtol=4.0 * EPSILON))
        at[1 - along] = known[key]
        return at

    for path in _paths(grazing_margins(fine)[side_of_stop]):
        points = np.array([solved(side) for side in path])
        beside = np.array([_margins_at(plane, *point)[other_side] for point in points.tolist()])
        yield GrazeLine(stop, plane.names, points[:, 0].copy(), points[:, 1].copy(), ~(beside < 0.0) | plane.mirrors)


def _amplitudes(oscillator: Oscillator, omega: Floats) -> Floats:
    """Return the largest displacements toward the right and the left stop, (n, 2); NaN without a steady motion."""
    if not oscillator.drive:
        return np.zeros((len(omega), 2))
    at_own_period, times = oscillator.at_own_period
    try:
        motion = steady_motion(at_own_period, times * omega)
        return np.stack([motion.toward(stop).amplitude for stop in (1, -1)], axis=1)
    except CoreError:
        if len(omega) == 1:
            return np.full((1, 2), np.nan)
        return np.concatenate([_amplitudes(oscillator, omega[[k]]) for k in range(len(omega))])


def _margins_at(plane: Plane, horizontal: float, vertical: float) -> Floats:
    """Return the margins of the right and of the left stop at any values of the two parameters."""
    across = plane.horizontal._replace(values=np.array([horizontal]))
    up = plane.vertical._replace(values=np.array([vertical]))
    return np.asarray(steady_on(replace(plane, horizontal=across, vertical=up)).margins()[0])


def _paths(values: Floats) -> list[list[Side]]:
    """Return the sides of a grid that the zero lines of a function cross, in the order of each line."""
    links: dict[Side, list[Side]] = {}
    positive = values > 0.0
    known = np.isfinite(values)
    for row, column in np.argwhere(_mixed(positive, known)).tolist():
        corners = positive[row, column], positive[row, column + 1], positive[row + 1, column + 1]
        sides = [(row, column, 1), (row, column + 1, 0), (row + 1, column, 1), (row, column, 0)]
        ends = [corners[0], corners[1], corners[2], positive[row + 1, column]]
        crossed = [side for k, side in enumerate(sides) if ends[k] != ends[(k + 1) % 4]]
        if len(crossed) == 4 and (np.mean(values[row : row + 2, column : column + 2]) > 0.0) != corners[0]:
            crossed = crossed[-1:] + crossed[:-1]  # the first corner is alone
        for first, second in zip(crossed[::2], crossed[1::2], strict=True):
            links.setdefault(first, []).append(second)
            links.setdefault(second, []).append(first)
    # lines with ends first, then those that are closed
    return [_walk(links, start) for start in sorted(links, key=lambda side: len(links[side])) if start in links]


def _mixed(positive: Booleans, known: Booleans) -> Booleans:
    """Return which cells have corners of both signs, and no unknown one."""

    def corners(of: Booleans) -> Booleans:
        return np.stack([of[:-1, :-1], of[:-1, 1:], of[1:, :-1], of[1:, 1:]])

    signs = corners(positive)
    return np.asarray(np.any(signs, axis=0) & ~np.all(signs, axis=0) & np.all(corners(known), axis=0))


def _walk(links: dict[Side, list[Side]], start: Side) -> list[Side]:
    """Return the sides of a line from its start, and remove them from `links`; a closed one ends where it starts."""
    path, last = [start], links.pop(start)
    ahead = last[:1]
    while ahead:
        path += ahead
        ahead = [side for side in links.pop(path[-1]) if side in links]
    return [*path, start] if len(last) == 2 and path[-1] == last[1] else path


def _finer(axis: Axis) -> Axis:
    """Return an axis with GRAZE_SAMPLES times as many values between the same ends."""
    size = len(axis.values)
    shares = np.linspace(0.0, 1.0, GRAZE_SAMPLES * size)
    return axis._replace(values=np.interp(shares, np.linspace(0.0, 1.0, size), axis.values))
