"""The process trajectories: motions in time, every impact exact."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import TrajectoriesRequest
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
    "at given times": {"value": {"omega": 0.29, "clearance": 1.6, "periods": 1, "times": [0.0, 0.5, 1.25, 20.0]}},
    "from many states": {
        "value": {
            "omega": 0.29,
            "clearance": 1.6,
            "initial": [{}, {"phase": 1.0}, {"displacement": [1.6, 0.0, 0.0]}],
            "periods": 10,
        }
    },
}

router = process_router()


@router.post("/v1/trajectories", **submission("submit_trajectory", "Trajectories"))
async def submit_trajectory(
    body: Annotated[TrajectoriesRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute a trajectory from each initial state: its impacts, where it ends, the motion that it settles to."""
    return await submission.post("trajectories", body)
