"""Bifurcation diagrams: stroboscopic sections and impacts of settled motions along one parameter.

Every value of the parameter has a trajectory of its own, from rest or from the final state of its neighbour. Its motion
is named and verified as in maps (`settling`), from the same initial state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError, RecordSizeError
from grazemap_core.maps.kernels.lane_state import HALVES_RUN
from grazemap_core.maps.settling import Settler, Settling
from grazemap_core.maps.unfolding import arrays_of
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS, REASONS, Motion
from grazemap_core.simulation.start import State
from grazemap_core.simulation.tolerances import MOST_RECORD_BYTES
from grazemap_core.simulation.trajectories import trajectory

Parameter = Literal["clearance", "omega"]
PARAMETERS: Final = ("clearance", "omega")
POLICIES: Final = ("rest", "sweep-up", "sweep-down")
EXPONENT_PERIODS: Final = 500
"""Forcing periods after the recorded ones until which a motion may settle. As in maps, the growth of small changes is
measured in the last GROWTH_SHARE of all periods."""
IMPACT_BYTES: Final = 9
"""Bytes of an impact in a section: its velocity and its stop."""


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
        The motion that the trajectory settles to until EXPONENT_PERIODS after the recorded ones. It is verified if the
        orbit is verified and captures the trajectory, which is not sensitive. A trajectory that ended early is
        unresolved.
    sensitive, transient_growth : bool, float
        As in `unfolding.unfolding_map_tile`. A trajectory of a sweep starts with the error of the one before, unless
        that was captured by the end of its record.
    start : State
        Initial state of the trajectory.
    """

    displacement: Floats
    velocity: Floats
    impact_velocity: Floats
    impact_stop: NDArray[np.int8]
    motion: Motion
    sensitive: bool
    transient_growth: float
    start: State


def sections(
    oscillator: Oscillator,
    vary: Parameter,
    values: ArrayLike,
    fixed: float,
    policy: str = "rest",
    periods: int = 64,
    transient_periods: int = 300,
    max_period: int = 32,
    most_bytes: int = MOST_RECORD_BYTES,
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
    most_bytes : int
        Maximum number of bytes of all impacts in a result, and of those of one trajectory, as for `trajectory`.

    Yields
    ------
    Section
        For the values in increasing order, for "sweep-down" in decreasing order.

    Raises
    ------
    ParameterError
        A number is out of range. Raised by the call, before the first trajectory.
    RecordSizeError
        There are too many impacts. Raised while the sections are read.
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
    points = [(fixed, value) if vary == "clearance" else (value, fixed) for value in ordered.tolist()]
    found = _follow(oscillator, points, policy != "rest", periods, transient_periods, max_period, most_bytes)
    return _bounded(found, most_bytes)


def _bounded(found: Iterator[Section], most_bytes: int) -> Iterator[Section]:
    """Yield sections until their impacts take more than a number of bytes; then raise RecordSizeError."""
    impacts, most = 0, most_bytes // IMPACT_BYTES
    for section in found:
        impacts += len(section.impact_stop)
        if impacts > most:
            raise RecordSizeError(most, most_bytes)
        yield section


def _follow(
    oscillator: Oscillator,
    points: Sequence[tuple[float, float]],
    follows: bool,
    periods: int,
    transient_periods: int,
    max_period: int,
    most_bytes: int,
) -> Iterator[Section]:
    """Yield the sections at points (omega, clearance).

    If `follows`, each trajectory starts at the final state of the previous one.
    """
    at_rest = State(np.zeros(oscillator.size), np.zeros(oscillator.size), 0.0)
    state, inherits, shown = at_rest, False, transient_periods + periods
    settler = Settler(oscillator, Settling(shown + EXPONENT_PERIODS, max_period))
    for omega, clearance in points:
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
            most_bytes=most_bytes,
        )
        state, settled = at_rest, _Settled(run.motion, False, np.nan, 0)
        if run.final is not None and len(run.time) == periods + 1:
            state, settled = run.final, _settled(settler, omega, clearance, begin, inherits)
        captured = settled.halves <= 2 * shown and np.isfinite(settled.transient_growth)
        inherits = follows and state is not at_rest and not captured
        yield Section(
            displacement=run.displacement[0, :periods],
            velocity=run.velocity[0, :periods],
            impact_velocity=run.impacts.velocity,
            impact_stop=run.impacts.stop,
            motion=settled.motion,
            sensitive=settled.sensitive,
            transient_growth=settled.transient_growth,
            start=begin,
        )


class _Settled(NamedTuple):
    """The motion that a trajectory settles to, as in `Section`, and half periods until that was known."""

    motion: Motion
    sensitive: bool
    transient_growth: float
    halves: int


def _settled(settler: Settler, omega: float, clearance: float, begin: State, inherits: bool) -> _Settled:
    """Run a trajectory until its motion can be named; `inherits`: it starts with the error of the last one."""
    codes, figures = settler.run_from(omega, clearance, begin, inherits)
    named = {name: array.item() for name, array in arrays_of(codes, figures).items()}
    return _Settled(_motion(named), named["sensitive"], named["transient_growth"], int(codes[HALVES_RUN]))


def _motion(named: dict[str, Any]) -> Motion:
    """Return the motion of one point of the arrays of `unfolding_map_tile`."""
    kind, reason = KINDS[named["kind"]], REASONS[named["reason"]] or None
    names = ("period", "impacts_right", "impacts_left", "symmetric", "sticking", "verified")
    return Motion(kind=kind, reason=reason, **{name: named[name] for name in names if kind == "periodic"})


def _within(state: State, clearance: float) -> State:
    """Return a state with mass 1 moved onto the stop that it is beyond."""
    if abs(state.displacement[0]) <= clearance:
        return state
    displacement = state.displacement.copy()
    displacement[0] = np.copysign(clearance, displacement[0])
    return State(displacement, state.velocity, state.phase)
