"""The process discontinuity-mappings: what an impact does to motions near a graze."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import DiscontinuityMappingsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "default oscillator": {"value": {"omega": 0.29, "overshoot": [1e-6, 1e-5, 1e-4, 1e-3], "returns": 4}},
}

router = process_router()


@router.post(
    "/v1/discontinuity-mappings", **submission("submit_discontinuity_mappings", "Discontinuity mapping at a graze")
)
async def submit_discontinuity_mappings(
    body: Annotated[DiscontinuityMappingsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute the discontinuity mapping at a grazing point, its error, and the returns of the motion below grazing."""
    return await submission.post("discontinuity-mappings", body)
