"""Lyapunov exponents of any motion, with their standard errors, and what they say of its kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.codes import CHAOTIC, GROWTH_UNDECIDED, QUASI_PERIODIC
from grazemap_core.contact.kernels.workspace import RECORD_FULL
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.lyapunov import (
    begin_growth,
    judge_growth,
    run_columns,
    tangents,
    weighted_exponent,
)
from grazemap_core.simulation.linearised_run import linearised_run
from grazemap_core.simulation.tolerances import EXPONENT_BLOCKS

KINDS_BY_EXPONENT: Final = {GROWTH_UNDECIDED: "unresolved", CHAOTIC: "chaotic", QUASI_PERIODIC: "quasi-periodic"}
"""What the kernel's codes stand for."""


@dataclass(frozen=True, eq=False)
class LyapunovExponents:
    """The two largest Lyapunov exponents of a motion, per unit of time, over the time that was looked at.

    Attributes
    ----------
    first, second : float
        Minus infinity where changes die out altogether: in a single mass that rests on a stop (superstable), or, for
        the second, where all changes become one.
    first_error, second_error : float
        Standard errors of these means over time, by blocking. For a periodic motion there is no chance in it, and
        what is left is below c/periods, c depending on the directions that the changes began with.
    first_weighted : float
        The first exponent as a mean with weights that fall to 0 at both ends of the run: for periodic and
        quasi-periodic motions far closer than the plain mean, for chaotic ones no better.
    kind : "chaotic", "quasi-periodic" or "unresolved"
        "chaotic": the first exponent is positive by EXPONENT_MARGIN standard errors, in each half of the run too; or
        changes grow by more than GROWTH_SURE nats in each.
        "quasi-periodic": growth stays bounded and does not drift, so that the first is zero; the second is negative by
        as many; the stroboscopic orbit keeps its extent. Anything else, periodic motions among it, is not decided here.
    periods : int
        Forcing periods that the means are over.
    running : (periods,)
        Mean of the first exponent over the first 1, 2, ... of them: how it converges.
    """

    first: float
    first_error: float
    second: float
    second_error: float
    first_weighted: float
    kind: str
    periods: int
    running: Floats


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
        As in `trajectory.trajectory`.
    periods : int
        Forcing periods that count, at least EXPONENT_BLOCKS.
    transient_periods : int
        Forcing periods before, in which the motion settles and the changes find their directions.

    Raises
    ------
    ParameterError
        A number is out of range.
    LinearisationError
        The trajectory ends early, or an impact is a graze.
    """
    if periods < EXPONENT_BLOCKS:
        raise ParameterError("periods", f"must be {EXPONENT_BLOCKS} or greater")
    if transient_periods < 0:
        raise ParameterError("transient_periods", "must be 0 or greater")
    run = linearised_run(oscillator, omega, clearance, displacement, velocity, phase)
    scratch = tangents(oscillator.size, transient_periods + periods)
    skipped = 2 * transient_periods
    begin_growth(run.problem, scratch)
    done = 0
    while True:
        status, done = run_columns(
            run.problem,
            run.held,
            run.state,
            clearance,
            0,
            2 * (transient_periods + periods),
            scratch.pair,
            True,
            skipped,
            done,
            run.work,
            scratch,
        )
        if status != RECORD_FULL:
            break
        run.grow_record()
    run.require(status)
    kind, first, first_error, second, second_error = judge_growth(run.problem, clearance, skipped, scratch)
    growth = scratch.growth[skipped:, 0].reshape(periods, 2).sum(axis=1)
    return LyapunovExponents(
        first=first,
        first_error=first_error,
        second=second,
        second_error=second_error,
        first_weighted=weighted_exponent(scratch, skipped, 0.5 * run.period),
        kind=KINDS_BY_EXPONENT[kind],
        periods=periods,
        running=np.cumsum(growth) / (run.period * np.arange(1, periods + 1)),
    )
