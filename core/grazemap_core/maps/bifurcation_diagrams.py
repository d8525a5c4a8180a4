"""Bifurcation diagrams: stroboscopic sections and impacts of settled motions along one parameter.

Every value of the parameter has a trajectory of its own, from rest or from the final state of its neighbour. Its motion
is named and verified as in maps (`runner`), by a run with other roundings from the same initial state. Where that run
has no verified motion, and the recorded one has not closed on the same motion, the motion is named once more, from the
end of the record: roundings may lead the two to different motions, and the one that is recorded counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.codes import ROUNDING_DECIDES
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import ParameterError, RecordSizeError
from grazemap_core.maps.kernels.lane_state import FIGURES, HALVES_RUN
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.planes import ParameterLine
from grazemap_core.maps.runner import Runner, Runners
from grazemap_core.maps.tolerances import EXPONENT_PERIODS
from grazemap_core.maps.unfolding import NAME, arrays_of
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.motion import KINDS, REASONS, Motion
from grazemap_core.simulation.observables import Observables
from grazemap_core.simulation.start import ForcedOscillator, State, forced_oscillator, initial_state
from grazemap_core.simulation.tolerances import MOST_RECORD_BYTES
from grazemap_core.simulation.trajectories import trajectory

DIAGRAM_POLICIES: Final = ("rest", "sweep-up", "sweep-down")
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
    """The motion that the trajectory settles to until EXPONENT_PERIODS after the recorded ones. It is verified if the
    orbit is verified and captures the trajectory, which is not sensitive. A trajectory that ended early is
    unresolved."""
    sensitive: bool
    """As in `unfolding.unfolding_map_tile`; sensitive too where other roundings lead to another motion. A trajectory of
    a sweep starts with the error of the one before, unless that was captured by the end of its record."""
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
        the last value down. If the contact is then beyond a stop, it is put on the stop with its velocity; this is an
        impact if it moves into the stop. After a trajectory that ended early the next one starts from rest.
    periods, transient_periods : int
        Forcing periods that are recorded, and forcing periods before them.
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
    settings = RunSettings(transient_periods + periods + EXPONENT_PERIODS, max_period, observed=observed)
    return _follow(points, policy != "rest", periods, transient_periods, settings, most_bytes)


def _follow(
    points: Iterable[tuple[Oscillator, float, Clearance]],
    follows: bool,
    periods: int,
    transient_periods: int,
    settings: RunSettings,
    most_bytes: int,
) -> Iterator[Section]:
    """Yield the sections at points until their impacts take more than `most_bytes`; then raise RecordSizeError.

    If `follows`, each trajectory starts at the final state of the previous one.
    """
    state: State | None = None
    inherits, shown = False, transient_periods + periods
    impacts, most = 0, most_bytes // IMPACT_BYTES
    runners = Runners(settings)
    nothing = np.zeros(0) if settings.observed is None else settings.observed.nothing
    for oscillator, omega, clearance in points:
        runner = runners.of(oscillator)
        forced = forced_oscillator(oscillator, omega, clearance)
        if state is not None and follows:
            begin = replace(state, displacement=oscillator.between(state.displacement, forced.clearances))
        else:
            begin = initial_state(forced, None, None, 0.0)
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
            max_period=settings.max_period,
            most_bytes=most_bytes,
        )
        impacts += len(run.impacts.stop)
        if impacts > most:
            raise RecordSizeError(most, most_bytes)
        state, settled = None, _NamedMotion(run.motion, False, np.nan, 0, nothing)
        if run.final is not None and len(run.time) == periods + 1:
            state, settled = run.final, _named_motion(runner, forced, begin, inherits)
            if not (settled.motion.verified or _are_same(settled.motion, run.motion)):
                after = Runner(oscillator, settings._replace(max_periods=EXPONENT_PERIODS), runner)
                later = _named_motion(after, forced, state, inherits=True)
                settled = _sensitive(later, 2 * shown) if _contradicts(settled.motion, later.motion) else settled
        captured = settled.halves <= 2 * shown and np.isfinite(settled.transient_growth)
        inherits = follows and state is not None and not captured
        yield Section(
            displacement=oscillator.contact @ run.displacement[:, :periods],
            velocity=oscillator.contact @ run.velocity[:, :periods],
            impact_velocity=run.impacts.velocity,
            impact_stop=run.impacts.stop,
            motion=settled.motion,
            sensitive=settled.sensitive,
            transient_growth=settled.transient_growth,
            start=begin,
            figures=settled.figures,
        )


class _NamedMotion(NamedTuple):
    """The motion that a trajectory settles to."""

    motion: Motion
    """As in `Section`."""
    sensitive: bool
    """As in `Section`."""
    transient_growth: float
    """As in `Section`."""
    halves: int
    """Half periods until the motion was known."""
    figures: Floats
    """As in `Section`."""


def _named_motion(runner: Runner, forced: ForcedOscillator, begin: State, inherits: bool) -> _NamedMotion:
    """Run a trajectory until its motion can be named; `inherits`: it starts with the error of the last one."""
    codes, figures = runner.run_from(forced, begin, inherits)
    named = {name: array.item() for name, array in arrays_of(codes, figures).items()}
    kind, reason = KINDS[named["kind"]], REASONS[named["reason"]] or None
    names = (*NAME[1:], "verified") if kind == "periodic" else ()
    return _NamedMotion(
        motion=Motion(kind=kind, reason=reason, **{name: named[name] for name in names}),
        sensitive=named["sensitive"],
        transient_growth=named["transient_growth"],
        halves=int(codes[HALVES_RUN]),
        figures=figures[FIGURES:],
    )


def _are_same(motion: Motion, other: Motion) -> bool:
    """Return whether two motions have one name."""
    return all(getattr(motion, name) == getattr(other, name) for name in NAME)


def _contradicts(motion: Motion, later: Motion) -> bool:
    """Return whether the later part of a trajectory is another motion: one of both is periodic, and both are known."""
    kinds = {motion.kind, later.kind}
    return "periodic" in kinds and "unresolved" not in kinds and not _are_same(motion, later)


def _sensitive(settled: _NamedMotion, halves: int) -> _NamedMotion:
    """Return a motion, named by a run that begins after some half periods, as one that round-off decides."""
    motion = settled.motion
    if motion.verified:
        motion = replace(motion, verified=False, reason=REASONS[ROUNDING_DECIDES])
    return settled._replace(motion=motion, sensitive=True, halves=halves + settled.halves)
