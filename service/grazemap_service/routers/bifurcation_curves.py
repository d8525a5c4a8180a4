"""The process bifurcation-curves: borders between motions, with few impacts or named."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import BifurcationCurvesRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "the paper's window": {"value": {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}},
    "of a motion": {
        "value": {
            "omega": {"start": 0.26, "stop": 0.3},
            "clearance": {"start": 1.3, "stop": 2.05},
            "motions": [{"period": 1, "stops": [1, 1, -1, -1], "omega": 0.28, "clearance": 1.5}],
        }
    },
}

router = process_router()


@router.post("/v1/bifurcation-curves", **submission("submit_bifurcation_curves", "Bifurcation curves"))
async def submit_bifurcation_curves(
    body: Annotated[BifurcationCurvesRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute the curves SN, PD, SB, NS and GR of motions in a window of omega and clearance."""
    return await submission.post("bifurcation-curves", body)
