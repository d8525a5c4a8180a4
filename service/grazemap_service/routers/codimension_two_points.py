"""The process codimension-two-points: where grazing coincides with a recurrence or a resonance."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import CodimensionTwoPointsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "default oscillator": {"value": {"omega": {"start": 0.25, "stop": 0.35}, "max_order": 4}},
}

router = process_router()


@router.post("/v1/codimension-two-points", **submission("submit_codimension_two_points", "Codimension-two points"))
async def submit_codimension_two_points(
    body: Annotated[CodimensionTwoPointsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute every codimension-two point of the grazing curve over an interval of omega."""
    return await submission.post("codimension-two-points", body)
