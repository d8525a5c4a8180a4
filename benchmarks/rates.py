"""Fit the rates of trajectories in `planning/rates.py` to random ones: `python -m benchmarks.rates` (two minutes).

Prints the seconds of each rate, by least squares of relative errors with coefficients >= 0, the median of the ratio of
the impacts to those that are estimated, and the range of this ratio in nine trajectories in ten.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from grazemap_worker.environment import one_thread

one_thread()

import numpy as np  # noqa: E402 - after the environment is set
from scipy.optimize import nnls  # noqa: E402

from benchmarks.random_requests import Draw  # noqa: E402
from grazemap.wire import Oscillator, parse_request  # noqa: E402
from grazemap_core import warmup  # noqa: E402
from grazemap_core.errors import CoreError  # noqa: E402
from grazemap_worker.planning.costs import Points, fastest_exponent, period_impacts  # noqa: E402
from grazemap_worker.planning.rates import MIN_CELLS  # noqa: E402
from grazemap_worker.processes import IMPLEMENTATIONS  # noqa: E402

TRAJECTORIES = 60
PERIODS = 50
LEAST_SECONDS = 0.1
RATES = (
    "SETUP_SECONDS",
    "SETUP_MASS_SECONDS",
    "PERIOD_SECONDS",
    "CELL_SECONDS",
    "CELL_SECONDS x HELD_CELLS",
    "IMPACT_SECONDS",
    "IMPACT_MASS_SECONDS",
    "SAMPLE_MASS_SECONDS",
    "SAMPLE_SQUARE_SECONDS",
)


def timed(body: dict[str, Any]) -> tuple[float, Any]:
    """Return the processor time of a trajectory, the less of two, and its document. Raises CoreError."""
    request, whole = parse_request("trajectories", body), IMPLEMENTATIONS["trajectories"].whole
    assert whole is not None
    times = []
    for _ in range(2):
        began = time.process_time()
        document = whole(request, lambda done, total: None)
        times.append(time.process_time() - began)
    return min(times), document


def row(seed: int) -> tuple[list[float], float, float]:
    """Return what each rate is multiplied by, the seconds, and the impacts over those estimated. Raises CoreError."""
    draw = Draw(np.random.default_rng([seed, 1]))
    body = {**draw.point(), "samples_per_period": int(draw.random.choice([1, 1, 500]))}
    seconds, document = timed({**body, "periods": PERIODS})
    periods = min(20_000, round(PERIODS * max(1.0, LEAST_SECONDS / seconds)))
    seconds, document = timed({**body, "periods": periods})
    oscillator, size = Oscillator(**draw.chain), len(draw.chain["masses"])
    cells = periods * size * max(MIN_CELLS, fastest_exponent(oscillator) * 2.0 * np.pi / draw.omega)
    impacts, samples = len(document["impacts"]["time"]), len(document["time"]) * size
    rests = len(document["sticking"]["start"]) > periods
    works = [
        1.0,
        size**2,
        periods,
        cells * (not rests),
        cells * rests,
        impacts,
        impacts * size,
        samples,
        samples * size,
    ]
    expected = periods * float(period_impacts(oscillator, Points.create([(draw.omega, draw.clearance)]))[0])
    return [float(work) for work in works], seconds, (impacts + periods) / (expected + periods)


def main() -> None:
    """Print the rates."""
    warmup.load(["trajectories"])
    works, times, ratios = [], [], []
    for seed in range(TRAJECTORIES):
        try:
            work, seconds, ratio = row(seed)
        except CoreError:
            continue
        works.append(work)
        times.append(seconds)
        ratios.append(ratio)
    coefficients, _ = nnls(np.array(works) / np.array(times)[:, None], np.ones(len(times)))
    for name, value in zip(RATES, coefficients, strict=True):
        sys.stdout.write(f"{name:<28}{value:.1e} s\n")
    low, middle, high = np.quantile(ratios, [0.05, 0.5, 0.95])
    sys.stdout.write(f"impacts over those estimated {middle:.2f}, nine in ten between {low:.2f} and {high:.2f}\n")


if __name__ == "__main__":
    main()
