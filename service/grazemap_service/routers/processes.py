"""POST to a process: one route for each, described by the `operation` of its request."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Annotated, Any

from fastapi import APIRouter, Body, Response

from grazemap.wire import PROCESSES, Job, ProcessRequest
from grazemap_service.links import PREFIX
from grazemap_service.openapi import SUBMISSION_KINDS, problem_responses
from grazemap_service.strict_json import JsonRoute
from grazemap_service.submission import NewSubmission


def _endpoint(model: type[ProcessRequest]) -> Callable[..., Coroutine[Any, Any, Response]]:
    operation = model.operation

    async def submit(body: Any, submission: Any) -> Response:
        return await submission.post(operation.process, body)  # type: ignore[no-any-return]

    examples: Any = {name: {"value": value} for name, value in operation.examples.items()}
    submit.__annotations__ = {
        "body": Annotated[model, Body(openapi_examples=examples)],
        "submission": NewSubmission,
        "return": Response,
    }
    submit.__name__, submit.__doc__ = operation.operation_id, operation.description
    return submit


router = APIRouter(route_class=JsonRoute, tags=["processes"])
for _process, _model in PROCESSES.items():
    router.add_api_route(
        f"{PREFIX}/{_process}",
        _endpoint(_model),
        methods=["POST"],
        operation_id=_model.operation.operation_id,
        summary=_model.operation.summary,
        status_code=201,
        response_description="A new job.",
        responses={
            200: {"model": Job, "description": "The job that computes, or has computed, the same request."},
            201: {"model": Job, "description": "A new job; Location says where."},
            **problem_responses(*SUBMISSION_KINDS),
        },
    )
