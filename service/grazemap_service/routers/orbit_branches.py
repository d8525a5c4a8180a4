"""The process orbit-branches: the branch of a periodic orbit over a parameter, with its special points."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import OrbitBranchesRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "default oscillator": {
        "value": {
            "omega": 0.27,
            "clearance": 1.85,
            "motion": {"period": 1, "stops": [1]},
            "range": {"start": 1.8, "stop": 1.9},
        }
    },
    "over restitution": {
        "value": {
            "omega": 0.29,
            "clearance": 1.6,
            "motion": {"period": 1, "stops": [1, 1, -1, -1]},
            "vary": "restitution",
            "range": {"start": 0.5, "stop": 1.0},
        }
    },
}

router = process_router()


@router.post("/v1/orbit-branches", **submission("submit_orbit_branches", "Branch of a periodic orbit"))
async def submit_orbit_branches(
    body: Annotated[OrbitBranchesRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Follow the branch of a periodic orbit over a parameter, with its special points and what lies beyond them."""
    return await submission.post("orbit-branches", body)
