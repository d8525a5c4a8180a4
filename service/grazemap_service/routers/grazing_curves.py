"""The process grazing-curves: the curve on which the steady motion touches both stops."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import GrazingCurvesRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "default oscillator": {"value": {"omega": {"start": 0.05, "stop": 1.2, "points": 200}}},
    "one mass in SI units": {
        "value": {
            "oscillator": {
                "units": "SI",
                "masses": [2.0],
                "stiffnesses": [800.0],
                "damping": 0.001,
                "forcing": [12.0],
                "restitution": 0.7,
            },
            "omega": [10.0, 15.0, 22.5, 30.0],
            "max_order": 4,
        }
    },
}

router = process_router()


@router.post("/v1/grazing-curves", **submission("submit_grazing_curve", "Grazing curve"))
async def submit_grazing_curve(
    body: Annotated[GrazingCurvesRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute clearance = A(omega), with phase and first recurrence."""
    return await submission.post("grazing-curves", body)
