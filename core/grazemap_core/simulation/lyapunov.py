"""The two largest Lyapunov exponents of a motion, with standard errors, and its kind if they decide it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.codes import CHAOTIC, GROWTH_UNDECIDED, QUASI_PERIODIC
from grazemap_core.contact.kernels.workspace import RECORD_FULL
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.lyapunov import (
    begin_growth,
    classify_growth,
    run_growth,
    tangents,
    weighted_exponent,
)
from grazemap_core.simulation.linearised_run import linearised_run
from grazemap_core.simulation.start import State, longer_record
from grazemap_core.simulation.tolerances import EXPONENT_WINDOWS, SHORTEST_WINDOW

KINDS_BY_EXPONENT: Final = {GROWTH_UNDECIDED: "unresolved", CHAOTIC: "chaotic", QUASI_PERIODIC: "quasi-periodic"}
"""Names of the codes of `classify_growth`."""


@dataclass(frozen=True, eq=False)
class LyapunovExponents:
    """The two largest Lyapunov exponents of a motion, per unit of time, over a finite run.

    Attributes
    ----------
    first, second : float
        Minus infinity where perturbations vanish exactly: for a single mass that rests on a stop (superstable); for the
        second exponent, where all perturbations become parallel.
    first_error, second_error : float
        Standard errors of these means over time, from the spread between windows of the run (`standard_error`). For a
        periodic motion the error is deterministic and below c/periods, where c depends on the initial perturbations.
    first_weighted : float
        The first exponent as a mean with weights that decrease to 0 at both ends of the run: far more accurate than the
        unweighted mean for periodic and quasi-periodic motions, no better for chaotic ones.
    kind : "chaotic", "quasi-periodic" or "unresolved"
        "chaotic": the first exponent is positive by EXPONENT_MARGIN standard errors, over the run and over each half of
        it; or perturbations grow by more than GROWTH_SURE nats in each half.
        "quasi-periodic": growth is bounded without drift, so that the first exponent is zero; the second is negative by
        as many standard errors; the extent of the stroboscopic orbit is constant.
        All other motions, periodic ones included, are "unresolved".
    running : (periods,)
        Mean of the first exponent over the first 1, 2, ... periods, which shows its convergence.
    final : State
        The state at the end of the run.
    """

    first: float
    first_error: float
    second: float
    second_error: float
    first_weighted: float
    kind: str
    running: Floats
    final: State


def lyapunov_exponents(
    oscillator: Oscillator,
    omega: float,
    clearance: float,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    periods: int = 2000,
    transient_periods: int = 200,
) -> LyapunovExponents:
    """Return the two largest Lyapunov exponents of the motion that a trajectory settles to.

    Parameters
    ----------
    omega, clearance, displacement, velocity, phase
        As in `trajectories.trajectory`.
    periods : int
        Forcing periods of the run, at least EXPONENT_WINDOWS * SHORTEST_WINDOW.
    transient_periods : int
        Forcing periods before the run, in which the motion settles and the perturbations align.

    Raises
    ------
    ParameterError
        A number is out of range.
    LinearisationError
        The trajectory ends early, or an impact is a graze.
    """
    checked_order("periods", periods, EXPONENT_WINDOWS * SHORTEST_WINDOW)
    checked_order("transient_periods", transient_periods, 0)
    run = linearised_run(oscillator, omega, clearance, displacement, velocity, phase)
    scratch = tangents(oscillator.size, transient_periods + periods)
    skipped = 2 * transient_periods
    begin_growth(run.problem, scratch)
    done = 0
    while True:
        status, done = run_growth(run.problem, run.held, run.state, clearance, done, skipped, run.work, scratch)
        if status != RECORD_FULL:
            break
        run.work = longer_record(run.work)
    run.require(status)
    kind, first, first_error, second, second_error = classify_growth(run.problem, clearance, skipped, skipped, scratch)
    growth = scratch.growth[skipped:, 0].reshape(periods, 2).sum(axis=1)
    return LyapunovExponents(
        first=first,
        first_error=first_error,
        second=second,
        second_error=second_error,
        first_weighted=weighted_exponent(scratch, skipped, 0.5 * run.period),
        kind=KINDS_BY_EXPONENT[kind],
        running=np.cumsum(growth) / (run.period * np.arange(1, periods + 1)),
        final=State(run.physical[: oscillator.size], run.physical[oscillator.size :], phase),
    )
