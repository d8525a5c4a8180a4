"""The processes: what each of them costs and computes, one module per process, named after it.

The input is a validated request, the output a document that `document_of` makes with the class of the result (see
`grazemap.results`). The core is imported when a process first computes, so that the service can plan requests without
it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES as REQUESTS
from grazemap.wire import ProcessRequest
from grazemap.wire.observables import ObservedRequest
from grazemap_worker.processes.process import Process, Report

PROCESSES: Mapping[str, Process] = {
    name: import_module(f"{__name__}.{name.replace('-', '_')}").PROCESS for name in REQUESTS
}


def kernels_of(name: str, request: ProcessRequest) -> str:
    """Return the name of the kernels that a request needs: those of maps depend on the number of masses."""
    process, size = PROCESSES[name], request.oscillator.size
    kernels = process.kernels
    if isinstance(request, ObservedRequest) and request.observed:
        kernels = "map_observables" if process.of_masses else "observables"
    if process.apart(request):
        kernels = f"apart_{kernels}"
    return f"{kernels}-{size}" if process.of_masses else kernels


__all__ = ["PROCESSES", "Process", "Report", "kernels_of"]
