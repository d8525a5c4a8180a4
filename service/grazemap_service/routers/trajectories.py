"""The process trajectories: one motion in time, every impact exact."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.models import TrajectoriesRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "from rest": {"value": {"omega": 0.29, "clearance": 1.6, "periods": 20, "samples_per_period": 50}},
    "from an initial state": {
        "value": {
            "omega": 0.29,
            "clearance": 1.6,
            "initial": {"displacement": [0.1, 0.0, 0.0], "velocity": [0.0, 0.2, 0.0], "phase": 0.5},
            "periods": 10,
            "transient_periods": 100,
        }
    },
}

router = process_router()


@router.post("/v1/trajectories", **submission("submit_trajectory", "Trajectory"))
async def submit_trajectory(
    body: Annotated[TrajectoriesRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute one trajectory, its impacts, and the motion that it settles to."""
    return await submission.post("trajectories", body)
