"""The wire models: the one place that says what travels between client, service and worker."""

from grazemap.wire.basins import BasinCoordinate, BasinsRequest
from grazemap.wire.canonical import canonical, job_id
from grazemap.wire.diagrams import BifurcationDiagramsRequest
from grazemap.wire.job import (
    FINISHED,
    Estimate,
    Job,
    JobList,
    Link,
    Problem,
    ProblemError,
    Progress,
    Status,
    motion_label,
)
from grazemap.wire.orbits import (
    BifurcationCurvesRequest,
    BranchInterval,
    CurveMotion,
    OrbitBranchesRequest,
    OrbitMotion,
    PeriodicOrbitsRequest,
)
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.process import ProcessRequest
from grazemap.wire.ranges import CoordinateRange, Grid, Interval, Range, grid_points, grid_values
from grazemap.wire.requests import (
    PROCESSES,
    CodimensionTwoPointsRequest,
    DiscontinuityMappingsRequest,
    GrazingCurvesRequest,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
    UnfoldingMapsRequest,
    parse_request,
)
from grazemap.wire.states import InitialState

__all__ = [
    "FINISHED",
    "PROCESSES",
    "BasinCoordinate",
    "BasinsRequest",
    "BifurcationCurvesRequest",
    "BifurcationDiagramsRequest",
    "BranchInterval",
    "CodimensionTwoPointsRequest",
    "CoordinateRange",
    "CurveMotion",
    "DiscontinuityMappingsRequest",
    "Estimate",
    "GrazingCurvesRequest",
    "Grid",
    "InitialState",
    "Interval",
    "Job",
    "JobList",
    "Link",
    "OrbitBranchesRequest",
    "OrbitMotion",
    "Oscillator",
    "PeriodicOrbitsRequest",
    "Problem",
    "ProblemError",
    "ProcessRequest",
    "Progress",
    "Range",
    "Status",
    "TrajectoriesRequest",
    "UnfoldingDiagramsRequest",
    "UnfoldingMapsRequest",
    "canonical",
    "grid_points",
    "grid_values",
    "job_id",
    "motion_label",
    "parse_request",
]
