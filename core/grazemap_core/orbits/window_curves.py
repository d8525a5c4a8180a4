"""The curves of special one-impact motions inside a window of the plane, cut into pieces.

Each piece of an SN, PD, SB or GR curve comes with its motion and with the reason why it ends. The curves are known in
closed form, frequency by frequency, so no part of a curve is missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_curves import OneImpactCurve, OneImpactCurves, one_impact_curves

NEXT_STEP = 1.2
"""Steps within which an impact velocity that falls linearly must reach zero: one, with a margin for its curvature."""


@dataclass(frozen=True, eq=False)
class CurvePiece:
    """A piece of a curve.

    Attributes
    ----------
    type : {"SN", "PD", "SB", "GR"}
    period : int
        n of the motions, forcing periods.
    impacts_right, impacts_left : int
        1 and -1 (not touched) for one impact a period; the mirror images, -1 and 1, have the same curves. 1 and 1 for
        symmetric motions.
    symmetric : bool
    admissible : bool
        The orbits have no contact with a stop other than their impacts; otherwise the piece is no border of motions.
    stop : int
        GR only, else 0: +1 where the further contact is with a stop that is struck first, -1 with the other one.
    omega, clearance, impact_velocity : ndarray of shape (m,), m >= 2
    ends : (str, str)
        "window", "grazing" (the curve leaves the grazing curve there), "admissible" (another piece continues the curve
        there), or "none" (there are no such motions beyond).
    """

    type: str
    period: int
    impacts_right: int
    impacts_left: int
    symmetric: bool
    admissible: bool
    stop: int
    omega: Floats
    clearance: Floats
    impact_velocity: Floats
    ends: tuple[str, str]


def window_curves(
    oscillator: Oscillator,
    omega: tuple[float, float],
    clearance: tuple[float, float],
    max_multiple: int = 2,
    points: int = 400,
) -> list[CurvePiece]:
    """Return the curves of motions with one impact in up to `max_multiple` periods, or one on each stop.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega, clearance : (float, float)
        The window, 0 < start < stop each.
    max_multiple : int
        >= 1; symmetric motions have odd multiples only.
    points : int
        Frequencies across the window, >= 2.

    Raises
    ------
    ParameterError
        A number is out of range, or nothing is forced.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    for name, (start, stop) in (("omega", omega), ("clearance", clearance)):
        if not (np.isfinite([start, stop]).all() and 0.0 < start < stop):
            raise ParameterError(name, "start must be greater than 0 and less than stop, both finite")
    checked_order("max_multiple", max_multiple, 1)
    checked_order("points", points, 2)
    values = np.linspace(*omega, points)
    pieces: list[CurvePiece] = []
    for multiple in range(1, max_multiple + 1):
        for symmetric in (False, True):
            if symmetric and multiple % 2 == 0:
                continue
            curves = one_impact_curves(oscillator, values, multiple, symmetric)
            named = (
                ("SN", curves.saddle_node),
                ("SB" if symmetric else "PD", curves.doubling),
                ("GR", curves.contact),
            )
            for kind, curve in named:
                pieces += _pieces(kind, curve, curves, clearance, multiple, symmetric)
    return pieces


def _pieces(
    kind: str,
    curve: OneImpactCurve,
    curves: OneImpactCurves,
    window: tuple[float, float],
    multiple: int,
    symmetric: bool,
) -> list[CurvePiece]:
    inside = np.isfinite(curve.clearance) & (window[0] <= curve.clearance) & (curve.clearance <= window[1])
    found = []
    for members in _runs(inside, curve.admissible, curve.stop):
        if len(members) < 2:
            continue
        first, last = int(members[0]), int(members[-1])
        found.append(
            CurvePiece(
                type=kind,
                period=multiple,
                impacts_right=1,
                impacts_left=1 if symmetric else -1,
                symmetric=symmetric,
                admissible=bool(curve.admissible[first]),
                stop=int(curve.stop[first]),
                omega=curves.omega[members],
                clearance=curve.clearance[members],
                impact_velocity=curve.impact_velocity[members],
                ends=(_end(curve, curves, window, first, -1), _end(curve, curves, window, last, 1)),
            )
        )
    return found


def _runs(inside: Booleans, admissible: Booleans, stop: Integers) -> list[Integers]:
    """Return the runs of neighbouring points that are inside and alike."""
    places = np.flatnonzero(inside)
    if not places.size:
        return []
    cut = (np.diff(places) > 1) | (np.diff(admissible[places]) != 0) | (np.diff(stop[places]) != 0)
    return np.split(places, np.flatnonzero(cut) + 1)


def _end(curve: OneImpactCurve, curves: OneImpactCurves, window: tuple[float, float], place: int, step: int) -> str:
    """Return why a piece ends after its last point in one direction."""
    beyond = place + step
    if not 0 <= beyond < len(curves.omega):
        return "window"
    if np.isfinite(curve.clearance[beyond]):
        return "admissible" if window[0] <= curve.clearance[beyond] <= window[1] else "window"
    # where a curve leaves the grazing curve, its impact velocity falls linearly to zero within a step
    before = place - step
    if not 0 <= before < len(curves.omega):
        return "none"
    here, fallen = curve.impact_velocity[place], curve.impact_velocity[before] - curve.impact_velocity[place]
    return "grazing" if here <= NEXT_STEP * fallen else "none"
