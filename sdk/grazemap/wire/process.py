"""What the requests of all processes share: fields, numbers, their canonical text and the job id made from it.

The same request has the same id: defaults are filled in, 1 is 1.0, -0.0 is 0.0, and the order of keys does not count.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field

from grazemap.wire.base import Listable, Request
from grazemap.wire.oscillator import Oscillator

Count = Annotated[int, Field(ge=1), Listable]
MaxPeriods = Annotated[int, Field(ge=1, le=1_000_000), Listable]
LONGEST_PERIOD = 256
MaxPeriod = Annotated[int, Field(ge=1, le=LONGEST_PERIOD), Listable]


@dataclass(frozen=True)
class Operation:
    """What the API's document says of a process.

    Attributes
    ----------
    process : str
        Its name, and the last part of its address.
    operation_id, summary, description : str
    examples : dict
        Requests that can be posted as they are, by their names.
    """

    process: str
    operation_id: str
    summary: str
    description: str
    examples: Mapping[str, Mapping[str, Any]]


class ProcessRequest(Request):
    """What the requests of all processes share; a class with an `operation` is the request of a process."""

    operation: ClassVar[Operation]

    oscillator: Oscillator = Oscillator()
    """The chain of masses; fields that are left out are those of the paper's example."""


def canonical(request: ProcessRequest) -> dict[str, Any]:
    """Return the request as plain JSON values with every default filled in."""
    folded: dict[str, Any] = _folded(request.model_dump(mode="json"))
    return folded


def job_id(process: str, request: ProcessRequest, core_version: str) -> str:
    """Return the content-addressed id of a request's job."""
    return canonical_id(process, canonical(request), core_version)


def canonical_id(process: str, values: Mapping[str, Any], core_version: str) -> str:
    """Return the id of a canonical request's job: the sha256, in hex, of process, core version and request."""
    text = json.dumps(
        {"process": process, "core_version": core_version, "request": values},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def _folded(value: Any) -> Any:
    if isinstance(value, float):
        return value + 0.0
    if isinstance(value, list):
        return [_folded(item) for item in value]
    if isinstance(value, dict):
        return {key: _folded(item) for key, item in value.items()}
    return value
