"""Errors of a request, from those of pydantic: pointer, detail, and what is allowed.

Client and service use the same texts. The service repeats nothing that was sent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from grazemap.constants import UNITS
from grazemap.wire.job import ProblemError

MAX_ERRORS = 20


def errors_of(errors: Sequence[Mapping[str, Any]], *, naming: bool = False) -> list[ProblemError]:
    """Return pydantic's errors as those of a problem.

    Parameters
    ----------
    errors : sequence of mappings
        As from ``ValidationError.errors()``; each location begins with "body" or "query".
    naming : bool
        Whether unknown fields and values are named; the service does not repeat them.

    Returns
    -------
    list of ProblemError
        At most `MAX_ERRORS`, those of unknown fields first, as they explain missing ones. Pointers are JSON pointers
        into the body, ``?name`` for a query parameter.
    """
    ordered = sorted(errors, key=lambda error: error["type"] != "extra_forbidden")
    return [_error(error, naming) for error in ordered[:MAX_ERRORS]]


def _error(error: Mapping[str, Any], naming: bool) -> ProblemError:
    source, *where = error["loc"] or ("body",)
    context = {"detail": error["msg"], "value": "", "hint": "", "allowed": ""} | error.get("ctx", {})
    if source != "body":
        # of FastAPI, whose message ends with what is allowed: "Input should be greater than 0"
        allowed = context["detail"].partition(" should ")[2].removeprefix("be ")
        return ProblemError(pointer=f"?{'.'.join(map(str, where))}", detail=context["detail"], allowed=allowed)
    if error["type"] == "extra_forbidden":
        where.pop()  # the pointer is that of the object
    where += context.get("at", ())
    allowed = context["allowed"]
    if error["type"] == "float_type" and (unit := next((UNITS[part] for part in where[::-1] if part in UNITS), "")):
        allowed += f", in {unit} in SI"
    pointer = "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in where)
    detail = context["detail"] + (context["value"] if naming else "") + context["hint"]
    return ProblemError(pointer=pointer, detail=detail, allowed=allowed)
