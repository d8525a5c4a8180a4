"""From pydantic's errors to a problem: where (JSON pointer), what, and what is allowed; never the value itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from grazemap.errors import ParameterError
from grazemap.models import PROCESSES, Problem, ProblemError, ProcessRequest, parse_request

INVALID_PARAMETERS_TITLE = "Invalid parameters"


def validated(process: str, body: Mapping[str, Any] | ProcessRequest) -> ProcessRequest:
    """Return the request of a process as its wire model.

    Raises
    ------
    ParameterError
        No such process, or values that are not allowed; nothing has been sent.
    """
    if process not in PROCESSES:
        raise parameter_error("", "there is no such process", ", ".join(PROCESSES))
    if isinstance(body, ProcessRequest):
        if not isinstance(body, PROCESSES[process]):
            raise parameter_error("", "the request belongs to another process", PROCESSES[process].__name__)
        return body
    try:
        return parse_request(process, dict(body))
    except ValidationError as error:
        raise ParameterError(_problem([_item(details) for details in error.errors(include_url=False)])) from None


def parameter_error(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one thing wrong with the arguments."""
    return ParameterError(_problem([ProblemError(pointer=pointer, detail=detail, allowed=allowed)]))


def _problem(errors: list[ProblemError]) -> Problem:
    return Problem(
        type="about:blank",
        title=INVALID_PARAMETERS_TITLE,
        status=422,
        detail="nothing was computed",
        errors=errors,
    )


def _item(details: ErrorDetails) -> ProblemError:
    return ProblemError(pointer=_pointer(details["loc"]), detail=details["msg"], allowed=_allowed(details))


def _pointer(location: tuple[int | str, ...]) -> str:
    """Return the JSON pointer (RFC 6901); the names of union branches, "[range]", are no part of the body."""
    steps = [str(step) for step in location if not (str(step).startswith("[") and str(step).endswith("]"))]
    return "".join("/" + step.replace("~", "~0").replace("/", "~1") for step in steps)


def _allowed(details: ErrorDetails) -> str:
    context = details.get("ctx") or {}
    if "allowed" in context:
        return str(context["allowed"])
    if "expected" in context:
        return str(context["expected"])
    for key, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<=")):
        if key in context:
            return f"{sign} {context[key]}"
    if "min_length" in context:
        return f"at least {context['min_length']} values"
    return _ALLOWED_BY_TYPE.get(details["type"], "")


_ALLOWED_BY_TYPE = {
    "extra_forbidden": "no further fields",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "list_type": "a list",
    "missing": "the field must be given",
}
