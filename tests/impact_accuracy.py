"""First impact times at random points against 48-digit arithmetic, in units of what an input error amounts to there.

The yardstick of an impact time is its condition: what the multi-precision simulation itself answers to a relative
change of 1e-25 of every input by itself (each mass, stiffness, damping and force, the restitution, the forcing
frequency, the clearance), in sum. An arithmetic that errs by 1e-15 of that is as good as one without rounding, given
inputs that carry some four roundings each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from flint import arb
from oracles import digits
from swift_oracle import SwiftOracle

from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.trajectory import trajectory

CHANGE = 1e-25
IMPACTS = 20


@dataclass(frozen=True)
class Accuracy:
    """What became of one point; arrays over the impacts compared, before any complete chatter.

    `error` is of the time, in absolute value; `amplification` the change of the exact time over the relative change of
    the inputs; `complete` whether the core has every impact up to the last one compared, and none besides.
    """

    error: np.ndarray
    amplification: np.ndarray
    complete: bool

    @property
    def worst(self) -> float:
        """Largest error over amplification."""
        return float(np.max(self.error / self.amplification))


def random_point(seed: int) -> tuple[Oscillator, float, float]:
    """A chain of 1 to 5 masses with either kind of damping, a forcing frequency, and a clearance within reach."""
    rng = np.random.default_rng(seed)
    count = 1 + seed % 5
    damping = float(rng.uniform(0.01, 0.3)) if (seed // 5) % 2 else rng.uniform(0.01, 0.4, count)
    forcing = rng.uniform(-1, 1, count)
    oscillator = Oscillator.create(
        rng.uniform(0.5, 3, count), rng.uniform(0.5, 3, count), damping, forcing, float(rng.uniform(0.3, 1.0))
    )
    omega = float(rng.uniform(0.2, 1.5))
    amplitude = abs(forced_response(oscillator, np.array([omega]))[0, 0])
    return oscillator, omega, float(rng.uniform(0.3, 0.95) * amplitude)


def changed_inputs(oscillator: Oscillator, omega: float, clearance: float) -> Iterator[SwiftOracle]:
    """The simulation with one input after the other changed by its CHANGE."""
    with digits():
        factor = 1 + arb(CHANGE)
    every = range(oscillator.size)
    lists = [(name, [i]) for name in ("masses", "stiffnesses", "forcing") for i in every]
    # one number gives the damping of all links, or each has its own
    lists += [("links", [i]) for i in every] if oscillator.gamma is None else [("links", list(every))]
    for name, places in lists:
        run = SwiftOracle.of(oscillator, omega, clearance)
        with digits():
            values = [arb(v) * factor if i in places else v for i, v in enumerate(getattr(run, name))]
        setattr(run, name, values)
        if name == "stiffnesses" and oscillator.gamma is not None:  # the damping goes with the stiffness
            with digits():
                run.links = [2 * arb(oscillator.gamma) * arb(k) for k in values]
        yield run
    for name in ("restitution", "omega", "clearance"):
        run = SwiftOracle.of(oscillator, omega, clearance)
        with digits():
            setattr(run, name, arb(getattr(run, name)) * factor)
        yield run


def compare(oscillator: Oscillator, omega: float, clearance: float, impacts: int = IMPACTS) -> Accuracy:
    """Compare the first impacts of a trajectory from rest, at most `impacts` and all before a complete chatter."""
    found = trajectory(oscillator, omega, clearance, periods=40, samples_per_period=1).impacts
    chatter = np.flatnonzero(found.kind == "chatter")
    count = min([impacts, len(found.time), *(int(i) + 1 for i in chatter[:1])])
    exact = SwiftOracle.of(oscillator, omega, clearance)
    exact.run(count)
    amplification = np.zeros(count)
    for run in changed_inputs(oscillator, omega, clearance):
        run.run(count)
        with digits():
            amplification += [abs(float(a - b)) / CHANGE for a, b in zip(run.times, exact.times, strict=True)]
    with digits():
        period = 2 * arb.pi() / arb(omega)
        error = np.array(
            [
                abs(float(int(found.period[k]) * period + arb(found.phase_time[k]) - exact.times[k]))
                for k in range(count)
            ]
        )
    # a missed or invented impact shifts the list, by much more than this
    complete = count >= 4 and np.array_equal(found.stop[:count], exact.stops) and bool(np.all(error < 1e-6 / omega))
    return Accuracy(error, amplification, complete)
