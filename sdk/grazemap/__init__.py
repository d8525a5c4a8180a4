"""grazemap: grazing bifurcations of impact oscillators, from Python.

    import grazemap

    with grazemap.local() as client:
        curve = client.grazing_curve(grazemap.Oscillator(), omega=(0.05, 1.2), points=2000)

The names below are loaded when they are first used, so that the service and the workers, which need only the wire
models, do not load an HTTP client.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from grazemap import errors, wire
    from grazemap.client import AsyncClient, Client
    from grazemap.client.client import JobHandle
    from grazemap.client.direct import compute, direct
    from grazemap.client.direct_client import DirectClient
    from grazemap.client.events import Event
    from grazemap.client.jobs import AsyncJobHandle
    from grazemap.local_stack import local
    from grazemap.results import (
        BasinFractions,
        Basins,
        BifurcationCurves,
        BifurcationDiagram,
        CodimensionTwoPoints,
        DiscontinuityMapping,
        GrazingCurve,
        OrbitBranch,
        PeriodicOrbit,
        Proof,
        StopGrazingCurves,
        Structure,
        Trajectories,
        Trajectory,
        UnfoldingDiagram,
        UnfoldingMap,
        load,
    )
    from grazemap.version import __version__
    from grazemap.wire import InitialState, Oscillator

# Public names of other modules than `grazemap.results`.
_HOME = {
    "AsyncClient": "grazemap.client",
    "AsyncJobHandle": "grazemap.client.jobs",
    "Client": "grazemap.client",
    "DirectClient": "grazemap.client.direct_client",
    "Event": "grazemap.client.events",
    "InitialState": "grazemap.wire",
    "JobHandle": "grazemap.client.client",
    "Oscillator": "grazemap.wire",
    "__version__": "grazemap.version",
    "compute": "grazemap.client.direct",
    "direct": "grazemap.client.direct",
    "local": "grazemap.local_stack",
}

__all__ = [
    "AsyncClient",
    "AsyncJobHandle",
    "BasinFractions",
    "Basins",
    "BifurcationCurves",
    "BifurcationDiagram",
    "Client",
    "CodimensionTwoPoints",
    "DirectClient",
    "DiscontinuityMapping",
    "Event",
    "GrazingCurve",
    "InitialState",
    "JobHandle",
    "OrbitBranch",
    "Oscillator",
    "PeriodicOrbit",
    "Proof",
    "StopGrazingCurves",
    "Structure",
    "Trajectories",
    "Trajectory",
    "UnfoldingDiagram",
    "UnfoldingMap",
    "__version__",
    "compute",
    "direct",
    "errors",
    "load",
    "local",
    "wire",
]


def __getattr__(name: str) -> Any:
    if name in ("errors", "wire"):
        return import_module(f"grazemap.{name}")
    if name not in __all__:
        raise AttributeError(f"module 'grazemap' has no attribute {name!r}")
    value = getattr(import_module(_HOME.get(name, "grazemap.results")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
