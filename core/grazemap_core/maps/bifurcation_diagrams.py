"""Bifurcation diagrams: stroboscopic sections and impacts of settled motions along one parameter.

Every value of the parameter has a trajectory of its own, from rest or from the final state of its neighbour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.codes import NOT_CLOSED
from grazemap_core.errors import LinearisationError, ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.lyapunov import lyapunov_exponents
from grazemap_core.simulation.motion import REASONS, Motion
from grazemap_core.simulation.start import State
from grazemap_core.simulation.trajectories import Trajectory, trajectory

Parameter = Literal["clearance", "omega"]
PARAMETERS: Final = ("clearance", "omega")
POLICIES: Final = ("rest", "sweep-up", "sweep-down")
EXPONENT_PERIODS: Final = 500
"""Forcing periods over which exponents are measured if a trajectory has not closed."""
ALIGNING_PERIODS: Final = 50
"""Forcing periods before these, in which the perturbations align."""


@dataclass(frozen=True, eq=False)
class Section:
    """Section and impacts at one value of the parameter.

    Attributes
    ----------
    displacement, velocity : (k,)
        State of mass 1 at the start of every recorded forcing period, where the phase of the forcing is 0.
    impact_velocity : (i,), impact_stop : (i,) +1 A or -1 C
        Signed velocity before every recorded impact, and its stop.
    motion : Motion
        If the trajectory has not closed, it is chaotic, quasi-periodic or unresolved, as decided by the growth of small
        changes over another EXPONENT_PERIODS.
    final : State or None
        Of a motion that is classified so, the state at the end of these periods; None for others.
    """

    displacement: Floats
    velocity: Floats
    impact_velocity: Floats
    impact_stop: NDArray[np.int8]
    motion: Motion
    final: State | None


def sections(
    oscillator: Oscillator,
    vary: Parameter,
    values: ArrayLike,
    fixed: float,
    policy: str = "rest",
    periods: int = 64,
    transient_periods: int = 300,
    max_period: int = 32,
) -> Iterator[Section]:
    """Run a trajectory at every value of a parameter, in the order of the policy; a generator.

    Parameters
    ----------
    oscillator : Oscillator
    vary : {"clearance", "omega"}
    values : (n,)
        > 0, increasing.
    fixed : float
        Value of the parameter that does not vary.
    policy : one of POLICIES
        Initial states: at rest at phase 0; or the final state of the previous value, from the first value up or from
        the last value down. If mass 1 is then beyond a stop, it is put on the stop with its velocity; this is an impact
        if it moves into the stop. After a trajectory that ended early the next one starts from rest.
    periods, transient_periods : int
        Forcing periods that are recorded, and forcing periods before them.
    max_period : int
        Maximum period n of a motion, in forcing periods.

    Yields
    ------
    Section
        For the values in increasing order, for "sweep-down" in decreasing order.

    Raises
    ------
    ParameterError
        A number is out of range. Raised by the call, before the first trajectory.
    """
    if vary not in PARAMETERS:
        raise ParameterError("vary", f"must be one of {', '.join(PARAMETERS)}")
    if policy not in POLICIES:
        raise ParameterError("policy", f"must be one of {', '.join(POLICIES)}")
    numbers = np.array(values, dtype=np.float64)
    if numbers.ndim != 1 or not np.all(np.isfinite(numbers) & (numbers > 0.0)) or np.any(np.diff(numbers) <= 0.0):
        raise ParameterError("values", "must be an increasing list of finite numbers greater than 0")
    if not (np.isfinite(fixed) and fixed > 0.0):
        raise ParameterError("omega" if vary == "clearance" else "clearance", "must be a finite number greater than 0")
    for name, count, least in (
        ("periods", periods, 1),
        ("transient_periods", transient_periods, 0),
        ("max_period", max_period, 1),
    ):
        checked_order(name, count, least)
    ordered = numbers[::-1] if policy == "sweep-down" else numbers
    return _follow(oscillator, vary, ordered, fixed, policy != "rest", periods, transient_periods, max_period)


def _follow(
    oscillator: Oscillator,
    vary: Parameter,
    values: Floats,
    fixed: float,
    follows: bool,
    periods: int,
    transient_periods: int,
    max_period: int,
) -> Iterator[Section]:
    """Yield the sections; if `follows`, each trajectory starts at the final state of the previous one."""
    size = oscillator.size
    at_rest = State(np.zeros(size), np.zeros(size), 0.0)
    state = at_rest
    for value in values.tolist():
        omega, clearance = (fixed, value) if vary == "clearance" else (value, fixed)
        begin = _within(state, clearance) if follows else at_rest
        run = trajectory(
            oscillator,
            omega,
            clearance,
            begin.displacement,
            begin.velocity,
            begin.phase,
            periods=periods,
            transient_periods=transient_periods,
            samples_per_period=1,
            max_period=max_period,
        )
        whole = len(run.time) == periods + 1
        state = run.final if whole and run.final is not None else at_rest
        motion, final = _named(oscillator, omega, clearance, run) if whole else (run.motion, None)
        yield Section(
            displacement=run.displacement[0, :periods],
            velocity=run.velocity[0, :periods],
            impact_velocity=run.impacts.velocity,
            impact_stop=run.impacts.stop,
            motion=motion,
            final=final,
        )


def _named(oscillator: Oscillator, omega: float, clearance: float, run: Trajectory) -> tuple[Motion, State | None]:
    """Return the motion of a trajectory; if it has not closed, from its exponents, with the state at their end."""
    motion, end = run.motion, run.final
    if end is None or motion.reason != REASONS[NOT_CLOSED]:
        return motion, None
    try:
        exponents = lyapunov_exponents(
            oscillator,
            omega,
            clearance,
            end.displacement,
            end.velocity,
            end.phase,
            periods=EXPONENT_PERIODS,
            transient_periods=ALIGNING_PERIODS,
        )
    except LinearisationError:
        return motion, None
    return (motion if exponents.kind == "unresolved" else Motion(kind=exponents.kind)), exponents.final


def _within(state: State, clearance: float) -> State:
    """Return a state with mass 1 moved onto the stop that it is beyond."""
    if abs(state.displacement[0]) <= clearance:
        return state
    displacement = state.displacement.copy()
    displacement[0] = np.copysign(clearance, displacement[0])
    return State(displacement, state.velocity, state.phase)
