"""The process bifurcation-diagrams: settled motions along one parameter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import BifurcationDiagramsRequest, grid_values
from grazemap_worker.processes.conversion import (
    Report,
    chance_document,
    core_line,
    counted,
    fields,
)
from grazemap_worker.processes.observables import core_observables, observed_document
from grazemap_worker.processes.process import Process
from grazemap_worker.processes.trajectories import motion_document
from grazemap_worker.store import MOST_RESULT_BYTES

if TYPE_CHECKING:
    from grazemap_core.maps.bifurcation_diagrams import Section

# Number of progress reports.
REPORTS = 100


def compute(request: BifurcationDiagramsRequest, report: Report) -> Document:
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
    return {
        "parameter": values,
        "sections": list(map(_record, listed)),
        **chance_document(chance),
        **observed_document(request, np.stack([section.figures for section in listed], axis=1)),
    }


def _record(section: Section) -> dict[str, Any]:
    found = fields(section, "displacement", "velocity", "impact_velocity", "impact_stop", "sensitive")
    growth = None if math.isnan(section.transient_growth) else section.transient_growth
    return {**found, "transient_growth": growth, "motion": motion_document(section.motion)}


PROCESS = Process(whole=compute)
