"""The table of all processes: one request model for each.

The client builds a model, the service validates it and the worker parses it; a job's id is made from its canonical
text (`process.canonical`). A process needs no line here: every module of this folder is searched for requests with an
`operation`, `process.Operation`.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from grazemap.wire.process import ProcessRequest

# The order in which documents and messages name the processes; others follow, in the order of their names.
_ORDER = (
    "grazing-curves",
    "codimension-two-points",
    "discontinuity-mappings",
    "trajectories",
    "bifurcation-diagrams",
    "unfolding-maps",
    "unfolding-diagrams",
    "basins",
    "periodic-orbits",
    "orbit-branches",
    "bifurcation-curves",
)


def _requests() -> Iterator[type[ProcessRequest]]:
    for module in iter_modules([str(Path(__file__).parent)], "grazemap.wire."):
        if module.name != __name__:
            for value in vars(import_module(module.name)).values():
                if isinstance(value, type) and issubclass(value, ProcessRequest) and "operation" in vars(value):
                    yield value


def _in_order(process: str) -> tuple[int, str]:
    return _ORDER.index(process) if process in _ORDER else len(_ORDER), process


_FOUND = {request.operation.process: request for request in _requests()}
PROCESSES: dict[str, type[ProcessRequest]] = {process: _FOUND[process] for process in sorted(_FOUND, key=_in_order)}


def parse_request(process: str, body: dict[str, Any]) -> ProcessRequest:
    """Validate a request body. KeyError: no such process; pydantic.ValidationError: bad values."""
    return PROCESSES[process].model_validate(body)
