"""The process bifurcation-diagrams: settled motions along clearance or omega."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import BifurcationDiagramsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "along the clearance": {
        "value": {"vary": "clearance", "range": {"start": 1.5, "stop": 2.0, "points": 51}, "omega": 0.29}
    },
}

router = process_router()


@router.post("/v1/bifurcation-diagrams", **submission("submit_bifurcation_diagrams", "Bifurcation diagram"))
async def submit_bifurcation_diagrams(
    body: Annotated[BifurcationDiagramsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute stroboscopic points, impact velocities and the motion at every value of one parameter."""
    return await submission.post("bifurcation-diagrams", body)
