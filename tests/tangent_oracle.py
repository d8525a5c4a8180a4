"""Changes of a trajectory by differences of two multi-precision runs, sharing nothing with the core.

The event and sticking simulator is run twice, from a state and from the state a tiny step beside it, and both stop at
the same moment exactly; 50 digits leave 30 of the difference quotient.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpmath as mp
from sticking_oracle import StickingOracle


@dataclass
class LandingOracle(StickingOracle):
    """The simulator, able to stop at any given time."""

    @property
    def _step(self) -> mp.mpf:
        return min(self._longest, self._end - self._t)

    @_step.setter
    def _step(self, value: mp.mpf) -> None:
        self._longest, self._end = value, mp.inf

    def run_to(self, time: mp.mpf) -> tuple[list[mp.mpf], list[mp.mpf]]:
        """Go on to a time, through everything that happens, and return displacements and velocities there."""
        self._end = time
        self.run_to_releases(10**9, time)
        assert self._t == time
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
    digits: int = 50,
) -> tuple[list[float], list[float], LandingOracle]:
    """Return the derivative of the state after so many forcing periods along a direction (2 N), and the base state.

    The third value is the run from the state itself.
    """
    with mp.workdps(digits + 8):
        end = 2 * mp.pi * mp.mpf(periods) / mp.mpf(omega)
        step = mp.mpf(10) ** (-digits // 2)
        start = [mp.mpf(value) for value in (*displacement, *velocity)]
        ends = []
        for factor in (mp.mpf(0), step):
            run = LandingOracle.of(oscillator, omega, clearance, phase=phase, digits=digits)
            moved = [value + factor * mp.mpf(d) for value, d in zip(start, direction, strict=True)]
            run._x, run._v = moved[: len(displacement)], moved[len(displacement) :]
            x, v = run.run_to(end)
            ends.append([*x, *v])
            if factor == 0:
                base = run
        return [float((b - a) / step) for a, b in zip(*ends, strict=True)], [float(a) for a in ends[0]], base
