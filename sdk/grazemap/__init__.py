"""grazemap: grazing bifurcations of impact oscillators, from Python.

    import grazemap

    with grazemap.local() as client:
        curve = client.grazing_curve(grazemap.Oscillator(), omega=(0.05, 1.2), points=2000)

The names below are loaded when they are first used, so that the service and the workers, which need only the wire
models, do not load an HTTP client with them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from grazemap import errors, models
    from grazemap.async_client import AsyncClient
    from grazemap.client import Client
    from grazemap.effects import Event
    from grazemap.embedded import local
    from grazemap.jobs import AsyncJobHandle, JobHandle
    from grazemap.models import InitialState, Oscillator
    from grazemap.results import (
        Basins,
        BifurcationCurves,
        BifurcationDiagram,
        CodimensionTwoPoints,
        DiscontinuityMapping,
        GrazingCurve,
        OrbitBranch,
        PeriodicOrbit,
        Trajectories,
        Trajectory,
        UnfoldingDiagram,
        UnfoldingMap,
        load,
    )
    from grazemap.version import __version__

_HOME = {
    "AsyncClient": "grazemap.async_client",
    "AsyncJobHandle": "grazemap.jobs",
    "Basins": "grazemap.results",
    "BifurcationCurves": "grazemap.results",
    "BifurcationDiagram": "grazemap.results",
    "Client": "grazemap.client",
    "CodimensionTwoPoints": "grazemap.results",
    "DiscontinuityMapping": "grazemap.results",
    "Event": "grazemap.effects",
    "GrazingCurve": "grazemap.results",
    "InitialState": "grazemap.models",
    "JobHandle": "grazemap.jobs",
    "OrbitBranch": "grazemap.results",
    "Oscillator": "grazemap.models",
    "PeriodicOrbit": "grazemap.results",
    "Trajectories": "grazemap.results",
    "Trajectory": "grazemap.results",
    "UnfoldingDiagram": "grazemap.results",
    "UnfoldingMap": "grazemap.results",
    "__version__": "grazemap.version",
    "load": "grazemap.results",
    "local": "grazemap.embedded",
}

__all__ = [
    "AsyncClient",
    "AsyncJobHandle",
    "Basins",
    "BifurcationCurves",
    "BifurcationDiagram",
    "Client",
    "CodimensionTwoPoints",
    "DiscontinuityMapping",
    "Event",
    "GrazingCurve",
    "InitialState",
    "JobHandle",
    "OrbitBranch",
    "Oscillator",
    "PeriodicOrbit",
    "Trajectories",
    "Trajectory",
    "UnfoldingDiagram",
    "UnfoldingMap",
    "__version__",
    "errors",
    "load",
    "local",
    "models",
]


def __getattr__(name: str) -> Any:
    if name in ("errors", "models"):
        return import_module(f"grazemap.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'grazemap' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
