"""The process unfolding-maps: the motion at each point of a rectangle of omega and clearance."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import UnfoldingMapsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

_WINDOW = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 32},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 32},
    "max_periods": 200,
}
EXAMPLES = {
    "coarse map of the default oscillator": {
        "value": {
            "omega": {"start": 0.26, "stop": 0.30, "points": 16},
            "clearance": {"start": 1.3, "stop": 2.0, "points": 16},
            "max_periods": 200,
        }
    },
    "map computed where neighbours differ": {"value": {**_WINDOW, "adaptive": True}},
    "names of motions, soon": {"value": {**_WINDOW, "preview": True}},
}

router = process_router()


@router.post("/v1/unfolding-maps", **submission("submit_unfolding_map", "Unfolding map"))
async def submit_unfolding_map(
    body: Annotated[UnfoldingMapsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute the motion that each point of a grid settles to; its tiles can be fetched before the map is whole."""
    return await submission.post("unfolding-maps", body)
