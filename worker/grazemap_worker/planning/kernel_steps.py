"""The steps in which kernels are compiled and loaded: what each has, and how long it takes to compile.

A step has all kernels that some computations need. It is made of *components* (`grazemap_core.warmup`), which several
steps may have in common.
"""

from __future__ import annotations

from collections.abc import Collection

OF_LANES = ("lockstep", "apart")
"""The components that carry the lanes of maps. A process compiles them while another one compiles the others."""
_OF_ORBITS = ("curves", "trajectories", "orbits")
_OF_MAPS = ("classification", "lockstep")
_STEPS: dict[str, tuple[str, ...]] = {
    "curves": ("curves",),
    "trajectories": ("trajectories",),
    "maps": _OF_MAPS,
    "orbits": _OF_ORBITS,
    "diagrams": (*_OF_ORBITS, *_OF_MAPS),
    "observables": (*_OF_ORBITS, "observables"),
    "map_observables": (*_OF_ORBITS, *_OF_MAPS, "map_observables"),
}
_STEPS |= {f"apart_{name}": (*_STEPS[name], "apart") for name in ("maps", "diagrams", "map_observables")}
FIRST_STEPS = ("curves", "trajectories", "maps", "orbits", "diagrams")
"""The steps of a first start, in their order: computations without observables."""
# Processor time in which a process compiles a component, after those that come before it at a first start.
_COMPONENT_SECONDS = {
    "curves": 6.0,
    "trajectories": 13.0,
    "classification": 24.0,
    "orbits": 24.0,
    "lockstep": 34.0,
    "apart": 20.0,
    "observables": 10.0,
    "map_observables": 10.0,
}


def is_step(name: str) -> bool:
    """Return whether a step has this name."""
    return name in _STEPS


def components_of(step: str) -> tuple[str, ...]:
    """Return the components of a step."""
    return _STEPS[step]


def compiling_seconds(step: str, compiled: Collection[str] = ()) -> float:
    """Return about how long two processes take to compile a step, without the components that are compiled already."""
    missing = [component for component in components_of(step) if component not in compiled]
    of_lanes = sum(_COMPONENT_SECONDS[component] for component in missing if component in OF_LANES)
    return max(of_lanes, sum(_COMPONENT_SECONDS[component] for component in missing) - of_lanes)
