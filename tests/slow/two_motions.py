"""Whether a result from rest tells of other stable motions: `python two_motions.py [TWO] [ONE] [PROCESSES]`.

Random chains of 1 to 5 masses with one stop or two are drawn at random points, and trajectories from many more states
than a request tries, farther out and at two phases, decide at which points two or more motions are stable, and at which
only one is. Two motions are different here if their names or their largest multipliers are. Then trajectories from rest
are asked for with `other_starts`: at how many points with two motions, and at how many with one, does the result have
the note; do the requests in it show what it says; and what does it cost. Last come maps, which sample by themselves.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from grazemap.wire import Oscillator, ProcessRequest, TrajectoriesRequest, UnfoldingMapsRequest, parse_request
from grazemap.wire.linear import steady_amplitude
from grazemap.wire.notes import OTHER_MOTIONS
from grazemap_core.contact.stops import both_clearances
from grazemap_core.maps.basin_fractions import from_rest
from grazemap_core.maps.basins import motions_from
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.runner import Runner
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.start import forced_oscillator
from grazemap_worker.processes.conversion import core_clearance, core_oscillator
from tests.support.computed import as_job

STARTS = 64  # that a request tries
DENSE = 64  # at each of two phases and of the two widths
PERIODS = 500
PHASES = (0.0, 2.5)
WIDTHS = (1.0, 3.0)  # in units of the stops
MOST_SAID_OF_ONE = 0.02
LEAST_SAID_OF_TWO = 0.9
MOST_COST_OF_MAP = 0.1
MAPS, SIDE = 6, 80
MOST_DRAWN = 20  # points for each one that is wanted
Key = tuple[Any, ...]


class Outcome(NamedTuple):
    """What a point has, and what its result says of it."""

    motions: int
    """Stable motions, 2 for more; 0 where it is not clear."""
    stated: bool
    """Whether the result has the note."""
    shown: int
    """How many of the requests in it lead to the motion that it names."""
    named: int
    """How many it names."""
    seconds: tuple[float, float]
    """For the result without other starts and with them."""
    share: float
    """Share of the dense starts that do not lead to the motion from rest."""


def drawn(seed: int) -> TrajectoriesRequest:
    """Return a trajectory from rest of a random machine at a random point."""
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 6))
    forcing = random.normal(size=size) if random.random() < 0.5 else np.eye(size)[0]
    machine = Oscillator(
        masses=(10.0 ** random.uniform(-0.5, 0.5, size)).tolist(),
        stiffnesses=(10.0 ** random.uniform(-0.3, 0.7, size)).tolist(),
        damping=float(10.0 ** random.uniform(-2.0, -0.9)),
        forcing=forcing.tolist(),
        restitution=float(random.uniform(0.3, 0.95)),
    )
    omega = float(random.uniform(0.5, 2.5) * machine.natural_frequencies[0])
    clearance = float(steady_amplitude(machine, np.array([omega]))[0] * 10.0 ** random.uniform(-0.7, 0.5))
    stops = clearance if random.random() < 0.5 else {"right": clearance, "left": None}
    body = {"oscillator": machine, "omega": omega, "clearance": stops, "periods": 20, "transient_periods": 300}
    return TrajectoriesRequest.checked(body)


def motions_at(request: TrajectoriesRequest) -> tuple[Key, Counter[Key]]:
    """Return the motion from rest, and how many of the dense starts lead to each motion."""
    oscillator = core_oscillator(request.oscillator)
    forced = forced_oscillator(oscillator, request.omega, core_clearance(request.clearance))
    runner, random = Runner(oscillator, RunSettings(PERIODS, 32, linearised=False)), np.random.default_rng(0)
    right, left = both_clearances(forced.clearance)
    counts: Counter[Key] = Counter()
    mirrors = right == left
    for phase in PHASES:
        for width in WIDTHS:
            states = width * min(right, left) * random.uniform(-1.0, 1.0, (DENSE, 2, oscillator.size))
            states[:, 0, 0] = 0.999 * random.uniform(-left if np.isfinite(left) else -width * right, right, DENSE)
            states[:, 1] *= request.omega
            counts.update(_keys(motions_from(runner, forced, *from_rest(forced, states), phase), mirrors))
    rest = np.zeros((1, 2, oscillator.size))
    (own,) = _keys(motions_from(runner, forced, *from_rest(forced, rest), 0.0), mirrors)
    return own, counts


def _keys(arrays: dict[str, Any], mirrors: bool) -> Iterator[Key]:
    """Yield the name and the multiplier of each motion that is verified; else its kind, or that it is not verified."""
    for number, kind in enumerate(arrays["kind"].tolist()):
        if KINDS[kind] != "periodic":
            yield ("unresolved",)
            continue
        impacts = [int(arrays[f"impacts_{side}"][number]) for side in ("right", "left")]
        name = (int(arrays["period"][number]), *(sorted(impacts) if mirrors else impacts))
        # of an orbit that is not verified the multiplier is not known
        sure = bool(arrays["verified"][number])
        yield (*name, round(float(arrays["multiplier"][number]), 5)) if sure else ("unsure", *name)


def looked_at(seed: int) -> Outcome | None:
    """Compare what a point has with what its result says; None where it is not clear what it has."""
    request = drawn(seed)
    own, counts = motions_at(request)
    stable = {key for key in counts if isinstance(key[0], int)} | {own}
    if not isinstance(own[0], int):
        return None
    others = {key for key in stable if key != own}
    names = {key[:-1] for key in stable}
    unclear = [key for key in counts if key[0] == "unresolved" or (key[0] == "unsure" and key[1:] not in names)]
    if not others and unclear:
        return None
    plain, _ = timed(request)
    asked, (document, meta) = timed(request.model_copy(update={"other_starts": STARTS}))
    stated = any(note["code"] == OTHER_MOTIONS for note in meta["notes"])
    named = document["other_starts"]["motions"]
    shown = sum(_label_of(motion["request"]) == motion["label"] for motion in named)
    share = sum(counts[key] for key in others) / counts.total()
    return Outcome(1 + bool(others), stated, shown, len(named), (plain, asked), share)


def _label_of(body: dict[str, Any]) -> str | None:
    _, (document, _) = timed(parse_request("trajectories", _plain(body)), 1)
    label: str | None = document["motion"].get("label")
    return label


def _plain(value: Any) -> Any:
    """Return a request from npz as one from JSON."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value


