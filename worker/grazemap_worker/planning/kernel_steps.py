"""The steps in which kernels are compiled and loaded: what each has, and how long it takes to compile.

A step has all kernels that some computations need. It is made of *components* (`grazemap_core.warmup`), which several
steps may have in common.
"""

from __future__ import annotations

from collections.abc import Sequence

OF_LANES = ("lockstep", "apart")
"""The components that carry the lanes of maps."""
_OF_ORBITS = ("curves", "trajectories", "orbits")
_OF_MAPS = ("classification", "lockstep")
STEPS: dict[str, tuple[str, ...]] = {
    "curves": ("curves",),
    "trajectories": ("trajectories",),
    "maps": _OF_MAPS,
    "orbits": _OF_ORBITS,
    "diagrams": (*_OF_ORBITS, *_OF_MAPS),
    "observables": (*_OF_ORBITS, "observables"),
    "map_observables": (*_OF_ORBITS, *_OF_MAPS, "map_observables"),
}
STEPS |= {f"apart_{name}": (*STEPS[name], "apart") for name in ("maps", "diagrams", "map_observables")}
FIRST_STEPS = ("curves", "trajectories", "maps", "orbits", "diagrams")
"""The steps of a first start, in their order: computations without observables."""
COMPONENT_SECONDS = {
    "curves": 6.0,
    "trajectories": 17.0,
    "classification": 18.0,
    "orbits": 20.0,
    "lockstep": 37.0,
    "apart": 34.0,
    "observables": 5.0,
    "map_observables": 6.0,
}
"""Processor time in which a process compiles a component, after those that come before it at a first start."""


def is_step(name: str) -> bool:
    """Return whether a step has this name."""
    return name in STEPS


def components_of(step: str) -> tuple[str, ...]:
    """Return the components of a step."""
    return STEPS[step]


def shares(missing: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the components that each of two processes compiles, in the order in which they are wanted.

    The second process compiles those that carry lanes. Before them it takes what is wanted first, if a map is ready
    sooner then.
    """
    others = [component for component in missing if component not in OF_LANES]
    of_lanes = [component for component in missing if component in OF_LANES]
    while of_lanes:
        for_maps = others[: max((others.index(name) + 1 for name in _OF_MAPS if name in others), default=0)]
        sooner = max(_seconds(for_maps[1:]), _seconds([*for_maps[:1], *of_lanes]))
        if not for_maps or sooner >= max(_seconds(for_maps), _seconds(of_lanes)):
            break
        of_lanes.insert(0, others.pop(0))
    return others, of_lanes


def _seconds(components: Sequence[str]) -> float:
    return sum(COMPONENT_SECONDS[component] for component in components)
