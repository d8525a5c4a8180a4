"""Compare adaptive maps with full ones: `python -m benchmarks.adaptive_maps [side [omegas]]`.

The maps have side x side points, or the given number of omegas from the middle of them, as a strip has. For each window
the program prints the share of computed points, the time relative to that of the full map, and shares of all points:
inferred motions that are not those of the full map, and those of them for which the full map has another motion (and is
not unresolved); inferred chaos that the full map does not have; and motions of the full map that are left unresolved.
The last columns are the share of wrong points among those that are inferred to have a motion, or to be chaotic, and the
ends of the interval for it that the adaptive map states.
"""

from __future__ import annotations

import sys
import time
from typing import Any, Final

from grazemap_worker.environment import one_thread

if __name__ == "__main__":
    # Not where tests import this: numba, when it compiles after a variable of its own has changed, reads all of them
    # again, and forgets where the compiled kernels are.
    one_thread()

import numpy as np
from numpy.typing import NDArray

from grazemap_core.maps.adaptive_map import LABEL, adaptive_map_tile, complete_map
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS

Pair = tuple[float, float]

_CHAIN: Final = ([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0])
_SINGLE: Final = ([1.0], [1.0], 0.05, [1.0])
WINDOWS: Final[tuple[tuple[str, Oscillator, Pair, Pair], ...]] = (
    ("wide window", Oscillator.create(*_CHAIN, 0.8), (0.26, 0.32), (1.2, 2.1)),
    ("mirror images that alternate", Oscillator.create(*_CHAIN, 0.8), (0.285, 0.297), (1.84, 1.91)),
    ("tongues and a chaotic sea", Oscillator.create(*_CHAIN, 0.8), (0.295, 0.31), (1.35, 1.7)),
    ("nested period windows", Oscillator.create(*_CHAIN, 0.8), (0.31, 0.32), (1.65, 1.9)),
    ("at the grazing curve", Oscillator.create(*_CHAIN, 0.8), (0.28, 0.284), (1.9, 1.94)),
    ("complete chatter", Oscillator.create(*_CHAIN, 0.3), (0.1, 0.3), (0.5, 2.0)),
    ("one mass", Oscillator.create(*_SINGLE, 0.8), (0.6, 1.6), (0.2, 2.0)),
)
MAX_PERIODS: Final = 200


def main() -> None:
    """Print a line for each window, and one for all."""
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 256
    columns = int(sys.argv[2]) if len(sys.argv) > 2 else side
    first = max(0, (side - columns) // 2)
    lines = []
    sys.stdout.write(
        f"{'window':28s} computed  time  wrong motion  (another)  wrong chaos  left unresolved"
        "   wrong    from      to\n"
    )
    for name, oscillator, omega, clearance in WINDOWS:
        omegas = np.linspace(*omega, side)[first : first + columns]
        lines.append(_compared(oscillator, omegas, np.linspace(*clearance, side)))
        _write(name, lines[-1])
    _write("mean", np.mean(lines, axis=0)[:-2])


def _compared(oscillator: Oscillator, omega: NDArray[np.float64], clearance: NDArray[np.float64]) -> NDArray[Any]:
    unfolding_map_tile(
        Plane.of(oscillator, omega[:1], clearance[:1]), MapSettings(4)
    )  # compiled, or loaded from the cache
    began = time.process_time()
    adaptive = adaptive_map_tile(Plane.of(oscillator, omega, clearance), MapSettings(max_periods=MAX_PERIODS))
    completed = {name: array.copy() for name, array in adaptive.items()}
    *_, stated = complete_map(
        Plane.of(oscillator, omega, clearance), completed, [], [], MapSettings(max_periods=MAX_PERIODS)
    )
    between = time.process_time()
    full = unfolding_map_tile(Plane.of(oscillator, omega, clearance), MapSettings(MAX_PERIODS))
    ended = time.process_time()
    inferred = ~adaptive["computed"]
    unresolved, periodic, chaotic = (KINDS.index(kind) for kind in ("unresolved", "periodic", "chaotic"))
    same = np.all([adaptive[name] == full[name] for name in LABEL if name != "reason"], axis=0)
    motion = inferred & ~same & (adaptive["kind"] == periodic)
    named = inferred & (adaptive["kind"] != unresolved)
    wrong = named & (~same | full["sensitive"])
    assert stated is not None
    return np.array(
        [
            1.0 - inferred.mean(),
            (between - began) / (ended - between),
            motion.mean(),
            (motion & (full["kind"] != unresolved)).mean(),
            (inferred & ~same & (adaptive["kind"] == chaotic)).mean(),
            (inferred & (adaptive["kind"] == unresolved) & (full["kind"] == periodic)).mean(),
            wrong.sum() / named.sum(),
            stated.low,
            stated.high,
        ]
    )


def _write(name: str, line: NDArray[Any]) -> None:
    computed, seconds, *shares = line
    columns = "".join(f"  {share:11.4%}" for share in shares[:4]) + "".join(f" {share:7.2%}" for share in shares[4:])
    sys.stdout.write(f"{name:28s} {computed:8.1%} {seconds:5.2f}{columns}\n")


if __name__ == "__main__":
    main()
