"""The curves of special one-impact motions inside a window of the frequency and another parameter, cut into pieces.

The other one is a clearance, or the factor of the forces or of the bias.

The curves are those of saddle-nodes (SN), period doublings (PD), symmetry breakings (SB) and grazes (GR). Each piece
comes with its motion and with the reason why it ends; of a single frequency there is no piece. The curves are explicit
in the phase of the impact (`explicit_curves`). Where one stop is fixed, the bifurcations of motions with impacts on it
alone are lines of constant frequency.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.grazing.grazing_curve import VariedStop, steady_motion
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.family import OrbitFamily
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
from grazemap_core.orbits.tolerances import NEXT_STEP
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
    """(m,) Forcing frequencies, m >= 2."""
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


@dataclass(frozen=True, eq=False)
class _Window:
    """A window of frequencies and of the parameter that varies."""

    omega: Floats
    """Frequencies across the window."""
    low: float
    """Start of the interval of the parameter."""
    high: float
    """End of this interval."""

    def contains(self, values: Floats) -> Booleans:
        with np.errstate(invalid="ignore"):
            return np.asarray(np.isfinite(values) & (self.low <= values) & (values <= self.high))


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
        Frequencies across the window, >= 2.
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
    window = _Window(np.linspace(*omega, points), *values)
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
            for curve in contacts_with_varied(motions, gap):
                yield from _pieces("GR", curve.moved(-stop * place), window, motion, motions)


def _explicit_pieces(
    motions: StopMotions, gaps: MovedGaps, window: _Window, motion: _PieceMotion
) -> Iterator[CurvePiece]:
    """Yield the pieces of the curves of special orbits, from the orbits at the frequencies of a window."""
    for kind, curves in explicit_curves(motions).items():
        for curve in curves:
            yield from _pieces(kind, _over(curve, gaps), window, motion, motions)


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
    steady = _PieceMotion(1, -1, -1)
    if isinstance(varied, VariedFactor):
        for stop in _stops(varied):
            yield from _pieces("GR", _graze(oscillator, window, varied, stop), window, steady)
        return
    each = [VariedStop(stop, together=True) for stop in (1, -1)] if varied.together else [varied]
    for varied_stop in each:
        curve = varied_graze(oscillator, window.omega, varied_stop)
        if curve is not None:
            yield from _pieces("GR", curve, window, steady)
    if not varied.together and varied.other is not None:
        for line in graze_lines(oscillator, window.omega, varied):
            yield from _of_line(line, window, steady)


def _graze(oscillator: Oscillator, window: _Window, varied: VariedFactor, stop: int) -> OneImpactCurve:
    """Return the curve on which the steady motion touches a stop, over a factor."""
    gaps = moved_gaps(oscillator, varied, stop)
    assert gaps is not None  # a factor moves both stops
    motion = steady_motion(oscillator, window.omega)
    gap, other = (motion.toward(side).amplitude for side in (stop, -stop))
    admissible = ~(gaps.other.fixed + gaps.other.by_gap * gap < other)
    return _over(OneImpactCurve.of_grazes(gap, admissible, stop), gaps)


def _pieces(
    kind: str, curve: OneImpactCurve, window: _Window, motion: _PieceMotion, motions: StopMotions | None = None
) -> Iterator[CurvePiece]:
    """Yield the pieces of a curve of some motions; of the steady motion, which attracts, without them."""
    for members in _runs(window.contains(curve.clearance) & ~curve.undecided, curve.admissible, curve.stop):
        if len(members) < 2:
            continue
        first, last = int(members[0]), int(members[-1])
        places = Places(curve.phase[members], members)
        stable = np.ones(len(members), dtype=np.bool_) if motions is None else motions.are_stable_beside(kind, places)
        yield CurvePiece(
            type=kind,
            period=motion.period,
            impacts_right=motion.impacts_right,
            impacts_left=motion.impacts_left,
            symmetric=motion.symmetric,
            admissible=bool(curve.admissible[first]),
            stop=int(curve.stop[first]),
            omega=window.omega[members],
            value=curve.clearance[members],
            impact_velocity=curve.impact_velocity[members],
            stable_beside=stable,
            ends=(_end(curve, window, first, -1), _end(curve, window, last, 1)),
        )


def _of_line(line: FrequencyLine, window: _Window, motion: _PieceMotion) -> Iterator[CurvePiece]:
    """Yield the pieces of a line of constant frequency: the part that is admissible, and the part that is not."""
    cut = min(max(line.reach, window.low), window.high) if line.admissible else window.high
    for admissible, low, high in ((False, window.low, cut), (True, cut, window.high)):
        if low < high:
            ends = (
                "window" if low == window.low else "admissible",
                "window" if high == window.high else "admissible",
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


def _runs(inside: Booleans, admissible: Booleans, stop: Integers) -> list[Integers]:
    """Return the runs of neighbouring points that are inside and alike."""
    places = np.flatnonzero(inside)
    if not places.size:
        return []
    cut = (np.diff(places) > 1) | (np.diff(admissible[places]) != 0) | (np.diff(stop[places]) != 0)
    return np.split(places, np.flatnonzero(cut) + 1)


def _end(curve: OneImpactCurve, window: _Window, place: int, step: int) -> str:
    """Return why a piece ends after its last point in one direction."""
    beyond = place + step
    if not 0 <= beyond < len(window.omega):
        return "window"
    if curve.undecided[beyond]:
        return "undecided"
    if np.isfinite(curve.clearance[beyond]):
        return "admissible" if window.low <= curve.clearance[beyond] <= window.high else "window"
    # where a curve leaves the grazing curve, its impact velocity falls linearly to zero within a step
    before = place - step
    if not 0 <= before < len(window.omega):
        return "none"
    here, fallen = curve.impact_velocity[place], curve.impact_velocity[before] - curve.impact_velocity[place]
    return "grazing" if here <= NEXT_STEP * fallen else "none"
