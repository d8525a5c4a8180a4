"""The process bifurcation-diagrams: settled motions along one parameter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import BifurcationDiagramsRequest, grid_points, grid_values
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import Samples, chance_seconds, longest_period, setup_seconds
from grazemap_worker.planning.limits import MOST_RESULT_BYTES, Count, Limits, of_points
from grazemap_worker.processes.conversion import core_line, counted, known
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.trajectories import motion_document

if TYPE_CHECKING:
    from grazemap_core.maps.bifurcation_diagrams import Section


def _periods(request: BifurcationDiagramsRequest) -> float:
    return float(grid_points(request.range) * (request.transient_periods + request.periods))


def _seconds(request: BifurcationDiagramsRequest) -> float:
    values = grid_values(request.range)
    each = request.transient_periods + request.periods
    samples = Samples.of(request.line)
    costs = len(values) * samples.mean_cost(lanes=False)
    watched = each + rates.DIAGRAM_SETTLING_PERIODS
    settling = samples.settling(watched)
    # a motion that has not settled is looked at once more from the end of the record
    named = settling.periods + settling.unsettled * rates.DIAGRAM_SETTLING_PERIODS
    seconds = costs * (each + rates.GROWTH_SLOWER * named) / rates.PERIODS_PER_SECOND
    seconds += chance_seconds(settling.unsettled * len(values), watched, costs / len(values))
    orbit = settling.orbit_seconds
    seconds += len(values) * (setup_seconds(request.oscillator) + orbit)
    return seconds + len(values) * samples.observed_seconds(request, costs / len(values), settling.unsettled)


def _counts(request: BifurcationDiagramsRequest, limits: Limits) -> list[Count]:
    values, each = grid_points(request.range), request.transient_periods + request.periods
    most = "/transient_periods" if request.transient_periods > request.periods else "/periods"
    return [
        Count(of_points("range", request.range), "points", values, limits.points),
        Count("/periods", "samples", values * request.periods, limits.points),
        Count(most, "periods", values * each, limits.tile_periods),
    ]


# Number of progress reports.
REPORTS = 100


def compute(request: BifurcationDiagramsRequest, report: Report) -> ClassDocument:
    """Return parameter (n,) and sections, a record per value in increasing order. Raises CoreError."""
    from grazemap_core.maps.bifurcation_diagrams import EXPONENT_PERIODS, sections
    from grazemap_core.maps.chaotic_transients import chance_in_diagram

    values = grid_values(request.range)
    line = core_line(request.line)
    found = sections(
        line,
        request.policy,
        request.periods,
        request.transient_periods,
        request.max_period,
        MOST_RESULT_BYTES,
        core_observables(request),
    )
    listed = list(counted(found, len(values), report, REPORTS))
    if request.policy == "sweep-down":
        listed.reverse()
    watched = request.transient_periods + request.periods + EXPONENT_PERIODS
    chance = chance_in_diagram(line, listed, watched, request.max_period)
    return document_of(
        results.BifurcationDiagram,
        parameter=values,
        sections=list(map(_section, listed)),
        **known({"chance_to_settle": chance}),
        **observed_document(request, np.stack([section.figures for section in listed], axis=1)),
    )


def _section(found: Section) -> Document:
    growth = None if math.isnan(found.transient_growth) else found.transient_growth
    return document_of(results.Section, found, motion=motion_document(found.motion), transient_growth=growth)


PROCESS = Process(
    whole=compute,
    periods=_periods,
    seconds=_seconds,
    counts=_counts,
    longest_period=lambda request: longest_period(request.line),
    kernels="diagrams",
    of_masses=True,
)
