"""The processes: how each is planned and computed. Each process has a module of its name.

The input is a validated request. The output is a document that `document_of` makes with the class of the result (see
`grazemap.results`). The core is imported when a process first computes, so that the service can plan requests without
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.observables import ObservedRequest
from grazemap_worker.processes.process import Process, Report

IMPLEMENTATIONS: Mapping[str, Process] = {
    name: import_module(f"{__name__}.{name.replace('-', '_')}").PROCESS for name in PROCESSES
}


def kernels_of(name: str, request: ProcessRequest) -> str:
    """Return the name of the kernels that a request needs."""
    process = IMPLEMENTATIONS[name]
    kernels = "diagrams" if process.runs_lanes(request) else process.kernels
    if isinstance(request, ObservedRequest) and request.observed:
        kernels = "map_observables" if kernels in ("maps", "diagrams") else "observables"
    return f"apart_{kernels}" if process.own_tables(request) else kernels


__all__ = ["IMPLEMENTATIONS", "Process", "Report", "kernels_of"]