def timed(request: ProcessRequest, times: int = 3) -> tuple[float, tuple[Any, Any]]:
    """Return the processor seconds of a job, the fewest of several runs, and its document and meta."""
    seconds = []
    for _ in range(times):
        began = time.process_time()
        outcome = as_job(request)
        seconds.append(time.process_time() - began)
    return min(seconds), outcome


def map_cost(seed: int) -> tuple[float, float, str]:
    """Return the seconds for a map about a drawn point without other starts and with its own, and what it says."""
    point = drawn(seed)
    stops = point.clearance if isinstance(point.clearance, float) else point.clearance.right
    assert stops is not None
    sides = {"horizontal": ("omega", point.omega), "vertical": ("clearance", stops)}
    body: dict[str, Any] = {"oscillator": point.oscillator}
    for side, (name, middle) in sides.items():
        values = {"start": 0.8 * middle, "stop": 1.25 * middle, "points": SIDE}
        body[side] = {"vary": name, "values": values}
    if not isinstance(point.clearance, float):
        body["vertical"]["vary"], body["clearance"] = "clearance_right", {"left": None}
    request = UnfoldingMapsRequest.checked(body)
    plain = request.model_copy(update={"other_starts": 0})
    timed(plain.model_copy(update={"max_periods": 1}), 1)  # its kernels are loaded
    (without, _), (within, (document, _)) = timed(plain, 2), timed(request, 2)
    outcome = document["other_starts"]
    return without, within, f"{outcome['with_others']} of {outcome['points']} sampled points have others"


def main(two: int = 50, one: int = 200, processes: int = 2) -> bool:
    """Print the counts and the costs; return whether the result says what it should, at the cost that it should."""
    outcomes: dict[int, list[Outcome]] = {1: [], 2: []}
    wanted = {1: one, 2: two}
    points = 0
    with get_context("spawn").Pool(processes) as pool:
        for outcome in pool.imap(looked_at, range(MOST_DRAWN * (two + one)), chunksize=1):
            points += 1
            if outcome is not None and len(outcomes[outcome.motions]) < wanted[outcome.motions]:
                outcomes[outcome.motions].append(outcome)
            if all(len(outcomes[motions]) == wanted[motions] for motions in wanted):
                break
        pool.terminate()
    stated = {motions: sum(outcome.stated for outcome in each) for motions, each in outcomes.items()}
    named, shown = (sum(getattr(outcome, name) for outcome in outcomes[2]) for name in ("named", "shown"))
    print(f"{points} points drawn; {STARTS} other starts")
    print(f"two stable motions or more: stated at {stated[2]} of {two} points; {shown} of {named} requests show them")
    missed = sorted(outcome.share for outcome in outcomes[2] if not outcome.stated)
    print(f"    where it is not stated, the share of the dense starts to others is {[round(s, 3) for s in missed]}")
    print(f"one stable motion: stated at {stated[1]} of {one} points")
    for motions, each in outcomes.items():
        plain, asked = np.array([outcome.seconds for outcome in each]).T
        more = 1000.0 * float(np.median(asked - plain))
        ratios = np.quantile((asked - plain) / plain, [0.5, 0.9])
        where = f"{'one motion' if motions == 1 else 'more'}: {more:.1f} ms more, {ratios[0]:.0%} of the job without"
        print(f"cost at points with {where} (nine in ten below {ratios[1]:.0%})")
    costs = [map_cost(seed) for seed in range(MAPS)]
    for without, within, text in costs:
        print(f"map {SIDE} x {SIDE}: {without:.2f} s, {within / without - 1.0:+.1%} with other starts; {text}")
    total = sum(within for _, within, _ in costs) / sum(without for without, _, _ in costs) - 1.0
    print(f"all maps: {total:+.1%}")
    return (
        stated[2] >= LEAST_SAID_OF_TWO * two
        and stated[1] <= MOST_SAID_OF_ONE * one
        and shown == named
        and total < MOST_COST_OF_MAP
    )


if __name__ == "__main__":
    sys.exit(0 if main(*map(int, sys.argv[1:])) else 1)
