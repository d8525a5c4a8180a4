"""The process basins: which motion every initial state leads to."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import BasinsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "two coexisting motions": {
        "value": {
            "omega": 0.29,
            "clearance": 1.9927,
            "horizontal": {"quantity": "displacement", "mass": 1, "values": {"start": -1.9, "stop": 1.9, "points": 50}},
            "vertical": {"quantity": "velocity", "mass": 1, "values": {"start": -1.0, "stop": 1.0, "points": 50}},
        }
    },
}

router = process_router()


@router.post("/v1/basins", **submission("submit_basins", "Basins of attraction"))
async def submit_basins(
    body: Annotated[BasinsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute the motion that every initial state of a rectangle leads to, and the attractors with their shares."""
    return await submission.post("basins", body)
