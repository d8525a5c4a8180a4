"""The wire models: the requests, jobs and problems that client, service and worker exchange."""

from grazemap.wire.base import Grid, Interval, Range, grid_points, grid_values
from grazemap.wire.basin_fractions import BasinFractionsRequest, StateRange
from grazemap.wire.basins import BasinCoordinate, BasinsRequest
from grazemap.wire.diagrams import BifurcationDiagramsRequest
from grazemap.wire.job import (
    FINISHED,
    Estimate,
    Forecast,
    Job,
    JobList,
    Link,
    Note,
    Problem,
    ProblemError,
    Progress,
    Status,
    impacts_on,
    motion_label,
)
from grazemap.wire.notes import notes_on, unstated
from grazemap.wire.orbits import (
    BifurcationCurvesRequest,
    CurveMotion,
    OrbitBranchesRequest,
    OrbitMotion,
    PeriodicOrbitsRequest,
)
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.planes import OneParameterRequest, PlaneRequest, UnfoldingMapsRequest
from grazemap.wire.process import Operation, ProcessRequest
from grazemap.wire.processes import PROCESSES, canonical_id, parse_request
from grazemap.wire.proofs import ProofsRequest, Statement
from grazemap.wire.requests import (
    CodimensionTwoPointsRequest,
    DiscontinuityMappingsRequest,
    GrazingCurvesRequest,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
)
from grazemap.wire.states import InitialState
from grazemap.wire.status import Computing, ServiceStatus, Waiting, WorkerState
from grazemap.wire.structure import Base, ClearancePair, Forcing, Matrices
from grazemap.wire.structures import StructuresRequest

__all__ = [
    "FINISHED",
    "PROCESSES",
    "Base",
    "BasinCoordinate",
    "BasinFractionsRequest",
    "BasinsRequest",
    "BifurcationCurvesRequest",
    "BifurcationDiagramsRequest",
    "ClearancePair",
    "CodimensionTwoPointsRequest",
    "Computing",
    "CurveMotion",
    "DiscontinuityMappingsRequest",
    "Estimate",
    "Forcing",
    "Forecast",
    "GrazingCurvesRequest",
    "Grid",
    "InitialState",
    "Interval",
    "Job",
    "JobList",
    "Link",
    "Matrices",
    "Note",
    "OneParameterRequest",
    "Operation",
    "OrbitBranchesRequest",
    "OrbitMotion",
    "Oscillator",
    "PeriodicOrbitsRequest",
    "PlaneRequest",
    "Problem",
    "ProblemError",
    "ProcessRequest",
    "Progress",
    "ProofsRequest",
    "Range",
    "ServiceStatus",
    "StateRange",
    "Statement",
    "Status",
    "StructuresRequest",
    "TrajectoriesRequest",
    "UnfoldingDiagramsRequest",
    "UnfoldingMapsRequest",
    "Waiting",
    "WorkerState",
    "canonical_id",
    "grid_points",
    "grid_values",
    "impacts_on",
    "motion_label",
    "notes_on",
    "parse_request",
    "unstated",
]
