"""Compare the estimates of `planning` with the processor time on one core: `python -m benchmarks.estimates`.

Prints a line for each of a few questions: seconds of processor time, and of the estimate. It takes some two minutes,
most of it for borders; kernels that are not in the cache are compiled before.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from grazemap_worker.environment import one_thread

one_thread()

from grazemap.wire import parse_request  # noqa: E402 - after the environment is set
from grazemap_worker.planning import PLANNING, Plan  # noqa: E402
from grazemap_worker.processes import PROCESSES  # noqa: E402

_FOUR_IMPACTS = {"period": 1, "stops": [1, 1, -1, -1]}
_WINDOW = {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}
_FIVE_MASSES = {"masses": [1.0] * 5, "stiffnesses": [1.0] * 5, "damping": 0.1, "forcing": [1.0] * 5}
_SIDES = {
    "horizontal": {"quantity": "displacement", "mass": 1, "values": {"start": -1.3, "stop": 1.3, "points": 64}},
    "vertical": {"quantity": "velocity", "mass": 1, "values": {"start": -1.0, "stop": 1.0, "points": 64}},
}


def _grid(rows: int, columns: int, **body: Any) -> dict[str, Any]:
    """Return a question over the window of the paper's Figure 8."""
    omega, clearance = ({**_WINDOW[name], "points": count} for name, count in (("omega", columns), ("clearance", rows)))
    return {"omega": omega, "clearance": clearance, **body}


def _near(side: int) -> dict[str, Any]:
    """Return one round the codimension-two point."""
    sides = {"omega": (0.275, 0.29), "clearance": (1.8, 2.0)}
    return {name: {"start": low, "stop": high, "points": side} for name, (low, high) in sides.items()}


QUESTIONS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("map, 8 x 128", "unfolding-maps", _grid(8, 128)),
    ("map, 32 x 64", "unfolding-maps", _grid(32, 64)),
    ("map, 128 x 64", "unfolding-maps", _grid(128, 64)),
    ("map, 512 x 16", "unfolding-maps", _grid(512, 16)),
    ("map, 128 x 64, 200 periods", "unfolding-maps", _grid(128, 64, max_periods=200)),
    ("map, 512 x 64, preview", "unfolding-maps", _grid(512, 64, preview=True)),
    ("map, 64 x 16, sweep", "unfolding-maps", _grid(64, 16, policy="sweep-up")),
    ("map, 32 x 16, ensemble", "unfolding-maps", _grid(32, 16, policy="ensemble")),
    ("map, 512 x 64, adaptive", "unfolding-maps", _grid(512, 64, adaptive=True)),
    (
        "map, 128 x 16, five masses",
        "unfolding-maps",
        {
            "oscillator": _FIVE_MASSES,
            "omega": {"start": 0.2, "stop": 0.3, "points": 16},
            "clearance": {"start": 1, "stop": 6, "points": 128},
        },
    ),
    ("basins, 64 x 64", "basins", {"omega": 0.29, "clearance": 1.35, **_SIDES}),
    ("trajectory", "trajectories", {"omega": 0.29, "clearance": 1.35, "periods": 20_000, "samples_per_period": 1}),
    (
        "bifurcation diagram",
        "bifurcation-diagrams",
        {"vary": "clearance", "range": {"start": 1.3, "stop": 2.0, "points": 200}, "omega": 0.29},
    ),
    (
        "branch over clearance",
        "orbit-branches",
        {"omega": 0.29, "clearance": 1.6, "motion": _FOUR_IMPACTS, "range": {"start": 1.3, "stop": 2.0}},
    ),
    (
        "branch over omega",
        "orbit-branches",
        {
            "omega": 0.29,
            "clearance": 1.6,
            "motion": _FOUR_IMPACTS,
            "vary": "omega",
            "range": {"start": 0.2, "stop": 0.4},
        },
    ),
    ("curves, closed form", "bifurcation-curves", {**_WINDOW, "max_multiple": 2}),
    ("curves, closed form, 30", "bifurcation-curves", {**_WINDOW, "max_multiple": 30}),
    ("curves of a motion", "bifurcation-curves", {**_WINDOW, "motions": [_FOUR_IMPACTS]}),
    ("diagram, 64 x 64", "unfolding-diagrams", _grid(64, 64)),
    ("borders, near, 32 x 32", "unfolding-diagrams", {**_near(32), "borders": True}),
    ("borders, near, 128 x 128", "unfolding-diagrams", {**_near(128), "borders": True}),
    ("borders, 16 x 16", "unfolding-diagrams", _grid(16, 16, borders=True)),
    ("borders, 32 x 32", "unfolding-diagrams", _grid(32, 32, borders=True)),
)


def seconds_of(process: str, body: dict[str, Any]) -> tuple[Plan, float]:
    """Return the plan of a question, and the seconds of processor time that its computation takes in one piece."""
    request = parse_request(process, body)
    planned, how = PLANNING[process].plan(request), PROCESSES[process]
    started = time.process_time()
    if how.whole is not None:
        how.whole(request, _silent)
    elif how.tile is not None and how.assembled is not None:
        one = planned.model_copy(update={"tile_rows": planned.rows, "tile_columns": planned.columns})
        how.assembled(request, one, [how.tile(request, one.tile(0))], _silent)
    return planned, time.process_time() - started


def _silent(done: int, total: int) -> None:
    """Nobody waits."""


def main() -> None:
    """Print a line for each question, taken once its kernels are there."""
    for title, process, body in QUESTIONS:
        seconds_of(process, _coarse(body))
        planned, seconds = seconds_of(process, body)
        expected = planned.estimate.seconds
        sys.stdout.write(f"{title:<28}{seconds:9.3f} s, plan {expected:9.3f} s, {expected / seconds:6.2f} of it\n")
        sys.stdout.flush()


def _coarse(body: dict[str, Any]) -> dict[str, Any]:
    """Return a question that needs the same kernels and next to no time."""
    few: dict[str, Any] = {"points": 2}
    changed = {
        name: {**value, **few} if isinstance(value, dict) and "points" in value else value
        for name, value in body.items()
    }
    if "periods" in body:
        changed["periods"] = 2
    return changed


if __name__ == "__main__":
    main()
