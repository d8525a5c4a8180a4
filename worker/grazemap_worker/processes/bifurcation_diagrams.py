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
from grazemap_worker.planning.costs import Samples, chance_seconds, longest_period_cost, setup_seconds
from grazemap_worker.planning.limits import MAX_RESULT_BYTES, Count, RequestLimits, points_pointer
from grazemap_worker.processes.conversion import core_line, reporting_progress, without_none
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.trajectories import motion_document

if TYPE_CHECKING:
    from grazemap_core.maps.bifurcation_diagrams import Section


def _periods(request: BifurcationDiagramsRequest) -> float:
    return float(grid_points(request.axis.values) * (request.transient_periods + request.periods))


def _seconds(request: BifurcationDiagramsRequest) -> float:
    values = grid_values(request.axis.values)
    periods = request.transient_periods + request.periods
    samples = Samples.create(request.line)
    cost = samples.mean_cost(lanes=False)
    watched_periods = periods + rates.DIAGRAM_SETTLING_PERIODS
    settling = samples.settling(watched_periods)
    # a trajectory is recorded once its motion is known, and the transient is over
    recorded = periods - settling.unsettled * request.transient_periods
    seconds = len(values) * cost * (recorded + rates.GROWTH_FACTOR * settling.periods) / rates.PERIODS_PER_SECOND
    seconds += chance_seconds(settling.unsettled * len(values), watched_periods, cost)
    seconds += len(values) * (setup_seconds(request.oscillator) + settling.orbit_seconds)
    return seconds + len(values) * samples.observed_seconds(request, cost, settling.unsettled)


def _counts(request: BifurcationDiagramsRequest, limits: RequestLimits) -> list[Count]:
    points, periods = grid_points(request.axis.values), request.transient_periods + request.periods
    # the error names the larger of transient_periods and periods
    pointer = "/transient_periods" if request.transient_periods > request.periods else "/periods"
    return [
        Count(points_pointer("axis/values", request.axis.values), "points", points, limits.points),
        Count("/periods", "samples", points * request.periods, limits.points),
        Count(pointer, "periods", points * periods, limits.tile_periods),
    ]


# Maximum number of progress reports of a diagram.
REPORTS = 100


def compute(request: BifurcationDiagramsRequest, report: Report) -> ClassDocument:
    """Return the values of the parameter in increasing order, and a section for each value. Raises CoreError.

    A section has the states recorded once per forcing period, the impacts of these periods, and the motion.
    """
    from grazemap_core.maps.bifurcation_diagrams import sections
    from grazemap_core.maps.chaotic_transients import chance_in_diagram
    from grazemap_core.maps.tolerances import EXPONENT_PERIODS

    values = grid_values(request.axis.values)
    line = core_line(request.line)
    computed = sections(
        line,
        request.policy,
        request.periods,
        request.transient_periods,
        request.max_period,
        MAX_RESULT_BYTES,
        core_observables(request),
    )
    swept = list(reporting_progress(computed, len(values), report, REPORTS))
    increasing = swept[::-1] if request.policy == "sweep-down" else swept
    watched_periods = request.transient_periods + request.periods + EXPONENT_PERIODS
    chance = chance_in_diagram(line, increasing, watched_periods, request.max_period)
    return document_of(
        results.BifurcationDiagram,
        parameter=values,
        sections=list(map(_section, increasing)),
        **without_none({"chance_to_settle": chance}),
        **observed_document(request, np.stack([section.figures for section in increasing], axis=1)),
    )


def _section(section: Section) -> Document:
    growth = None if math.isnan(section.transient_growth) else section.transient_growth
    return document_of(results.Section, section, motion=motion_document(section.motion), transient_growth=growth)


PROCESS = Process(
    whole=compute,
    periods=_periods,
    seconds=_seconds,
    counts=_counts,
    longest_period_cost=lambda request: longest_period_cost(request.line),
    kernels="diagrams",
)
