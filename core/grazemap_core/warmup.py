"""Compilation of the kernels by components, so that processes that are forked afterwards inherit the machine code.

A component has the kernels that some computations need. It is compiled by running a small case, or for the types of
one; all kernels are for any number of masses. The kernels that carry the lanes of maps are compiled once more (`apart`)
for maps whose points share no tables. A kernel that several components use is compiled once, as the kernels are cached
(`kernel_folder`); several processes can compile different components at the same time:

    python -m grazemap_core.warmup lockstep
    python -m grazemap_core.warmup curves trajectories classification orbits

Without names all components are compiled; with "-" those whose names arrive as lines on the standard input, until it
ends.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from grazemap_core.kernel_folder import record
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.model.oscillator import Oscillator

if TYPE_CHECKING:
    from grazemap_core.maps.runner import Runner

OMEGA = np.array([0.28, 0.29])


def _curves(oscillator: Oscillator) -> None:
    from grazemap_core.grazing.codimension_two import codimension_two_points
    from grazemap_core.grazing.grazing_curve import grazing_curve

    grazing_curve(oscillator, OMEGA, max_order=2)
    codimension_two_points(oscillator, 0.25, 0.35, max_order=2, max_multiple=1)


def _trajectories(oscillator: Oscillator) -> None:
    from grazemap_core.simulation.trajectories import trajectory

    trajectory(oscillator, 0.29, 1.6, periods=2, samples_per_period=4).at(OMEGA)


def _runner(oscillator: Oscillator) -> Runner:
    from grazemap_core.maps.map_settings import RunSettings
    from grazemap_core.maps.runner import Runner

    return Runner(oscillator, RunSettings(max_periods=4, max_period=2))


def _orbits(oscillator: Oscillator) -> None:
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.grazing.discontinuity_mapping import mapping_error
    from grazemap_core.grazing.grazing_curve import VariedStop
    from grazemap_core.grazing.poincare_map import compare_returns
    from grazemap_core.grazing.point import grazing_point
    from grazemap_core.orbits.periodic_orbits import periodic_orbit
    from grazemap_core.orbits.search import explicit_sequences, sequence_of_stops
    from grazemap_core.orbits.single_impact.window_curves import window_curves
    from grazemap_core.simulation.monodromy import linearised_run

    for other in (None, 1.9):  # a lone stop has its grazes in one interval of phases, a fixed one has not
        window_curves(oscillator, (0.28, 0.29), (1.8, 2.0), 1, 2, VariedStop(1, other))
    explicit_sequences(oscillator, 0.28, (1.85, None), 1, np.array([1]))
    point = grazing_point(oscillator, 0.29)
    mapping_error(point, np.array([1e-6]))
    compare_returns(point, np.zeros(len(point.state)), 2, 1e-6, "exact")
    guess = sequence_of_stops(oscillator, 0.27, 1.85, 1, [1])
    assert guess is not None  # it is None for one impact per period
    orbit = periodic_orbit(oscillator, 0.27, 1.85, guess)
    orbit_branch(oscillator, orbit, 1.84, 1.86, max_points=2)
    # orbits that rest on a stop are followed with the flow's derivative
    linearised_run(oscillator, 0.27, 1.85, None, np.zeros(oscillator.size), 0.0).advance(1, np.eye(2 * oscillator.size))


def _observables(oscillator: Oscillator) -> None:
    from grazemap_core.orbits.orbit_observables import of_orbit
    from grazemap_core.orbits.periodic_orbits import periodic_orbit
    from grazemap_core.orbits.search import sequence_of_stops
    from grazemap_core.simulation.observables import Observables, of_record
    from grazemap_core.simulation.start import forced_oscillator
    from grazemap_core.simulation.trajectories import trajectory

    wanted = Observables(("rms_displacement",))
    run = trajectory(oscillator, 0.27, 1.85, periods=1, samples_per_period=1)
    of_record(run.record, forced_oscillator(oscillator, 0.27, 1.85).structure.models, wanted, 1)
    guess = sequence_of_stops(oscillator, 0.27, 1.85, 1, [1])
    assert guess is not None
    of_orbit(oscillator, periodic_orbit(oscillator, 0.27, 1.85, guess), wanted)


def _map_observables(oscillator: Oscillator) -> None:
    from grazemap_core.maps.planes import Plane
    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.simulation.observables import Observables

    wanted = Observables(("rms_displacement",))
    unfolding_map_tile(
        Plane.of(oscillator, OMEGA, np.array([1.6])), MapSettings(max_periods=4, max_period=2), observed=wanted
    )


_COMPONENTS: dict[str, Callable[[Oscillator], None]] = {
    "curves": _curves,
    "trajectories": _trajectories,
    "classification": lambda oscillator: _runner(oscillator).compile_classification(),
    "lockstep": lambda oscillator: _runner(oscillator).compile_lockstep(),
    "apart": lambda oscillator: _runner(oscillator).compile_lockstep(separate=True),
    "orbits": _orbits,
    "observables": _observables,
    "map_observables": _map_observables,
}


def load(components: Iterable[str]) -> None:
    """Load the kernels of components, for both kinds of damping; compile those that are not cached."""
    for component in components:
        _load_component(component)


def _load_component(component: str) -> None:
    for damping in (0.05, [0.05] * 3):
        oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], 0.8)
        _COMPONENTS[component](oscillator)


def compile_components(components: Iterable[str]) -> None:
    """Load components one after another, and record the entries of each; this process compiles nothing else."""
    from grazemap_core.numerics.jit.quick_compiler import hurry

    hurry()
    for component in components:
        _load_component(component)
        record(component)


if __name__ == "__main__":
    names = sys.argv[1:] or list(_COMPONENTS)
    compile_components((line.strip() for line in sys.stdin) if names == ["-"] else names)
