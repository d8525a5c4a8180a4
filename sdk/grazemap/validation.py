"""Requests are validated where they are made, before anything is sent; a wrong one raises ParameterError."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from grazemap.errors import ParameterError
from grazemap.suggestions import suggestion
from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.problems import parameter_error, refusal


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
    return model.checked(body)


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
