"""Changes of a trajectory by differences of two multi-precision runs, sharing nothing with the core.

The event and sticking simulator is run twice, from a state and from the state a tiny step beside it, and both stop at
the same moment exactly; 50 digits leave 30 of the difference quotient.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb
from oracles import digits
from sticking_oracle import StickingOracle


@dataclass
class LandingOracle(StickingOracle):
    """The simulator, able to stop at any given time."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._end: Any = np.inf

    def _longest_step(self) -> arb:
        return min(self._step, (self._end - self._t).mid())

    def _advance(self, series: list[list[arb]], h: arb) -> None:
        lands = h == (self._end - self._t).mid()
        super()._advance(series, h)
        if lands:
            self._t = self._end  # not a rounding beside it

    def run_to(self, time: arb) -> tuple[list[arb], list[arb]]:
        """Go on to a time, through everything that happens, and return displacements and velocities there."""
        self._end = time.mid()
        self.run_to_releases(10**9, self._end)
        assert self._t == self._end
        return self._x, self._v


def difference(
    oscillator: Any,
    omega: float,
    clearance: float,
    displacement: list[float],
    velocity: list[float],
    direction: list[float],
    periods: float,
    phase: float = 0.0,
    precision: int = 50,
) -> tuple[list[float], list[float], LandingOracle]:
    """Return the derivative of the state after so many forcing periods along a direction (2 N), and the base state.

    The third value is the run from the state itself.
    """
    with digits(precision):
        end = 2 * arb.pi() * arb(periods) / arb(omega)
        step = arb(10) ** (-precision // 2)
        start = [arb(value) for value in (*displacement, *velocity)]
        ends = []
        for factor in (arb(0), step):
            run = LandingOracle.of(oscillator, omega, clearance, phase=phase, digits=precision)
            moved = [(value + factor * arb(d)).mid() for value, d in zip(start, direction, strict=True)]
            run._x, run._v = moved[: len(displacement)], moved[len(displacement) :]
            x, v = run.run_to(end)
            ends.append([*x, *v])
            if factor == 0:
                base = run
        return [float((b - a) / step) for a, b in zip(*ends, strict=True)], [float(a) for a in ends[0]], base
