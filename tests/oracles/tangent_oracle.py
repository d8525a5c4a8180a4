"""Changes of a trajectory by differences of two multi-precision runs, sharing nothing with the core.

The event and sticking simulator is run twice, from a state and from the state a tiny step beside it, and both stop at
the same moment exactly; 50 digits leave 30 of the difference quotient.
"""

from __future__ import annotations

from typing import Any

from flint import arb

from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle


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
) -> tuple[list[float], list[float]]:
    """Return the derivative of the state after so many forcing periods along a direction (2 N), and that state."""
    count = len(displacement)
    with digits(precision):
        end = (2 * arb.pi() * arb(periods) / arb(omega)).mid()
        step = arb(10) ** (-precision // 2)
        start = [arb(value) for value in (*displacement, *velocity)]
        ends = []
        for factor in (arb(0), step):
            moved = [(value + factor * arb(d)).mid() for value, d in zip(start, direction, strict=True)]
            state = {"displacement": moved[:count], "velocity": moved[count:], "phase": phase, "digits": precision}
            x, v, _ = GeneralOracle.between(oscillator, omega, clearance, **state).at(end)
            ends.append([*x, *v])
        return [float((b - a) / step) for a, b in zip(*ends, strict=True)], [float(a) for a in ends[0]]
