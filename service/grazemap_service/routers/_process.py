"""What the routers of all processes share: the anatomy of a POST that makes a job."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from grazemap.wire import Job
from grazemap_service.openapi import SUBMISSION_KINDS, problem_responses
from grazemap_service.strict_json import JsonRoute


def process_router() -> APIRouter:
    """Return an empty router whose bodies are checked JSON."""
    return APIRouter(route_class=JsonRoute, tags=["processes"])


def submission(operation_id: str, summary: str) -> dict[str, Any]:
    """Return the keywords of a route that submits a request."""
    return {
        "operation_id": operation_id,
        "summary": summary,
        "status_code": 201,
        "response_description": "A new job.",
        "responses": {
            200: {"model": Job, "description": "The job that computes, or has computed, the same request."},
            201: {"model": Job, "description": "A new job; Location says where."},
            **problem_responses(*SUBMISSION_KINDS),
        },
    }
