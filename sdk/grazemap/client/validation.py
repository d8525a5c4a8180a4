"""Checks of a request against its wire model, before anything is sent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from grazemap.errors import ParameterError
from grazemap.wire import PROCESSES, Problem, ProblemError, ProcessRequest, parse_request
from grazemap.wire.error_details import errors_of

# The service's own words for the same problem.
INVALID_REQUEST = Problem(
    type="urn:grazemap:problem:invalid-request",
    title="Invalid request",
    status=422,
    detail="Values are missing, unknown or out of range; see errors.",
)


def validated(process: str, body: Mapping[str, Any] | ProcessRequest) -> ProcessRequest:
    """Return the request of a process as its wire model.

    Raises
    ------
    ParameterError
        There is no such process, or a value is not allowed.
    """
    if not isinstance(process, str) or process not in PROCESSES:
        raise parameter_error("", "there is no such process", ", ".join(PROCESSES))
    model = PROCESSES[process]
    if isinstance(body, ProcessRequest):
        if not isinstance(body, model):
            raise parameter_error("", "the request belongs to another process", model.__name__)
        return body
    if not isinstance(body, Mapping):
        raise parameter_error("", "the request is not an object", "a mapping, as the HTTP interface takes it")
    try:
        return parse_request(process, dict(body))
    except ValidationError as error:
        details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
        errors = errors_of(details, model, naming=True)
        raise ParameterError(INVALID_REQUEST.model_copy(update={"errors": errors})) from None


def parameter_error(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one wrong argument."""
    error = ProblemError(pointer=pointer, detail=detail, allowed=allowed)
    return ParameterError(INVALID_REQUEST.model_copy(update={"errors": [error]}))
