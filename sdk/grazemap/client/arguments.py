"""Validates requests before anything is sent: the errors of a body become a ParameterError, as the service's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from grazemap.errors import ParameterError
from grazemap.wire import PROCESSES, Problem, ProblemError, ProcessRequest, parse_request
from grazemap.wire.error_details import errors_of
from grazemap.wire.error_texts import suggestion

# The title and the detail of the service's problem.
_INVALID_REQUEST = Problem(
    type="urn:grazemap:problem:invalid-request",
    title="Invalid request",
    status=422,
    detail="Values are missing, unknown or out of range; the errors name each of them.",
)


def validated(process: str, body: Mapping[str, Any] | ProcessRequest) -> ProcessRequest:
    """Return the request of a process as its wire model.

    Raises
    ------
    ParameterError
        There is no such process, or a value is not allowed.
    """
    if not isinstance(process, str) or process not in PROCESSES:
        near = suggestion(process, PROCESSES) if isinstance(process, str) else ""
        raise refusal("", f"there is no such process{near}", ", ".join(PROCESSES))
    model = PROCESSES[process]
    if isinstance(body, ProcessRequest):
        if not isinstance(body, model) or body.operation is not model.operation:
            raise refusal("", "the request belongs to another process", model.__name__)
        return body
    if not isinstance(body, Mapping):
        raise refusal("", "the request is not an object", "a mapping, as the HTTP interface takes it")
    try:
        return parse_request(process, dict(body))
    except ValidationError as error:
        details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
        raise parameter_error(errors_of(details, model, naming=True)) from None


def validated_each(process: Any, requests: Iterable[Any]) -> list[ProcessRequest]:
    """Return the requests of `Client.map` as their wire models.

    Raises ParameterError, whose pointers begin with the place of the request, as those of a batch do.
    """
    named = isinstance(process, str)
    found = []
    for index, one in enumerate(requests if named else process):
        try:
            if named:
                found.append(validated(process, one))
            elif isinstance(one, ProcessRequest):
                found.append(validated(one.operation.process, one))
            elif isinstance(one, tuple) and len(one) == 2:
                found.append(validated(*one))
            else:
                raise refusal("", "this is no request", "a wire model, or a pair (process, request)")
        except ParameterError as error:
            place = f"/requests/{index}/request"
            below = [each.model_copy(update={"pointer": place + each.pointer}) for each in error.problem.errors]
            raise parameter_error(below) from None
    return found


def parameter_error(errors: Sequence[ProblemError]) -> ParameterError:
    """Return the exception for errors in a request that was not sent."""
    return ParameterError(_INVALID_REQUEST.model_copy(update={"errors": errors}))


def refusal(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one error in a request that was not sent."""
    return parameter_error([ProblemError(pointer=pointer, detail=detail, allowed=allowed)])
