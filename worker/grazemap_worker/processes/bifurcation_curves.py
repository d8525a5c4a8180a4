"""The process bifurcation-curves: borders between motions, in a window of the plane.

In closed form for motions with few impacts, or by continuation for motions that are named.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import BifurcationCurvesRequest, motion_label
from grazemap_worker.processes.conversion import Report, core_oscillator, fields
from grazemap_worker.processes.orbit_branches import whole_period
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap.wire import CurveMotion
    from grazemap_core.continuation.bifurcation_curves import BifurcationCurve
    from grazemap_core.model.oscillator import Oscillator
    from grazemap_core.orbits.periodic_orbits import PeriodicOrbit

NOTHING_FOUND = (
    "no motion with these stops was met at several places of the window, from rest and from random states. "
    "Remedy: give the motion as an orbit that was found, or a smaller window."
)


def compute(request: BifurcationCurvesRequest, report: Report) -> Document:
    """Return curves, a list of records, each a piece inside the window, and the motions asked for. Raises CoreError."""
    if request.motions is None:
        return {"curves": _closed_form(request), "motions": []}
    oscillator = core_oscillator(request.oscillator)
    curves: list[dict[str, Any]] = []
    motions: list[dict[str, Any]] = []
    for number, motion in enumerate(request.motions):
        report(number, len(request.motions))
        orbit = _orbit(oscillator, request, motion)
        named = fields(motion, "period", "stops")
        if isinstance(orbit, str):
            nothing = dict.fromkeys(("omega", "clearance", "label"))
            motions.append({**named, **nothing, "admissible": False, "reason": orbit})
            continue
        known = fields(orbit, "omega", "clearance", "admissible")
        label = motion_label(orbit.least_period, *orbit.impacts_per_period)
        motions.append({**named, **known, "label": label, "reason": None})
        curves += _continued(oscillator, request, number, orbit)
    return {"curves": curves, "motions": motions}


def _closed_form(request: BifurcationCurvesRequest) -> list[dict[str, Any]]:
    from grazemap_core.orbits.window_curves import window_curves

    pieces = window_curves(core_oscillator(request.oscillator), *_window(request), request.max_multiple, request.points)
    return [
        {
            **fields(piece, "type", "period", "impacts_right", "impacts_left", "symmetric", "admissible", "stop"),
            **fields(piece, "omega", "clearance", "impact_velocity"),
            "motion": motion_label(piece.period, piece.impacts_right, piece.impacts_left),
            "ends": list(piece.ends),
        }
        for piece in pieces
    ]


def _window(request: BifurcationCurvesRequest) -> tuple[tuple[float, float], tuple[float, float]]:
    return (request.omega.start, request.omega.stop), (request.clearance.start, request.clearance.stop)


def _orbit(oscillator: Oscillator, request: BifurcationCurvesRequest, motion: CurveMotion) -> PeriodicOrbit | str:
    """Return an orbit of a motion in the window, or why there is none."""
    from grazemap_core.continuation.motion_curves import orbit_in_window
    from grazemap_core.orbits.impact_sequences import ImpactSequence
    from grazemap_core.orbits.periodic_orbits import periodic_orbit

    if motion.phases is not None:
        assert motion.velocities is not None  # both or neither
        assert motion.omega is not None
        assert motion.clearance is not None
        guess = ImpactSequence.create(motion.period, motion.stops, motion.phases, motion.velocities)
        orbit = periodic_orbit(oscillator, motion.omega, motion.clearance, guess)
        return orbit if orbit.converged else orbit.reason
    sides = [
        side if value is None else (value, value)
        for value, side in zip((motion.omega, motion.clearance), _window(request), strict=True)
    ]
    found = orbit_in_window(oscillator, sides[0], sides[1], motion.period, motion.stops)
    return NOTHING_FOUND if found is None else found


def _continued(
    oscillator: Oscillator, request: BifurcationCurvesRequest, number: int, orbit: PeriodicOrbit
) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a motion's curves; `number` is that of the motion in the request."""
    from grazemap_core.continuation.motion_curves import motion_curves

    solved_for = len(orbit.impacts.half().stops if orbit.symmetric else orbit.impacts.stops)
    for curve in motion_curves(oscillator, orbit, *_window(request)):
        further = curve.impact is not None and len(curve.stops) > solved_for
        yield from _pieces(curve, number, further)


def _pieces(curve: BifurcationCurve, number: int, further: bool) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a curve, each wholly admissible or wholly inadmissible."""
    keep = np.ones(len(curve.stops), dtype=np.bool_)
    if further and curve.impact is not None:  # the motion without the contact that appears
        keep[curve.impact] = False
    stops, phases, velocities = whole_period(
        curve.stops[keep], curve.phases[:, keep], curve.velocities[:, keep], curve.period, curve.symmetric
    )
    right, left = (int(np.sum(stops == stop)) or -1 for stop in (1, -1))
    impact = None if further else curve.impact
    strikes = np.abs(velocities)
    if impact is not None:
        vanishing = [impact, impact + len(curve.stops)] if curve.symmetric else [impact]
        strikes = np.delete(strikes, vanishing, axis=1)
    least = np.min(strikes, axis=1) if strikes.shape[1] else np.zeros(len(strikes))
    ends = ["window" if end == "range" else end for end in curve.ends]
    # runs of equal neighbours
    runs = np.split(np.arange(len(curve.admissible)), np.flatnonzero(np.diff(curve.admissible)) + 1)
    for place, members in enumerate(runs):
        if len(members) < 2:
            continue
        yield {
            **fields(curve, "type", "period", "symmetric"),
            "motion": motion_label(curve.period, right, left),
            "impacts_right": right,
            "impacts_left": left,
            "admissible": bool(curve.admissible[members[0]]),
            "stop": 0 if curve.impact is None else int(curve.stops[curve.impact]),
            "omega": curve.omega[members],
            "clearance": curve.clearance[members],
            "impact_velocity": least[members],
            "ends": [ends[0] if place == 0 else "admissible", ends[1] if place == len(runs) - 1 else "admissible"],
            "of_motion": number,
            "impact": impact,
            "stops": stops.tolist(),
            "phases": phases[members],
            "velocities": velocities[members],
        }


PROCESS = Process(whole=compute)
