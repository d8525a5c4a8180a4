"""Impact times in 40-digit arithmetic, from the simulator that the tests compare with; inputs are exact binary64."""

from __future__ import annotations

import numpy as np

from benchmarks.work import Floats, Work
from tests.oracles.event_oracle import EventOracle


def exact_impact_times(work: Work, count: int) -> list[str]:
    """Return the first impact times of lane 0, as decimal numbers of 30 digits."""
    simulation = EventOracle.of(work.oscillator, work.omega, float(work.clearances[0]))
    simulation.run(count)
    return [_decimal(time) for time in simulation.times[:count]]


def errors_of(times: Floats, exact: list[str]) -> Floats:
    """Return |time - exact time| of the impacts that both have, rounded once only."""
    from mpmath import mpf, workdps

    with workdps(40):
        return np.array([float(abs(mpf(float(t)) - mpf(e))) for t, e in zip(times, exact, strict=False)])


def _decimal(number: object) -> str:
    """Return a multi-precision number as text."""
    from mpmath import nstr

    return str(nstr(number, 30))
