"""The curves of special one-impact motions inside a window of the frequency and another parameter, cut into pieces.

The other one is a clearance, or the factor of the forces or of the bias.

The curves are those of saddle-nodes (SN), period doublings (PD), symmetry breakings (SB) and grazes (GR). Each piece
comes with its motion and with the reason why it ends; of a single frequency there is no piece. The curves are explicit
in the phase of the impact (`explicit_curves`). Where one stop is fixed, the bifurcations of motions with impacts on it
alone are lines of constant frequency.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.grazing.grazing_curve import VariedStop, steady_motion
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.single_impact.curve_ends import CurvePoints, CurvesAt, End, Interval, narrowed
from grazemap_core.orbits.single_impact.curve_parameter import CurveParameter, MovedGaps, VariedFactor, moved_gaps
from grazemap_core.orbits.single_impact.curves import OneImpactCurve, explicit_curves
from grazemap_core.orbits.single_impact.fixed_stop_curves import (
    FrequencyLine,
    contacts_with_varied,
    graze_lines,
    lines,
    varied_graze,
)
from grazemap_core.orbits.single_impact.harmonics import Places
from grazemap_core.orbits.single_impact.special_orbits import ABSENT, ALIKE, StopMotions
from grazemap_core.records import dataclass

BOTH_STOPS = VariedStop(1, together=True)
"""The clearance of both stops varies."""


@dataclass(frozen=True, eq=False)
class CurvePiece:
    """A piece of a curve."""

    type: str
    """One of "SN", "PD", "SB" or "GR"."""
    period: int
    """n of the motions, forcing periods."""
    impacts_right: int
    """Impacts on the right stop; -1: it is not touched. Those on the right and the left stop are 1 and -1, or -1 and 1,
    for motions with one impact; 1 and 1 for symmetric motions; -1 and -1 on the grazing curves of the steady motion,
    which are listed where the stops are not symmetric. Between symmetric stops the mirror images -1 and 1 of 1 and -1
    have the same curves and are not listed."""
    impacts_left: int
    """Impacts on the left stop, likewise."""
    symmetric: bool
    """Whether the motions are their own mirror images."""
    admissible: bool
    """Whether the orbits have no contact with a stop other than their impacts; if not, the piece bounds no motions."""
    stop: int
    """GR only, else 0: the stop of the further contact, +1 right and -1 left."""
    omega: Floats
    """(m,) Forcing frequencies, m >= 2: some of those across the window, and those of the ends."""
    value: Floats
    """(m,) Values of the parameter that varies."""
    impact_velocity: Floats
    """(m,) Speeds before an impact; 0 on the grazing curves of the steady motion."""
    stable_beside: Booleans
    """(m,) Whether the motion is stable on one side: all multipliers but the type's are inside the unit circle."""
    ends: tuple[str, str]
    """For either end "window", "grazing" (the curve leaves the grazing curve there), "admissible" (another piece
    continues the curve there), "undecided" (round-off hides whether the next orbit is admissible), or "none" (there are
    no such motions beyond)."""


@dataclass(frozen=True)
class _PieceMotion:
    """What a piece says of its motion."""

    period: int
    """As in `CurvePiece`."""
    impacts_right: int
    """As in `CurvePiece`."""
    impacts_left: int
    """As in `CurvePiece`."""
    symmetric: bool = False
    """As in `CurvePiece`."""


STEADY = _PieceMotion(1, -1, -1)
"""The steady motion, which strikes no stop."""


@dataclass(frozen=True, eq=False)
class _Window:
    """A window of frequencies and of the parameter that varies."""

    omega: Floats
    """Frequencies across the window."""
    values: Interval
    """The values of the parameter."""


