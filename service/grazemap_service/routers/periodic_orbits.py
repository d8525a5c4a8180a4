"""The process periodic-orbits: a motion with impacts, solved for, with its multipliers, and whether it is one."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from grazemap.wire import PeriodicOrbitsRequest
from grazemap_service.routers._process import process_router, submission
from grazemap_service.submission import NewSubmission

EXAMPLES = {
    "default oscillator": {
        "value": {"omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}}
    },
}

router = process_router()


@router.post("/v1/periodic-orbits", **submission("submit_periodic_orbits", "Periodic orbit"))
async def submit_periodic_orbits(
    body: Annotated[PeriodicOrbitsRequest, Body(openapi_examples=EXAMPLES)], submission: NewSubmission
) -> Response:
    """Compute the periodic orbit near some impacts, with its multipliers, and whether it is a motion."""
    return await submission.post("periodic-orbits", body)
