"""The process unfolding-diagrams: a map with the curves and points that are drawn over it, its borders explained."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import UnfoldingDiagramsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "coarse diagram near the paper's codimension-two point": {
        "value": {
            "omega": {"start": 0.275, "stop": 0.29, "points": 16},
            "clearance": {"start": 1.8, "stop": 2.0, "points": 16},
            "max_periods": 400,
        }
    },
}

router = process_router()


@router.post("/v1/unfolding-diagrams", **submission("submit_unfolding_diagram", "Unfolding diagram"))
async def submit_unfolding_diagram(
    body: Annotated[UnfoldingDiagramsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute an unfolding map, the curves and points over it, and for every border of its regions what it is."""
    return await submission.post("unfolding-diagrams", body)