@in_own_period
def window_curves(
    oscillator: Oscillator,
    omega: tuple[float, float],
    values: tuple[float, float],
    max_multiple: int = 2,
    points: int = 400,
    varied: CurveParameter = BOTH_STOPS,
) -> list[CurvePiece]:
    """Return the curves of motions with one impact in up to `max_multiple` periods, or one on each stop.

    Between stops that are not symmetric, also the grazing curves of the steady motion.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega, values : (float, float)
        The window, start < stop each, of the frequency and of the parameter that varies; only a bias and the clearance
        of one stop may be negative.
    max_multiple : int
        >= 1; symmetric motions have odd multiples only.
    points : int
        Frequencies across the window, >= 2; between two of them the ends of pieces are solved for.
    varied : VariedStop or VariedFactor
        What varies: the clearance of a stop, or of both (`together`), or a factor.

    Raises
    ------
    ParameterError
        A number is out of range, or nothing is forced.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    other = varied.name if isinstance(varied, VariedFactor) else "clearance"
    any_sign = varied.name == "bias" if isinstance(varied, VariedFactor) else not varied.together
    for name, (low, high) in (("omega", omega), (other, values)):
        signed = any_sign and name == other
        if not (np.isfinite([low, high]).all() and low < high and (low > 0.0 or signed)):
            required = "less than stop" if signed else "greater than 0 and less than stop"
            raise ParameterError(name, f"start must be {required}, both finite")
    checked_order("max_multiple", max_multiple, 1)
    checked_order("points", points, 2)
    window = _Window(np.linspace(*omega, points), Interval(*values))
    if _are_symmetric(oscillator, varied):
        return list(_between_symmetric(oscillator, window, max_multiple, varied))
    return [*_between_others(oscillator, window, max_multiple, varied), *_grazing(oscillator, window, varied)]


def _are_symmetric(oscillator: Oscillator, varied: CurveParameter) -> bool:
    """Return whether the stops are symmetric at all values of a parameter."""
    if isinstance(varied, VariedFactor):
        together = varied.name == "forcing" and varied.right == varied.left
    else:
        together = varied.together
    same = oscillator.restitution_of(1) == oscillator.restitution_of(-1)
    return together and same and oscillator.is_half_wave_symmetric and contact_equilibrium(oscillator) == 0.0


def _between_symmetric(
    oscillator: Oscillator, window: _Window, max_multiple: int, varied: CurveParameter
) -> Iterator[CurvePiece]:
    gaps = moved_gaps(oscillator, varied, 1)
    assert gaps is not None  # both stops move
    for multiple in range(1, max_multiple + 1):
        for symmetric in (False, True) if multiple % 2 else (False,):
            motion = _PieceMotion(multiple, 1, 1 if symmetric else -1, symmetric)
            families = OrbitFamily.of(oscillator, multiple, symmetric).over(window.omega)
            motions = StopMotions(families, 1, ALIKE)
            yield from _explicit_pieces(motions, gaps, window, motion)


def _between_others(
    oscillator: Oscillator, window: _Window, max_multiple: int, varied: CurveParameter
) -> Iterator[CurvePiece]:
    place = contact_equilibrium(oscillator)
    for multiple in range(1, max_multiple + 1):
        families = OrbitFamily.of(oscillator, multiple, False).over(window.omega)
        for stop in _stops(varied):
            motion = _PieceMotion(multiple, *((1, -1) if stop > 0 else (-1, 1)))
            gaps = moved_gaps(oscillator, varied, stop)
            if gaps is not None:
                motions = StopMotions(families, stop, gaps.other)
                yield from _explicit_pieces(motions, gaps, window, motion)
                continue
            assert isinstance(varied, VariedStop)
            assert varied.other is not None
            motions, gap = StopMotions(families, stop, ABSENT), varied.other - stop * place
            for line in lines(motions, gap):
                yield from _of_line(line.moved(-stop * place), window, motion)
            touching = partial(_touching, gap=gap, offset=-stop * place)
            yield from _pieces_of_motions("GR", motions, touching, window, motion)


def _touching(motions: StopMotions, gap: float, offset: float) -> list[OneImpactCurve]:
    """Return the curves on which motions that strike a stop fixed at a gap touch the other one."""
    return [curve.moved(offset) for curve in contacts_with_varied(motions, gap)]


def _explicit_pieces(
    motions: StopMotions, gaps: MovedGaps, window: _Window, motion: _PieceMotion
) -> Iterator[CurvePiece]:
    """Yield the pieces of the curves of special orbits, from the orbits at the frequencies of a window."""
    for kind in motions.types:
        yield from _pieces_of_motions(kind, motions, partial(_explicit, kind=kind, gaps=gaps), window, motion)


def _explicit(motions: StopMotions, kind: str, gaps: MovedGaps) -> list[OneImpactCurve]:
    """Return the curves of special orbits of a type, over a parameter."""
    return [_over(curve, gaps) for curve in explicit_curves(motions, kind)]


def _pieces_of_motions(
    kind: str,
    motions: StopMotions,
    curves_of: Callable[[StopMotions], list[OneImpactCurve]],
    window: _Window,
    motion: _PieceMotion,
) -> Iterator[CurvePiece]:
    """Yield the pieces of the curves of a type, which `curves_of` returns of motions at any frequencies."""

    def curves_at(here: StopMotions) -> CurvesAt:
        return CurvesAt(here.orbits.omega, curves_of(here), partial(here.are_stable_beside, kind), here.graze)

    return _pieces(kind, curves_at(motions), lambda omega: curves_at(motions.over(omega)), window, motion)


def _stops(varied: CurveParameter) -> tuple[int, ...]:
    """Return the stops that there are."""
    if isinstance(varied, VariedFactor):
        return tuple(stop for stop in (1, -1) if np.isfinite(varied.clearance(stop)))
    return (1, -1) if varied.together or varied.other is not None else (varied.stop,)


def _over(curve: OneImpactCurve, gaps: MovedGaps) -> OneImpactCurve:
    """Return a curve over a parameter, from that over the gap of the stop that is struck."""
    value = gaps.value(curve.clearance)
    speed = value * curve.impact_velocity if gaps.forces else curve.impact_velocity
    return replace(curve, clearance=value, impact_velocity=speed)


def _grazing(oscillator: Oscillator, window: _Window, varied: CurveParameter) -> Iterator[CurvePiece]:
    """Yield the curves on which the steady motion touches a stop; not admissible where it is beyond the other stop."""
    if isinstance(varied, VariedFactor):
        for stop in _stops(varied):
            yield from _pieces_of_steady(partial(_graze, oscillator, varied=varied, stop=stop), window)
        return
    each = [VariedStop(stop, together=True) for stop in (1, -1)] if varied.together else [varied]
    for varied_stop in each:
        yield from _pieces_of_steady(partial(varied_graze, oscillator, varied=varied_stop), window)
    if not varied.together and varied.other is not None:
        for line in graze_lines(oscillator, window.omega, varied):
            yield from _of_line(line, window, STEADY)


def _pieces_of_steady(curve_at: Callable[[Floats], OneImpactCurve | None], window: _Window) -> Iterator[CurvePiece]:
    """Yield the pieces of a curve on which the steady motion, which attracts, touches a stop, if there is one."""

    def always(places: Places) -> Booleans:
        return np.ones(len(places.rows), dtype=np.bool_)

    def curves_at(omega: Floats) -> CurvesAt:
        curve = curve_at(omega)
        return CurvesAt(omega, [] if curve is None else [curve], always, always)

    return _pieces("GR", curves_at(window.omega), curves_at, window, STEADY)


def _graze(oscillator: Oscillator, omega: Floats, varied: VariedFactor, stop: int) -> OneImpactCurve:
    """Return the curve on which the steady motion touches a stop, over a factor."""
    gaps = moved_gaps(oscillator, varied, stop)
    assert gaps is not None  # a factor moves both stops
    motion = steady_motion(oscillator, omega)
    gap, other = (motion.toward(side).amplitude for side in (stop, -stop))
    admissible = ~(gaps.other.fixed + gaps.other.by_gap * gap < other)
    return _over(OneImpactCurve.of_grazes(gap, admissible, stop), gaps)


def _pieces(
    kind: str, sampled: CurvesAt, curves_at: Callable[[Floats], CurvesAt], window: _Window, motion: _PieceMotion
) -> Iterator[CurvePiece]:
    """Yield the pieces of the curves of a type of some motions, from their samples at the frequencies of a window."""
    runs = [(curve, members) for curve in sampled.curves for members in _runs(curve, window.values)]
    ends = [
        End(sampled, curve, int(members[place]), step, float(window.omega[members[place]]))
        for curve, members in runs
        for place, step in ((0, -1), (-1, 1))
    ]
    narrow = narrowed(ends, curves_at, window.values)
    reasons = [_reason(end, finer, window.values) for end, finer in zip(ends, narrow, strict=True)]
    for i, (curve, members) in enumerate(runs):
        first, last = narrow[2 * i : 2 * i + 2]
        points = CurvePoints.joined([first.points(), CurvePoints.of(sampled, curve, members), last.points()])
        if len(points.omega) < 2:
            continue
        yield CurvePiece(
            type=kind,
            period=motion.period,
            impacts_right=motion.impacts_right,
            impacts_left=motion.impacts_left,
            symmetric=motion.symmetric,
            admissible=bool(curve.admissible[members[0]]),
            stop=int(curve.stop[members[0]]),
            **points._asdict(),
            ends=(reasons[2 * i], reasons[2 * i + 1]),
        )


def _reason(sampled: End, narrow: End, values: Interval) -> str:
    """Return why a piece ends. Between orbits that are admissible and others there is a little that is undecided."""
    reason = narrow.reason(values)
    return "admissible" if reason == "undecided" and sampled.reason(values) == "admissible" else reason


def _of_line(line: FrequencyLine, window: _Window, motion: _PieceMotion) -> Iterator[CurvePiece]:
    """Yield the pieces of a line of constant frequency: the part that is admissible, and the part that is not."""
    cut = min(max(line.reach, window.values.low), window.values.high) if line.admissible else window.values.high
    for admissible, low, high in ((False, window.values.low, cut), (True, cut, window.values.high)):
        if low < high:
            ends = (
                "window" if low == window.values.low else "admissible",
                "window" if high == window.values.high else "admissible",
            )
            yield CurvePiece(
                type=line.type,
                period=motion.period,
                impacts_right=motion.impacts_right,
                impacts_left=motion.impacts_left,
                symmetric=motion.symmetric,
                admissible=admissible,
                stop=line.stop,
                omega=np.full(2, line.omega),
                value=np.array([low, high]),
                impact_velocity=np.full(2, line.speed),
                stable_beside=np.full(2, line.stable_beside),
                ends=ends,
            )


def _runs(curve: OneImpactCurve, values: Interval) -> list[Integers]:
    """Return the runs of neighbouring points that are decided, inside a window and alike."""
    places = np.flatnonzero(values.contains(curve.clearance) & ~curve.undecided)
    if not places.size:
        return []
    cut = (np.diff(places) > 1) | (np.diff(curve.admissible[places]) != 0) | (np.diff(curve.stop[places]) != 0)
    return np.split(places, np.flatnonzero(cut) + 1)
