"""Compilation of the kernels by steps, so that processes that are forked afterwards inherit the machine code.

A step has all kernels that some computations need: each of these is run on a small case. The kernels of maps have the
number of masses as a constant, so there is a step for each number. What a step has in common with one before is not
compiled again, as the kernels are cached (`kernel_folder`); several processes can compile different steps at the same
time:

    python -m grazemap_core.warmup maps-3
    python -m grazemap_core.warmup curves trajectories orbits
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from grazemap_core.kernel_folder import record
from grazemap_core.model.oscillator import Oscillator

OMEGA = np.array([0.28, 0.29])


def _curves(oscillator: Oscillator) -> None:
    from grazemap_core.grazing.codimension_two import codimension_two_points
    from grazemap_core.grazing.curve import grazing_curve

    grazing_curve(oscillator, OMEGA, max_order=2)
    codimension_two_points(oscillator, 0.25, 0.35, max_order=2, max_multiple=1)


def _trajectories(oscillator: Oscillator) -> None:
    from grazemap_core.simulation.trajectories import trajectory

    trajectory(oscillator, 0.29, 1.6, periods=2, samples_per_period=4).at(OMEGA)


def _maps(oscillator: Oscillator) -> None:
    from grazemap_core.maps.unfolding import unfolding_map_tile

    unfolding_map_tile(oscillator, OMEGA, np.array([1.6]), max_periods=4, max_period=2)


def _orbits(oscillator: Oscillator) -> None:
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.grazing.discontinuity_mapping import mapping_error
    from grazemap_core.grazing.poincare_map import compare_returns
    from grazemap_core.grazing.point import grazing_point
    from grazemap_core.orbits.one_impact_branches import one_impact_branch
    from grazemap_core.orbits.periodic_orbits import periodic_orbit
    from grazemap_core.orbits.search import sequence_of_stops

    one_impact_branch(oscillator, 0.28)
    point = grazing_point(oscillator, 0.29, 1)
    mapping_error(point, np.array([1e-6]))
    compare_returns(point, np.zeros(len(point.state)), 2, 1e-6, "exact")
    guess = sequence_of_stops(oscillator, 0.27, 1.85, 1, [1])
    assert guess is not None  # it is None for one impact per period
    orbit = periodic_orbit(oscillator, 0.27, 1.85, guess)
    orbit_branch(oscillator, orbit, 1.84, 1.86, max_points=2)


_STEPS: dict[str, tuple[Callable[[Oscillator], None], ...]] = {
    "curves": (_curves,),
    "trajectories": (_trajectories,),
    "maps": (),
    "orbits": (_curves, _trajectories, _orbits),
    "diagrams": (_curves, _trajectories, _orbits),
}
# those that have the kernels of maps, too, for the number of masses in their name
_OF_MASSES = ("maps", "diagrams")
STEPS = ("curves", "trajectories", "maps-3", "orbits", "diagrams-3")
"""The steps of a first start, in their order: all computations, those with maps for three masses."""


def masses_of(step: str) -> int | None:
    """Return the number of masses that a step is for; None if it is for all."""
    kind, _, masses = step.partition("-")
    return int(masses) if kind in _OF_MASSES and masses.isdigit() else None


def is_step(name: str) -> bool:
    """Return whether a step has this name."""
    return bool(masses_of(name)) or (name in _STEPS and name not in _OF_MASSES)


def load(step: str) -> None:
    """Load the kernels of a step, for both kinds of damping; compile those that are not cached.

    Raises
    ------
    ValueError
        There is no step of this name.
    """
    if not is_step(step):
        raise ValueError(f"no step is called {step}")
    masses = masses_of(step)
    for per_link in (False, True):
        if masses is not None:
            _maps(_chain(masses, per_link))
        for run in _STEPS[step.partition("-")[0]]:
            run(_chain(3, per_link))  # whose motions these cases are


def _chain(masses: int, per_link: bool) -> Oscillator:
    others = masses - 1
    damping = [0.05] * masses if per_link else 0.05
    return Oscillator.create([1.0] + [10.0] * others, [1.0] + [5.0] * others, damping, [1.0] + [0.0] * others, 0.8)


def compile_steps(steps: tuple[str, ...]) -> None:
    """Load steps one after another, and record the entries of each; this process compiles nothing else."""
    from grazemap_core.numerics.jit.quick_compiler import hurry

    hurry()
    for step in steps:
        load(step)
        record(step)


if __name__ == "__main__":
    compile_steps(tuple(sys.argv[1:]) or STEPS)
