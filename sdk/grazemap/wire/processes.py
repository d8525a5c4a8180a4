"""The table of all processes, and the functions that apply to the request of any of them.

The client builds a model, the service validates it and the worker parses it; a job's id is the hash of its canonical
text. Equal requests have the same id: defaults are filled in, 1 equals 1.0, -0.0 equals 0.0, and the order of keys does
not matter. The modules of this folder are searched for requests with an `operation` (`process.Operation`);
`process_names` has their order.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from grazemap.process_names import SUMMARIES
from grazemap.wire.process import ProcessRequest


def _requests() -> Iterator[type[ProcessRequest]]:
    for module in iter_modules([str(Path(__file__).parent)], "grazemap.wire."):
        if module.name != __name__:
            for value in vars(import_module(module.name)).values():
                if isinstance(value, type) and issubclass(value, ProcessRequest) and "operation" in vars(value):
                    yield value


_BY_NAME = {request.operation.process: request for request in _requests()}
PROCESSES: dict[str, type[ProcessRequest]] = {
    process: _BY_NAME[process] for process in sorted(_BY_NAME, key=list(SUMMARIES).index)
}


def parse_request(process: str, body: dict[str, Any]) -> ProcessRequest:
    """Validate a request body. Raises KeyError (no such process) and pydantic.ValidationError."""
    return PROCESSES[process].model_validate(body)


def canonical_id(process: str, values: Mapping[str, Any], core_version: str) -> str:
    """Return the id of a canonical request's job: the sha256, in hex, of process, core version and request."""
    text = json.dumps(
        {"process": process, "core_version": core_version, "request": values},
        sort_keys=True,
        separators=(",", ":"),
        allow_nan=False,
    )
    return hashlib.sha256(text.encode()).hexdigest()
