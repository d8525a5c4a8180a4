"""The cost of maps over other parameters than omega and clearance: `make planes`.

Every map has the same points, 24 by 64 values of two parameters within 1e-7 of one point, so that all their motions are
alike and the times differ by the parameters alone. Maps are computed as a worker does, each in turn with the map over
omega and clearance; ratios of processor time are medians over ROUNDS, with their quartiles. A parameter of the stops,
the bias or the forces costs nothing of its own; a parameter of the structure needs tables for each of its values, and
beside omega or another one for each point. The program fails if a ratio is over its limit.
"""

from __future__ import annotations

import statistics
import sys
import time
from typing import Any, Final

from grazemap_worker.environment import one_thread

one_thread()

from benchmarks.estimates import compute  # noqa: E402 - after the environment is set
from grazemap.wire import parse_request  # noqa: E402

ROUNDS = 9
COLUMNS, ROWS = 24, 64
WIDTH = 1e-7
OMEGA, CLEARANCE, MASS, RESTITUTION = 0.29, 1.6, 10.0, 0.8
# so small that the motions are those without it
BIAS = 1e-6
_VALUES: Final = {
    "omega": OMEGA,
    "clearance": CLEARANCE,
    "clearance_right": CLEARANCE,
    "clearance_left": CLEARANCE,
    "restitution": RESTITUTION,
    "restitution_right": RESTITUTION,
    "bias": 1.0,
    "forcing": 1.0,
    "damping": 1.0,
    "masses[2]": MASS,
}
BETWEEN_NUMBERS, ONE_OF_TABLES, BOTH_OF_TABLES = 1.1, 2.0, 5.0
"""Limits of the ratio, by how many of the parameters need tables; omega does, as in the map that is compared with."""
PLANES: Final = (
    ("omega", "clearance", BETWEEN_NUMBERS),  # itself, for the noise
    ("omega", "clearance_right", BETWEEN_NUMBERS),
    ("omega", "restitution", BETWEEN_NUMBERS),
    ("omega", "restitution_right", BETWEEN_NUMBERS),
    ("omega", "bias", BETWEEN_NUMBERS),
    ("omega", "forcing", BETWEEN_NUMBERS),
    ("clearance_right", "clearance_left", BETWEEN_NUMBERS),
    ("damping", "clearance", ONE_OF_TABLES),
    ("masses[2]", "restitution", ONE_OF_TABLES),
    ("omega", "damping", BOTH_OF_TABLES),
    ("omega", "masses[2]", BOTH_OF_TABLES),
    ("damping", "masses[2]", BOTH_OF_TABLES),
)


def body(across: str, up: str) -> dict[str, Any]:
    """Return the request of a map."""

    def axis(name: str, points: int) -> dict[str, Any]:
        value = _VALUES[name]
        ends = {"start": value * (1.0 - WIDTH), "stop": value * (1.0 + WIDTH)}
        return {"vary": name, "values": {**ends, "points": points}}

    varied = {across, up}
    found: dict[str, Any] = {"horizontal": axis(across, COLUMNS), "vertical": axis(up, ROWS), "max_periods": 400}
    if "omega" not in varied:
        found["omega"] = OMEGA
    if "clearance_right" in varied:
        found["clearance"] = {"left": None if "clearance_left" in varied else CLEARANCE}
    elif "clearance" not in varied:
        found["clearance"] = CLEARANCE
    if "bias" in varied:
        found["oscillator"] = {"bias": [BIAS, 0.0, 0.0]}
    return found


def seconds(request: Any) -> float:
    """Return the processor time of a map."""
    began = time.process_time()
    compute("unfolding-maps", request)
    return time.process_time() - began


def main() -> int:
    """Print a line for each plane; return 1 if one is over its limit."""
    plain = parse_request("unfolding-maps", body("omega", "clearance"))
    seconds(plain)  # loads the kernels
    over = 0
    print(f"{'horizontal':<17}{'vertical':<17}{'ratio':>7}  quartiles       seconds")
    for across, up, limit in PLANES:
        request = parse_request("unfolding-maps", body(across, up))
        pairs = [(seconds(request), seconds(plain)) for _ in range(ROUNDS)]
        low, ratio, high = statistics.quantiles([one / other for one, other in pairs], n=4)
        took = statistics.median(one for one, _ in pairs)
        over += ratio > limit
        mark = f"  over {limit:g}" if ratio > limit else ""
        print(f"{across:<17}{up:<17}{ratio:7.2f}  {low:.2f} to {high:.2f}  {took:8.3f}{mark}", flush=True)
    return int(over > 0)


if __name__ == "__main__":
    sys.exit(main())
