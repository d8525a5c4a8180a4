"""The other stable motions that a sample of starts leads to: records, requests that show them, and a note in words."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import document_of
from grazemap.results.other_motions import listed
from grazemap.wire import InitialState, Note, ProcessRequest, TrajectoriesRequest, UnfoldingMapsRequest
from grazemap.wire.notes import OTHER_MOTIONS, OTHER_MOTIONS_IN_MAP
from grazemap.wire.planes import PlanePoint
from grazemap.wire.process import PointRequest
from grazemap.wire.structure import as_pair
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import (
    Points,
    Samples,
    SettlingEstimate,
    period_cost,
    settling,
    setup_seconds,
)
from grazemap_worker.processes.conversion import core_clearance, core_oscillator, label

if TYPE_CHECKING:
    from grazemap_core.maps.other_starts import OtherMotion
    from grazemap_core.maps.planes import Plane
    from grazemap_core.simulation.motion import Motion

FIELD = "other_starts"
MAX_PERIODS = 1000
"""Forcing periods after which the motion from the given state counts as not known, as the default of maps."""
# Decay of a trajectory's distance from its orbit, in powers of e, after which its returns name the motion; and most
# forcing periods for it.
_CLOSING = 27.0
_MOST_TRANSIENT = 20_000


def at_point(request: PointRequest, count: int, initial: InitialState, max_period: int) -> Document:
    """Return the field of a result at one point, with what other starts than a given state lead to; none without any.

    Raises CoreError.
    """
    if not count:
        return {}
    from grazemap_core.maps.other_starts import other_motions

    oscillator, clearance = core_oscillator(request.oscillator), core_clearance(request.clearance)
    outcome = other_motions(
        oscillator,
        request.omega,
        clearance,
        count,
        displacement=None if initial.displacement is None else np.array(initial.displacement),
        velocity=None if initial.velocity is None else np.array(initial.velocity),
        phase=initial.phase,
        max_periods=MAX_PERIODS,
        max_period=max_period,
    )
    point = PlanePoint(request.oscillator, request.omega, as_pair(request.clearance))
    motions = [
        document_of(
            results.OtherMotion,
            other,
            label=label(other.motion),
            period=other.motion.period,
            impacts_right=other.motion.impacts_right,
            impacts_left=other.motion.impacts_left,
            symmetric=other.motion.symmetric,
            request=_shown_by(point, other),
        )
        for other in outcome.motions
    ]
    return {FIELD: document_of(results.OtherStarts, outcome, motions=motions)}


def in_map(request: UnfoldingMapsRequest, plane: Plane) -> Document:
    """Return the field of a map from rest; none of other maps, of small ones and without other starts."""
    if not (request.samples_other_starts and request.other_starts):
        return {}
    from grazemap_core.maps.other_starts import other_motions_of_map

    outcome = other_motions_of_map(
        plane, request.other_starts, max_periods=request.max_periods, max_period=request.max_period
    )
    if outcome is None:
        return {}
    motions = []
    for seen in outcome.seen:
        across, up = float(plane.horizontal.values[seen.column]), float(plane.vertical.values[seen.row])
        point = request.plane.parameters.at({plane.horizontal.name: across, plane.vertical.name: up})
        motions.append(
            document_of(
                results.MotionElsewhere,
                label=label(seen.other.motion),
                points=seen.points,
                horizontal=across,
                vertical=up,
                from_rest=_name(seen.given),
                starts=seen.other.starts,
                request=_shown_by(point, seen.other),
            )
        )
    counts = {"starts": request.other_starts, "points": outcome.points, "with_others": outcome.points_with_others}
    return {FIELD: document_of(results.OtherStartsOfMap, **counts, motions=motions)}


def seconds_at_point(request: PointRequest, count: int) -> float:
    """Return the expected seconds for other starts at one point."""
    if not count:
        return 0.0
    oscillator, points = request.oscillator, Points.create([(request.omega, request.clearance)])
    cost = period_cost(oscillator, request.omega, request.clearance, lanes=True)
    return _seconds(settling(oscillator, points, MAX_PERIODS), cost, count) + setup_seconds(oscillator)


def seconds_of_map(request: UnfoldingMapsRequest, samples: Samples) -> float:
    """Return the expected seconds for other starts in a map."""
    rows, columns = request.plane.shape
    if not (request.samples_other_starts and request.other_starts):
        return 0.0
    points = min(rates.OTHER_STARTS_POINTS, rows * columns // rates.OTHER_STARTS_AMONG)
    seconds = _seconds(samples.settling(request.max_periods), samples.mean_cost(), request.other_starts)
    return points * (seconds + setup_seconds(request.oscillator))


def notes(request: ProcessRequest, document: Document) -> Iterator[Note]:
    """Yield a note where other starts lead to other motions: what is seen, and the request that shows it."""
    outcome = document.get(FIELD)
    if outcome is None or not outcome["motions"]:
        return
    where = f"{FIELD}.motions[0].request, a request of trajectories, shows the first of them"
    first = outcome["motions"][0]
    if isinstance(request, UnfoldingMapsRequest):
        seen = f"at {outcome['with_others']} of {outcome['points']} sampled points other starts lead to other motions"
        labels = ", ".join(motion["label"] for motion in outcome["motions"])
        place = f"{request.horizontal.vary} {first['horizontal']:.6g}, {request.vertical.vary} {first['vertical']:.6g}"
        detail = f"the map holds from rest: {seen} ({labels}), as at {place}: {first['from_rest']} from rest, "
        detail += f"{first['label']} too. {where}"
    else:
        counts = [(motion["label"], motion["starts"]) for motion in outcome["motions"]]
        start = "from rest" if _at_rest(request) else "from this initial state"
        detail = f"the motion holds {start}: from other starts also {listed(counts, outcome['starts'])}. {where}"
    code = OTHER_MOTIONS_IN_MAP if isinstance(request, UnfoldingMapsRequest) else OTHER_MOTIONS
    yield Note(code=code, detail=f"{detail}; basin-fractions counts the starts that lead to each motion")


def _at_rest(request: ProcessRequest) -> bool:
    initial = getattr(request, "initial", None) or InitialState()
    return not any(initial.displacement or ()) and not any(initial.velocity or ())


def _seconds(settles: SettlingEstimate, cost: float, count: int) -> float:
    lanes = math.sqrt(rates.FULL_COLUMN / min(count, rates.FULL_COLUMN))
    seconds = settles.periods * cost * lanes / rates.BASIN_PERIODS_PER_SECOND
    return count * (seconds + rates.BASIN_ORBITS * settles.orbit_seconds)


def _name(motion: Motion) -> str:
    return label(motion) or motion.kind


def _shown_by(point: PlanePoint, other: OtherMotion) -> dict[str, Any]:
    """Return the request for the trajectory that settles to a motion, over two of its periods."""
    period = other.motion.period or 1
    rate = -math.log(max(other.multiplier, 1e-300)) / period
    closing = _CLOSING / rate if rate > 0.0 else math.inf
    request = TrajectoriesRequest(
        oscillator=point.oscillator,
        omega=point.omega,
        clearance=point.clearance.of_both or point.clearance,
        initial=InitialState(
            displacement=other.start.displacement.tolist(),
            velocity=other.start.velocity.tolist(),
            phase=other.start.phase,
        ),
        periods=2 * period,
        transient_periods=other.settled_after + min(math.ceil(min(closing, _MOST_TRANSIENT)), _MOST_TRANSIENT),
    )
    return request.canonical()
