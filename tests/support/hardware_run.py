"""A small set of computations, for a process of its own: `python hardware_run.py OUT.npz SIZE [--vector-only]`.

What the kernels are compiled for is decided by the environment of the process (NUMBA_CPU_NAME, NUMBA_ENABLE_AVX,
NUMBA_DISABLE_JIT ...). With `--vector-only` the kernels of `first_pass` and `second_pass`, which are vector
instructions, are compiled, and all others interpreted: seconds instead of minutes.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path

import numpy as np

import grazemap_core
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit import compiled

DEFAULT = ([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
OMEGA, CLEARANCES = 0.29, np.array([1.0, 1.5, 1.55, 1.65, 1.75, 2.05])
SLOW = ([1.0], [1.0], 0.05, [1.0], 0.8)
SLOW_OMEGA, SLOW_CLEARANCES = 0.2, np.array([0.3, 0.35])
TANGENT_PERIODS = 2
SIZES = {
    # columns of the map and its periods; periods of the trajectory
    "small": ([0.29], 60, 2),
    "full": ([0.27, 0.28, 0.29], 400, 40),
}
VECTOR = ("first_pass", "second_pass", "compiled")


def interpret_all_but(modules: tuple[str, ...]) -> None:
    """Put the Python functions back in place of compiled kernels, wherever they were imported, but for some modules."""
    names = [info.name for info in pkgutil.walk_packages(grazemap_core.__path__, "grazemap_core.")]
    compiled.INTERPRETED = True  # kernels that others call by their addresses
    for module in [importlib.import_module(name) for name in (*names, "benchmarks.ensemble")]:
        for name, kernel in list(vars(module).items()):
            function = None if isinstance(kernel, compiled.PointerKernel) else getattr(kernel, "py_func", None)
            if function is not None and function.__module__.rsplit(".", 1)[-1] not in modules:
                setattr(module, name, function)


def compute(size: str) -> dict[str, np.ndarray]:
    """Return every array by name."""
    from benchmarks.ensemble import first_impacts
    from grazemap_core.maps.planes import Plane
    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.simulation.monodromy import monodromy
    from grazemap_core.simulation.trajectories import trajectory

    default, slow = Oscillator.create(*DEFAULT), Oscillator.create(*SLOW)
    columns, map_periods, periods = SIZES[size]
    out: dict[str, np.ndarray] = {}
    ensemble = first_impacts(default, OMEGA, CLEARANCES, 12, 20)
    out |= {f"first.{name}": value for name, value in ensemble._asdict().items()}
    # complete chatter on its way into a rest, and the release, in lockstep and by itself
    ensemble = first_impacts(slow, SLOW_OMEGA, SLOW_CLEARANCES, 1, 60)
    out |= {f"chatter.{name}": value for name, value in ensemble._asdict().items()}
    result = trajectory(slow, SLOW_OMEGA, SLOW_CLEARANCES[0], periods=1, samples_per_period=8)
    out |= {f"sticking.{name}": getattr(result.sticking, name) for name in ("start", "stop_time", "stop")}
    result = trajectory(default, OMEGA, 1.6, periods=periods, samples_per_period=8)
    out |= {"reference.time": result.impacts.time, "reference.displacement": result.displacement}
    tile = unfolding_map_tile(Plane.of(default, np.array(columns), CLEARANCES), MapSettings(map_periods))
    out |= {f"map.{name}": value for name, value in tile.items()}
    out["monodromy"] = monodromy(default, OMEGA, 1.6, period=TANGENT_PERIODS).matrix
    return out


def main(path: str, size: str, vector_only: bool) -> None:
    """Compute, and write every array."""
    sys.path.insert(0, str(Path(__file__).parents[2]))
    if vector_only:
        interpret_all_but(VECTOR)
    # interpreted kernels warn where compiled ones go on with an infinity or NaN that nothing reads
    with np.errstate(all="ignore"):
        np.savez(path, **compute(size))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], "--vector-only" in sys.argv[3:])
