"""The two largest Lyapunov exponents of one trajectory, with standard errors, and its kind if they decide it.

Lanes of maps measure growth by kernels of their own (`lane_tangents`); here it is measured along a `LinearisedRun`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numba import njit

from grazemap_core.codes import CHAOTIC, GROWTH_UNDECIDED, QUASI_PERIODIC
from grazemap_core.contact.kernels.cells import Forced
from grazemap_core.contact.kernels.runs import OK, RECORD_FULL, Run
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.stops import Clearance
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.lyapunov import (
    Tangents,
    begin_first,
    begin_second,
    classify_growth,
    exponent,
    orthonormalise,
    tangents,
    weighted_exponent,
)
from grazemap_core.simulation.kernels.tangent import run_half_linearised
from grazemap_core.simulation.monodromy import linearised_run
from grazemap_core.simulation.start import State, longer_record

Floats = np.ndarray[Any, np.dtype[np.float64]]

KINDS_BY_EXPONENT: Final = {GROWTH_UNDECIDED: "unresolved", CHAOTIC: "chaotic", QUASI_PERIODIC: "quasi-periodic"}


@dataclass(frozen=True, eq=False)
class LyapunovExponents:
    """The exponents per unit of time, with their standard errors, over a finite run.

    `first_weighted` is the first one as a mean with weights that decrease to 0 at both ends of the run; `running`
    (periods,) its mean over the first 1, 2, ... periods; `kind` what they imply, as in `classify_growth`; `final` the
    state at the end of the run.
    """

    first: float
    first_error: float
    second: float
    second_error: float
    first_weighted: float
    kind: str
    running: Floats
    final: State


_RUN_HALF, _ORTHONORMALISE = run_half_linearised.whole, orthonormalise.whole
"""With machine code of their own, so that not all that they call is compiled once more here."""


@njit(cache=True)
def run_growth(
    forced: Forced, stops: Stops, run: Run, began: Run, pair: Floats, done: int, skipped: int, scratch: Tangents
) -> tuple[int, int]:
    """Advance a run and two perturbations, pair (2 N, 2), over the half periods from `done` on.

    Return a status and the half periods that are completed; after RECORD_FULL the run may continue.
    """
    halves, u = scratch.growth.shape[0], run.u
    for k in range(done, halves):
        status = _RUN_HALF(forced, stops, run, k, pair, began)
        if status != OK:
            return status, k
        _ORTHONORMALISE(forced.free.frequency, pair, scratch.growth[k])
        if k >= skipped:
            part = 0 if 2 * (k - skipped) < halves - skipped else 1
            sign = 1.0 if k % 2 == 0 else -1.0
            for i in range(2 * u.shape[0]):
                z = sign * u[i // 2, i % 2]
                scratch.moments[part, i, 0] += z
                scratch.moments[part, i, 1] += z * z
    return OK, halves


def lyapunov_exponents(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    periods: int = 2000,
    transient_periods: int = 200,
) -> LyapunovExponents:
    """The exponents of the motion that a trajectory settles to in `transient_periods`, over `periods` after them."""
    run = linearised_run(oscillator, omega, clearance, displacement, velocity, phase)
    scratch = tangents(oscillator.size, transient_periods + periods)
    pair, skipped, done = np.zeros((2 * oscillator.size, 2)), 2 * transient_periods, 0
    begin_first(run.forced.free.frequency, pair)
    begin_second(run.forced.free.frequency, pair)
    orthonormalise(run.forced.free.frequency, pair, scratch.growth[0])
    while True:
        status, done = run_growth(run.forced, run.stops, run.run, run.began, pair, done, skipped, scratch)
        if status != RECORD_FULL:
            break
        run.run = longer_record(run.run)
    run.require(status)
    kind, first, first_error = classify_growth(run.forced.free, run.stops.unit, skipped, skipped, scratch)
    second, second_error = exponent(scratch, 1, skipped, 0.5 * run.period)
    growth = scratch.growth[skipped:, 0].reshape(periods, 2).sum(axis=1)
    return LyapunovExponents(
        first=first,
        first_error=first_error,
        second=second,
        second_error=second_error,
        first_weighted=weighted_exponent(scratch, skipped, 0.5 * run.period),
        kind=KINDS_BY_EXPONENT[kind],
        running=np.cumsum(growth) / (run.period * np.arange(1, periods + 1)),
        final=State(run.physical_state[: oscillator.size], run.physical_state[oscillator.size :], phase),
    )
