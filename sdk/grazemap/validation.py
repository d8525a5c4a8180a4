"""Requests are validated where they are made, before anything is sent; a wrong one raises ParameterError."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from grazemap.errors import ParameterError
from grazemap.suggestions import suggestion
from grazemap.wire import PROCESSES, ProblemError, ProcessRequest
from grazemap.wire.error_details import errors_of
from grazemap.wire.problems import make_problem


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
        return model.model_validate(dict(body))
    except ValidationError as error:
        details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
        raise parameter_error(errors_of(details, naming=True)) from None


def validated_each(process: Any, requests: Iterable[Any]) -> list[ProcessRequest]:
    """Return the requests of `Client.map` as their wire models.

    Raises ParameterError, whose pointers begin with the place of the request, as those of a batch do.
    """
    pairs = ((process, request) for request in requests) if isinstance(process, str) else process
    models = []
    for index, pair in enumerate(pairs):
        try:
            if isinstance(pair, ProcessRequest):
                models.append(validated(pair.operation.process, pair))
            elif isinstance(pair, tuple) and len(pair) == 2:
                models.append(validated(*pair))
            else:
                raise refusal("", "this is no request", "a wire model, or a pair (process, request)")
        except ParameterError as error:
            place = f"/requests/{index}/request"
            below = [each.model_copy(update={"pointer": place + each.pointer}) for each in error.problem.errors]
            raise parameter_error(below) from None
    return models


def parameter_error(errors: Sequence[ProblemError]) -> ParameterError:
    """Return the exception for errors in a request that was not sent."""
    return ParameterError(make_problem("invalid-request", errors=errors))


def refusal(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one error in a request that was not sent."""
    return parameter_error([ProblemError(pointer=pointer, detail=detail, allowed=allowed)])
