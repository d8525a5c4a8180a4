"""`python -m grazemap_worker.measure`: the speed that plans assume, measured on this machine and one core.

Prints the forcing periods per second of the default oscillator's unfolding map, and what `store.plan` assumes.
"""

from __future__ import annotations

import sys
import time

from grazemap_worker.environment import one_thread

one_thread()

import numpy as np  # noqa: E402 - after the environment is set

from grazemap.models import Oscillator, UnfoldingMapsRequest  # noqa: E402
from grazemap_worker.processes.unfolding_maps import compute_tile  # noqa: E402
from grazemap_worker.store.plan import FULL_COLUMN, MAP_PERIODS_PER_SECOND, expected_periods  # noqa: E402

_SIDE = FULL_COLUMN


def main() -> None:
    """Settle a coarse map over the paper's window and print periods per second and per pixel."""
    request = UnfoldingMapsRequest(
        oscillator=Oscillator(),
        omega=np.linspace(0.26, 0.30, _SIDE).tolist(),
        clearance=np.linspace(1.3, 2.0, _SIDE).tolist(),
    )
    compute_tile(request, (0, 1, 0, 1))  # compiled, or loaded from the cache
    started = time.perf_counter()
    document = compute_tile(request, (0, _SIDE, 0, _SIDE))
    seconds = time.perf_counter() - started
    settled = document["settled_after"]
    periods = int(np.where(settled < 0, request.max_periods, settled).sum())
    sys.stdout.write(
        f"{periods / seconds:.3g} periods/s (plans assume {MAP_PERIODS_PER_SECOND:.3g}), "
        f"{periods / _SIDE**2:.0f} periods/pixel (plans assume {expected_periods(request.max_periods):.0f})\n"
    )


if __name__ == "__main__":
    main()
