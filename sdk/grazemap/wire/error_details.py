"""Errors of a request, from those of pydantic: pointer, detail, and what is allowed.

Client and service use the same texts. The service repeats nothing that was sent; for an unknown field it gives the
closest known name. The client also gives the unknown name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from grazemap.wire.error_texts import Schema, error_text, schema_of
from grazemap.wire.job import ProblemError

MAX_ERRORS = 20


def errors_of(
    errors: Sequence[Mapping[str, Any]], model: type[BaseModel] | None, *, naming: bool = False
) -> list[ProblemError]:
    """Return pydantic's errors as those of a problem.

    Parameters
    ----------
    errors : sequence of mappings
        As from ``ValidationError.errors()``; each location begins with "body" or "query".
    model : type or None
        The model of the body, if there is one.
    naming : bool
        Whether unknown fields are named; the service does not repeat them.

    Returns
    -------
    list of ProblemError
        At most `MAX_ERRORS`, those of unknown fields first, as they explain missing ones. Pointers are JSON pointers
        into the body, ``?name`` for a query parameter.
    """
    schema = schema_of(model) if model is not None else {}
    ordered = sorted(errors, key=lambda error: error["type"] != "extra_forbidden")
    return [_error(error, schema, naming) for error in ordered[:MAX_ERRORS]]


def _error(error: Mapping[str, Any], schema: Schema, naming: bool) -> ProblemError:
    text = error_text(error, schema, naming)
    return ProblemError(pointer=_pointer(text.source, text.where), detail=text.detail, allowed=text.allowed)


def _pointer(source: Any, where: Iterable[Any]) -> str:
    parts = [str(part).replace("~", "~0").replace("/", "~1") for part in where]
    return "".join("/" + part for part in parts) if source == "body" else "?" + ".".join(parts)
