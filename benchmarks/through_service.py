"""A map of 512 x 512 points through the service, on as many workers as this machine has cores.

    python -m benchmarks.through_service

The workers compile or load their kernels before; the figure is the time from the job's start to its end.
"""

from __future__ import annotations

import sys
from datetime import datetime

import grazemap
from benchmarks.maps import grid
from benchmarks.work import PERIODS

SIDE = 512


def main() -> None:
    """Compute the map in a stack of its own and print how long the job took."""
    omegas, clearances = grid(SIDE)
    with grazemap.local() as client:
        client.unfolding_map(omega=(0.28, 0.29), clearance=(1.5, 1.6), shape=(4, 4), progress=False)  # all are warm
        job = client.submit(
            "unfolding-maps",
            {
                "omega": {"start": omegas[0], "stop": omegas[-1], "points": SIDE},
                "clearance": {"start": clearances[0], "stop": clearances[-1], "points": SIDE},
                "max_periods": PERIODS,
            },
        )
        result = job.wait(timeout=600, progress=False).result()
        record = client.job(job.id).job
    if record.started is None or record.finished is None or not isinstance(result, grazemap.UnfoldingMap):
        raise RuntimeError("the job has not run to its end")
    seconds = (datetime.fromisoformat(record.finished) - datetime.fromisoformat(record.started)).total_seconds()
    settled = float((result.kind == result.kinds.index("periodic")).mean())
    sys.stdout.write(
        f"{SIDE} x {SIDE} points, {PERIODS} periods at most: {seconds:.1f} s in {record.estimate.tiles} tiles, "
        f"{settled:.1%} periodic\n"
    )


if __name__ == "__main__":
    main()
