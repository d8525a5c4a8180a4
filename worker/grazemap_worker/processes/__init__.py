"""The processes: what each of them computes, one module per process, named after it.

The input is a validated request, the output a document (see `grazemap.codec`) with the fields of the class of its
result (see `grazemap.results`), without their deprecated names. The core is imported when a process is first used, so
that this table can be read without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES as REQUESTS
from grazemap_worker.processes.process import Process

PROCESSES: Mapping[str, Process] = {
    name: import_module(f"{__name__}.{name.replace('-', '_')}").PROCESS for name in REQUESTS
}

__all__ = ["PROCESSES", "Process"]
