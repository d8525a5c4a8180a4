"""Bifurcation diagrams: stroboscopic sections and impacts of settled motions along one parameter.

Every value of the parameter has a trajectory of its own, from rest or from the final state of its neighbour. It is run
as in maps (`runner`) until its motion is named. From the state there it goes on as a recorded trajectory: so the motion
that is named is the motion that is drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError, RecordSizeError, checked_order
from grazemap_core.maps.kernels.lane_state import FIGURES, HALVES_RUN, is_captured
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.planes import ParameterLine, Point
from grazemap_core.maps.runner import Runners
from grazemap_core.maps.tolerances import EXPONENT_PERIODS
from grazemap_core.maps.unfolding import NAME, arrays_of
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.motion import KINDS, REASONS, Motion
from grazemap_core.simulation.observables import Observables
from grazemap_core.simulation.start import State, forced_oscillator, initial_state
from grazemap_core.simulation.tolerances import MOST_RECORD_BYTES
from grazemap_core.simulation.trajectories import trajectory

DIAGRAM_POLICIES: Final = ("rest", "sweep-up", "sweep-down")
_NOTHING: Final = np.zeros(0)
IMPACT_BYTES: Final = 9
"""Bytes of an impact in a section: its velocity and its stop."""


@dataclass(frozen=True, eq=False)
class Section:
    """Section and impacts at one value of the parameter."""

    displacement: Floats
    """(k,) Contact coordinate at the start of every recorded forcing period, at phase 0 of the forcing."""
    velocity: Floats
    """(k,) Its rate there."""
    impact_velocity: Floats
    """(i,) Signed velocity before every recorded impact."""
    impact_stop: NDArray[np.int8]
    """(i,) Its stop, +1 right or -1 left."""
    motion: Motion
    """The motion that the trajectory settles to. It is verified if the orbit is verified and captures the trajectory,
    which is not sensitive. A trajectory that ended early is unresolved; it has a section and impacts if it ended after
    the record began."""
    sensitive: bool
    """As in `unfolding.unfolding_map_tile`. A trajectory of a sweep starts with the error of the one before, unless
    that one was captured."""
    transient_growth: float
    """As in `unfolding.unfolding_map_tile`."""
    start: State
    """Initial state of the trajectory."""
    figures: Floats
    """(count,) What is read off the motion, as in maps (`map_observables`); empty if nothing is."""


@in_own_period
def sections(
    line: ParameterLine,
    policy: str = "rest",
    periods: int = 64,
    transient_periods: int = 300,
    max_period: int = 32,
    most_bytes: int = MOST_RECORD_BYTES,
    observed: Observables | None = None,
) -> Iterator[Section]:
    """Run a trajectory at every value of a parameter, in the order of the policy; a generator.

    Parameters
    ----------
    line : ParameterLine
        The parameter and its values.
    policy : one of DIAGRAM_POLICIES
        Initial states: at rest at phase 0; or the final state of the previous value, from the first value up or from
        the last value down. That is the state at the end of the record, or at its beginning if the trajectory was not
        captured: its error is known there. If the contact is then beyond a stop, it is put on the stop with its
        velocity; this is an impact if it moves into the stop. After a trajectory that ended early the next one starts
        from rest.
    periods, transient_periods : int
        Forcing periods that are recorded, and the minimum number of forcing periods before them. The record begins
        later if the motion is not named by then; a motion is looked for during ``transient_periods + periods +
        EXPONENT_PERIODS`` forcing periods.
    max_period : int
        Maximum period n of a motion, in forcing periods.
    most_bytes : int
        Maximum number of bytes of all impacts in a result, and of those of one trajectory, as for `trajectory`.
    observed : Observables or None
        What is read off the motions.

    Yields
    ------
    Section
        For the values in increasing order, for "sweep-down" in decreasing order.

    Raises
    ------
    ParameterError
        An argument is out of its domain. Raised by the call, before the first trajectory.
    RecordSizeError
        There are too many impacts. Raised while the sections are read.
    """
    if policy not in DIAGRAM_POLICIES:
        raise ParameterError("policy", f"must be one of {', '.join(DIAGRAM_POLICIES)}")
    line.check()
    checked_order("periods", periods, 1)
    checked_order("transient_periods", transient_periods, 0)
    checked_order("max_period", max_period, 1)
    order = range(len(line.axis.values))
    points = (line.point(k) for k in (reversed(order) if policy == "sweep-down" else order))
    settings = RunSettings(transient_periods + periods + EXPONENT_PERIODS, max_period, follow=True, observed=observed)
    return _follow(points, policy != "rest", periods, transient_periods, settings, most_bytes)


def _follow(
    points: Iterable[Point], follows: bool, periods: int, transient_periods: int, settings: RunSettings, most_bytes: int
) -> Iterator[Section]:
    """Yield the sections at points until their impacts take more than `most_bytes`; then raise RecordSizeError.

    If `follows`, each trajectory starts at the final state of the previous one.
    """
    state: State | None = None
    inherits = False
    impacts, most = 0, most_bytes // IMPACT_BYTES
    runners = Runners(settings)
    for oscillator, omega, clearance in points:
        forced = forced_oscillator(oscillator, omega, clearance)
        if state is not None and follows:
            begin = replace(state, displacement=oscillator.between(state.displacement, forced.clearances))
        else:
            begin = initial_state(forced, None, None, 0.0)
        codes, figures, state = runners.of(oscillator).run_from(forced, begin, inherits)
        named = {name: array.item() for name, array in arrays_of(codes, figures).items()}
        motion, run = _motion(named), None
        inherits = follows and state is not None and not is_captured(codes)
        if state is not None:
            run = trajectory(
                oscillator,
                omega,
                clearance,
                state.displacement,
                state.velocity,
                state.phase,
                periods=periods,
                transient_periods=max(transient_periods - int(codes[HALVES_RUN]) // 2, 0),
                samples_per_period=1,
                most_bytes=most_bytes,
            )
            impacts += len(run.impacts.stop)
            if impacts > most:
                raise RecordSizeError(most, most_bytes)
            if len(run.time) <= periods:  # it ended early
                state, motion, inherits = None, run.motion, False
            elif not inherits:
                state = run.final
        yield Section(
            displacement=_NOTHING if run is None else oscillator.contact @ run.displacement[:, :periods],
            velocity=_NOTHING if run is None else oscillator.contact @ run.velocity[:, :periods],
            impact_velocity=_NOTHING if run is None else run.impacts.velocity,
            impact_stop=_NOTHING.astype(np.int8) if run is None else run.impacts.stop,
            motion=motion,
            sensitive=named["sensitive"],
            transient_growth=named["transient_growth"],
            start=begin,
            figures=figures[FIGURES:],
        )


def _motion(named: Mapping[str, Any]) -> Motion:
    """Return the motion of a point from the items of `unfolding.arrays_of`."""
    kind, reason = KINDS[named["kind"]], REASONS[named["reason"]] or None
    names = (*NAME[1:], "verified") if kind == "periodic" else ()
    return Motion(kind=kind, reason=reason, **{name: named[name] for name in names})
