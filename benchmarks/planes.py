"""The cost of maps over other parameters than omega and clearance: `make planes`.

What a parameter costs depends on how long the motions take to settle, so maps are compared whose motions are those of
the benchmark's window, and beside them maps about a point at which motions settle at once. A map over omega has the
frequencies of the window, at one of five clearances; one over other parameters is about one of 25 points of the window.
The values of all parameters but omega are within 1e-7 of one another, so the motions of two maps are alike and the
times differ by the parameters alone. Maps are computed as a worker does, each in turn with that over omega and
clearance, in ROUNDS. A ratio of processor time is that of the quickest times of the maps, since others that use the
machine can only delay a map; beside it is the range of the ratios of single rounds. A parameter of the stops, the bias
or the forces costs nothing of its own; a parameter of the structure needs tables for each of its values, and beside
omega or another one for each point: then every lane has tables of its own. The program fails if a ratio over the window
is over its limit; two parameters of the structure, whose modes are found at each point, have none.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from typing import Any, Final, NamedTuple

from grazemap_worker.environment import one_thread

one_thread()

from benchmarks.estimates import compute  # noqa: E402 - after the environment is set
from benchmarks.work import MAP_CLEARANCE, MAP_OMEGA  # noqa: E402
from grazemap.wire import UnfoldingMapsRequest  # noqa: E402

ROUNDS = 3
COLUMNS, ROWS = 8, 64
OMEGAS = 64
WIDTH = 1e-7
PLACES: Final = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Where the points of the window are, in shares of each of its sides."""
MASS, RESTITUTION = 10.0, 0.8
# so small that the motions are those without it
BIAS = 1e-6
_VALUES: Final = {
    "restitution": RESTITUTION,
    "restitution_right": RESTITUTION,
    "bias": 1.0,
    "forcing": 1.0,
    "damping": 1.0,
    "masses[2]": MASS,
}
BETWEEN_NUMBERS, ONE_OF_TABLES, BOTH_OF_TABLES = 1.1, 2.0, 5.0
"""Limits of the ratio, by how many of the parameters need tables; omega does, as in the map that is compared with."""
UNEQUAL = 1.08 * BETWEEN_NUMBERS
"""Between stops that are not alike motions are watched over whole periods, not half periods, whatever the plane."""
PLANES: Final = (
    ("omega", "clearance", BETWEEN_NUMBERS),  # itself, for the noise
    ("omega", "clearance_right", UNEQUAL),
    ("omega", "restitution", BETWEEN_NUMBERS),
    ("omega", "restitution_right", UNEQUAL),
    ("omega", "bias", UNEQUAL),
    ("omega", "forcing", BETWEEN_NUMBERS),
    ("clearance_right", "clearance_left", UNEQUAL),
    ("damping", "clearance", ONE_OF_TABLES),
    ("masses[2]", "restitution", ONE_OF_TABLES),
    ("omega", "damping", BOTH_OF_TABLES),
    ("omega", "masses[2]", BOTH_OF_TABLES),
    ("damping", "masses[2]", None),
)


class Point(NamedTuple):
    """Where a map is: about a frequency, or over a range of them, and about a clearance."""

    omega: float | tuple[float, float]
    clearance: float


def _between(ends: tuple[float, float], share: float) -> float:
    return ends[0] + share * (ends[1] - ends[0])


_CLEARANCES: Final = [_between(MAP_CLEARANCE, share) for share in PLACES]
ALONG_OMEGA: Final = [Point(MAP_OMEGA, clearance) for clearance in _CLEARANCES]
OF_WINDOW: Final = [Point(_between(MAP_OMEGA, share), clearance) for share in PLACES for clearance in _CLEARANCES]
AT_ONCE: Final = [Point(0.29, 1.6)]


def body(across: str, up: str, point: Point) -> dict[str, Any]:
    """Return the request of a map."""
    values = (
        _VALUES
        | {"omega": point.omega}
        | dict.fromkeys(("clearance", "clearance_right", "clearance_left"), point.clearance)
    )

    def axis(name: str, points: int) -> dict[str, Any]:
        value = values[name]
        if isinstance(value, tuple):
            start, stop, points = *value, OMEGAS
        else:
            start, stop = value * (1.0 - WIDTH), value * (1.0 + WIDTH)
        return {"vary": name, "values": {"start": start, "stop": stop, "points": points}}

    varied = {across, up}
    request: dict[str, Any] = {"horizontal": axis(across, COLUMNS), "vertical": axis(up, ROWS)}
    if "omega" not in varied:
        request["omega"] = point.omega
    if "clearance_right" in varied:
        request["clearance"] = {"left": None if "clearance_left" in varied else point.clearance}
    elif "clearance" not in varied:
        request["clearance"] = point.clearance
    if "bias" in varied:
        request["oscillator"] = {"bias": [BIAS, 0.0, 0.0]}
    return request


def milliseconds(across: str, up: str, points: list[Point]) -> list[float]:
    """Return for each map its processor time, in ms for a point."""
    requests = [UnfoldingMapsRequest(**body(across, up, point)) for point in points]
    times = []
    for request in requests:
        began = time.process_time()
        compute("unfolding-maps", request)
        times.append(1e3 * (time.process_time() - began) / math.prod(request.plane.shape))
    return times


def ratio(across: str, up: str, points: list[Point]) -> tuple[float, str]:
    """Return the ratio to maps over omega and clearance, and a text with its range and the time of a point."""
    rounds = [(milliseconds(across, up, points), milliseconds("omega", "clearance", points)) for _ in range(ROUNDS)]
    quickest, reference = (statistics.fmean(map(min, zip(*times, strict=True))) for times in zip(*rounds, strict=True))
    single = [statistics.fmean(times) / statistics.fmean(of_reference) for times, of_reference in rounds]
    of_quickest = quickest / reference
    return of_quickest, f"{of_quickest:7.2f}  ({min(single):5.2f} to {max(single):5.2f}) {quickest:7.3f} ms"


def main() -> int:
    """Print a line for each plane; return 1 if one is over its limit."""
    milliseconds("omega", "clearance", AT_ONCE)  # loads the kernels
    over = 0
    print(f"{'horizontal':<17}{'vertical':<16}{'the window, a point':<34}{'settled at once, a point':<34}limit")
    for across, up, limit in PLANES:
        of_window = ALONG_OMEGA if across == "omega" else OF_WINDOW
        (of_plane, text), (_, at_once) = (ratio(across, up, points) for points in (of_window, AT_ONCE))
        exceeded = limit is not None and of_plane > limit
        over += exceeded
        bound = "" if limit is None else f"{limit:g}{', exceeded' * exceeded}"
        print(f"{across:<17}{up:<16}{text:<34}{at_once:<34}{bound}", flush=True)
    return int(over > 0)


if __name__ == "__main__":
    sys.exit(main())
