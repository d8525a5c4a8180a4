"""The plan of any request. The service makes it, without the core, and the worker reads it.

What a process costs, and what of it a server limits, stands in the module of this folder that is named as the process,
in its `PLANNING`. Only maps and basins have more than one tile.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES, ProcessRequest
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning


def _planning(process: str) -> Planning:
    found: Planning = import_module(f"{__package__}.{process.replace('-', '_')}").PLANNING
    return found


PLANNING: Mapping[str, Planning] = {process: _planning(process) for process in PROCESSES}


def plan(process: str, request: ProcessRequest) -> Plan:
    """Return the tiles of a request and its estimate.

    Raises
    ------
    KeyError
        There is no such process.
    """
    return PLANNING[process].plan(request)
