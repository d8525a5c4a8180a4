"""The process bifurcation-curves: curves on which motions appear or change, in a window of a parameter plane.

If the request names no motions, and the plane is of omega and a clearance, the forcing or the bias, the curves of
motions with few impacts are computed in closed form. Otherwise the curves of each motion are computed by continuation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import BifurcationCurvesRequest, impacts_on, motion_label
from grazemap_worker.planning.costs import branch_point_seconds, longest_period_cost, period_cost
from grazemap_worker.planning.rates import (
    CURVE_POINT_BRANCHES,
    CURVES_PLACES,
    CURVES_POINTS,
    EXPLICIT_POINT_MASS_SECONDS,
    EXPLICIT_POINT_SECONDS,
    GRIDDED_POINT_MASS_SECONDS,
    GRIDDED_POINT_SECONDS,
    PERIODS_PER_SECOND,
    SEARCH_PERIODS,
    WINDOW_BRANCH_POINTS,
)
from grazemap_worker.processes.conversion import core_oscillator, fields
from grazemap_worker.processes.orbit_branches import finite, whole_period
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.unfolding_maps import core_plane

if TYPE_CHECKING:
    from grazemap.wire import CurveMotion
    from grazemap.wire.planes import Parameters
    from grazemap_core.continuation.bifurcation_curves import BifurcationCurve
    from grazemap_core.continuation.branches import OrbitPoint
    from grazemap_core.maps.planes import Axis, Plane
    from grazemap_core.orbits.single_impact.curve_parameter import CurveParameter


def _periods(request: BifurcationCurvesRequest) -> float:
    """Return the expected number of forcing periods of the trajectories that search for motions."""
    places = 0
    for motion in [] if request.is_explicit else request.followed:
        has_place = motion.horizontal is not None and motion.vertical is not None
        if motion.phases is None:
            places += 1 if has_place else CURVES_PLACES
    return places * SEARCH_PERIODS


def expected_seconds(request: BifurcationCurvesRequest) -> float:
    """Return the expected processor time.

    A point of a continued curve costs CURVE_POINT_BRANCHES times as much as a point of a branch, because it needs
    singular values and finite differences of matrices.
    """
    if request.is_explicit:
        return request.max_multiple * request.points * _frequency_seconds(request)
    corner = request.plane.corners()[0]
    cost = period_cost(corner.oscillator, corner.omega, corner.clearance)
    seconds = 0.0
    for motion in request.followed:
        point = branch_point_seconds(request.oscillator, float(len(motion.stops)))
        seconds += (WINDOW_BRANCH_POINTS + CURVE_POINT_BRANCHES * CURVES_POINTS) * point
    return seconds + _periods(request) * cost / PERIODS_PER_SECOND


def _frequency_seconds(request: BifurcationCurvesRequest) -> float:
    """Return the seconds of explicit curves, for one frequency and one multiple of the forcing period.

    They are of motions with one impact on either stop, or of those and of symmetric motions. Under one harmonic, where
    the other stop is absent or alike, no grid of phases is needed.
    """
    oscillator, clearance = request.oscillator, request.plane.corners()[0].clearance
    families = sum(gap is not None for gap in (clearance.right, clearance.left))
    if len(oscillator.orders) == 1 and (families == 1 or request.plane.mirrors):
        return families * (EXPLICIT_POINT_SECONDS + EXPLICIT_POINT_MASS_SECONDS * oscillator.size)
    seconds = GRIDDED_POINT_SECONDS + GRIDDED_POINT_MASS_SECONDS * oscillator.size
    return families * len(oscillator.orders) * seconds


def _longest_period_cost(request: BifurcationCurvesRequest) -> float | None:
    """Return the cost of the longest simulated forcing period; None for curves in closed form."""
    return None if request.is_explicit else longest_period_cost(request.plane)


NOTHING_FOUND = (
    "no motion with these stops was met at several places of the window, from rest and from random states. "
    "Remedy: give the motion as an orbit that was found, or a smaller window."
)


def compute(request: BifurcationCurvesRequest, report: Report) -> ClassDocument:
    """Return the curves and the motions whose curves are continued. Raises CoreError.

    There is one record for each piece of a curve in the window. For each motion there is a record of the orbit from
    which its curves were started, or of the reason why no orbit was found.
    """
    if request.is_explicit:
        return document_of(results.BifurcationCurves, curves=_closed_form(request), motions=[])
    plane = core_plane(request.plane)
    curves: list[Document] = []
    motions: list[Document] = []
    followed = request.followed
    for motion_index, motion in enumerate(followed):
        report(motion_index, len(followed))
        start = _orbit(plane, request, motion)
        fields_of_start: Document
        if isinstance(start, str):
            fields_of_start = {
                **dict.fromkeys(request.plane.fields),
                "label": None,
                "admissible": False,
                "reason": start,
            }
        else:
            orbit, point = start
            label = motion_label(orbit.least_period, *orbit.impacts_per_period)
            fields_of_start = {"label": label, "admissible": orbit.admissible, "reason": None}
            fields_of_start |= zip(request.plane.fields, map(point.value, plane.names), strict=True)
            curves += _curves_of_motion(plane, request, motion_index, start)
        motions.append(document_of(results.FollowedMotion, period=motion.period, stops=motion.stops, **fields_of_start))
    return document_of(results.BifurcationCurves, curves=curves, motions=motions)


def _closed_form(request: BifurcationCurvesRequest) -> list[Document]:
    """Return the pieces of the curves in closed form. One axis is omega, and it may be either of them."""
    from grazemap_core.orbits.single_impact.window_curves import window_curves

    plane = request.plane
    across, up = plane.horizontal, plane.vertical
    omega_axis, other_axis = (across, up) if across.vary == "omega" else (up, across)
    oscillator = core_oscillator(request.oscillator)
    varied = _varied(other_axis.vary, plane.parameters)
    axis_fields = plane.fields if omega_axis is across else plane.fields[::-1]
    pieces = window_curves(oscillator, omega_axis.ends, other_axis.ends, request.max_multiple, request.points, varied)
    return [
        document_of(
            results.BifurcationCurve,
            **fields(piece, "type", "period", "impacts_right", "impacts_left", "symmetric", "admissible", "stop"),
            **dict(zip(axis_fields, (piece.omega, piece.value), strict=True)),
            impact_velocity=piece.impact_velocity,
            stable_beside=piece.stable_beside,
            motion=motion_label(piece.period, piece.impacts_right, piece.impacts_left),
            ends=list(piece.ends),
        )
        for piece in pieces
    ]


def _varied(name: str, parameters: Parameters) -> CurveParameter:
    """Return the curve parameter of the core: the stop that varies, or the factor of the forces (bias or forcing)."""
    from grazemap_core.grazing.grazing_curve import VariedStop
    from grazemap_core.orbits.single_impact.curve_parameter import VariedFactor
    from grazemap_core.orbits.single_impact.window_curves import BOTH_STOPS

    right, left = parameters.right, parameters.left
    if not name.startswith("clearance"):
        gaps = (math.inf if gap is None else gap for gap in (right, left))
        return VariedFactor("bias" if name == "bias" else "forcing", *gaps)
    if name == "clearance":
        return BOTH_STOPS
    return VariedStop(1, left) if name == "clearance_right" else VariedStop(-1, right)


def _orbit(plane: Plane, request: BifurcationCurvesRequest, motion: CurveMotion) -> OrbitPoint | str:
    """Return an orbit of a motion in the window, or the reason why no orbit was found."""
    from grazemap_core.continuation.branches import OrbitPoint
    from grazemap_core.continuation.motion_curves import orbit_in_window
    from grazemap_core.orbits.impact_sequences import ImpactSequence
    from grazemap_core.orbits.periodic_orbits import periodic_orbit

    place = motion.horizontal, motion.vertical
    if motion.phases is not None:
        assert motion.velocities is not None  # both or neither
        assert motion.horizontal is not None  # as validated
        assert motion.vertical is not None
        point = plane.at.varied(plane.names[0], motion.horizontal).varied(plane.names[1], motion.vertical)
        guess = ImpactSequence.create(motion.period, motion.stops, motion.phases, motion.velocities)
        orbit = periodic_orbit(point.applied(plane.oscillator), point.omega, point.clearance, guess)
        return OrbitPoint(orbit, point) if orbit.converged else orbit.reason
    ranges = {
        axis.name: _ends(axis) if value is None else (value, value)
        for value, axis in zip(place, plane.axes, strict=True)
    }
    start = orbit_in_window(plane.oscillator, plane.at, ranges, motion.period, motion.stops)
    return NOTHING_FOUND if start is None else start


def _ends(axis: Axis) -> tuple[float, float]:
    """Return the first and the last value of an axis."""
    return float(axis.values[0]), float(axis.values[-1])


def _curves_of_motion(
    plane: Plane, request: BifurcationCurvesRequest, motion_index: int, start: OrbitPoint
) -> Iterator[Document]:
    """Yield the pieces of the curves of a motion; `motion_index` is the index of the motion in the result."""
    from grazemap_core.continuation.motion_curves import motion_curves

    impacts = len(start.orbit.impacts.whole.stops)
    across, up = map(_ends, plane.axes)
    for curve in motion_curves(plane.oscillator, start, across, up, plane=plane.names):
        has_extra_contact = curve.impact is not None and len(curve.stops) > impacts // (2 if curve.symmetric else 1)
        yield from _pieces(curve, motion_index, has_extra_contact, request.plane.fields)


def _pieces(
    curve: BifurcationCurve, motion_index: int, has_extra_contact: bool, axis_fields: tuple[str, str]
) -> Iterator[Document]:
    """Cut a curve where its admissibility changes, and yield the pieces. A piece of a single point is left out.

    `has_extra_contact` says whether the curve has a contact that the motion does not have. `axis_fields` are the names
    of the result fields with the horizontal and the vertical values.
    """
    keep = np.ones(len(curve.stops), dtype=np.bool_)
    if has_extra_contact and curve.impact is not None:  # leave out the contact that the motion does not have
        keep[curve.impact] = False
    stops, phases, velocities = whole_period(
        curve.stops[keep],
        curve.phases[:, keep],
        curve.velocities[:, keep],
        curve.period / curve.divisor,
        curve.symmetric,
    )
    right, left = impacts_on(stops)
    impact = None if has_extra_contact else curve.impact
    speeds = np.abs(velocities)
    if impact is not None:
        vanishing = [impact, impact + len(curve.stops)] if curve.symmetric else [impact]
        speeds = np.delete(speeds, vanishing, axis=1)
    min_speeds = np.min(speeds, axis=1) if speeds.shape[1] else np.zeros(len(speeds))
    ends = ["window" if end == "range" else end for end in curve.ends]
    # indices of consecutive points with equal admissibility
    runs = np.split(np.arange(len(curve.admissible)), np.flatnonzero(np.diff(curve.admissible)) + 1)
    # over omega and the clearance of one stop, the result also has the clearances of both stops
    is_over_one_gap = axis_fields[0] == "omega" and curve.plane[1] != "clearance"
    gap_names = ("clearance_right", "clearance_left") if is_over_one_gap else ()
    for position, members in enumerate(runs):
        if len(members) < 2:
            continue
        yield document_of(
            results.BifurcationCurve,
            **fields(curve, "type", "period", "symmetric"),
            motion=motion_label(curve.period, right, left),
            impacts_right=right,
            impacts_left=left,
            admissible=bool(curve.admissible[members[0]]),
            stop=0 if curve.impact is None else int(curve.stops[curve.impact]),
            **{axis_fields[0]: curve.horizontal[members], axis_fields[1]: curve.vertical[members]},
            **{name: finite(curve.values_of(name)[members]) for name in gap_names},
            impact_velocity=min_speeds[members],
            stable_beside=curve.stable_beside[members],
            ends=[ends[0] if position == 0 else "admissible", ends[1] if position == len(runs) - 1 else "admissible"],
            of_motion=motion_index,
            impact=impact,
            stops=stops.tolist(),
            phases=phases[members],
            velocities=velocities[members],
        )


PROCESS = Process(
    whole=compute,
    periods=_periods,
    seconds=expected_seconds,
    longest_period_cost=_longest_period_cost,
    kernels="orbits",
)
