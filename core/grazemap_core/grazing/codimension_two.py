"""All codimension-two points of the grazing curve in an interval of forcing frequencies.

Two kinds are the zeros of three functions of one variable (theory, "Codimension-two points: recurrence" and "...:
resonant"), which `kernels.root_isolation` finds without missing one:

- recurrence points, ``g(m T/2) = 0``: the paper's four families, equations (42), (45), (57), (58);
- resonant points, ``h = 0`` or ``h_s = 0`` at ``n T`` or ``n T/2``: where saddle-node, period-doubling and
  symmetry-breaking curves of single-impact orbits leave the grazing curve.

Two kinds depend on the steady motion (theory, "Several harmonics"). `coincident_grazes` finds them by bounds that leave
none out:

- double grazes: both stops are grazed, which are not alike;
- corners: two maxima of the steady motion are equal, and the grazing curve has a kink.

T is the period of the forces: with p the common divisor of their harmonics, 2 pi/(p omega).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from grazemap_core.errors import ConditioningError, ParameterError, checked_order
from grazemap_core.grazing.coincident_grazes import Coincidence, equal_maxima, united, vanishing_margins
from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop, first_recurrence, steady_motion
from grazemap_core.grazing.kernels.root_isolation import NEAR_DOUBLE, TOO_MANY_CELLS, isolate
from grazemap_core.grazing.one_impact_family import Pattern, PeriodicSums, periodic_sums
from grazemap_core.grazing.resonant_unfoldings import ResonantUnfolding, resonant_unfolding
from grazemap_core.grazing.tolerances import END_WIDTH, MAX_FREQUENCY_RATIO
from grazemap_core.model.harmonic_response import require_damped, require_forced
from grazemap_core.model.impulse_response import ImpulseResponse, evaluate, impulse_response
from grazemap_core.model.kernels.response_sums import ALTERNATING, IMPULSE, SAME_SIGN
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple, dataclass

Bifurcation = Literal["SN", "PD", "SB"]
Status = Literal["simple", "near-double"]
Kind = Literal["recurrence", "resonant", "double-graze", "corner"]


_HIDDEN = (
    "the modes differ so much in frequency that round-off hides where the impulse response vanishes; the masses or the "
    "stiffnesses differ too much in size"
)


class Family(NamedTuple):
    """One of the paper's four families (42)."""

    case: int
    """Case of the family, 1-4."""
    n: int
    """Number of periods of the family."""


@dataclass(frozen=True)
class Corner:
    """A kink of the grazing curve, where two maxima of the steady motion toward the grazed stop are equal."""

    phase_before: float
    """omega t in (-pi/p, pi/p] of the maximum that is the larger one below the frequency of the corner."""
    phase_after: float
    """omega t in (-pi/p, pi/p] of the maximum that is the larger one above the frequency of the corner."""
    slope_before: float
    """d A/d omega of the first maximum, which the grazing curve has below the corner; the smaller slope."""
    slope_after: float
    """d A/d omega of the second maximum."""
    recurrence_before: int
    """After a graze at the first maximum, the number of the contact at which an impact first recurs, 0 if none does
    within max_order half periods. The contacts are those of the steady motion at the corner, of both stops if they are
    alike, in the order of time."""
    recurrence_after: int
    """That number after a graze at the second maximum."""


@dataclass(frozen=True)
class CodimensionTwoPoint:
    """A point (omega, clearance) of the grazing curve at which its unfolding changes."""

    kind: Kind
    """What changes there."""
    omega: float
    """Forcing frequency."""
    clearance: float
    """Clearance of the stop that varies, on the grazing curve."""
    residual: float
    """Modulus of the function at its zero over the sum of its blocks' amplitudes; dimensionless."""
    status: Status
    """A near-double zero stands for two zeros that are too close to be resolved, or for an extremum close to zero."""
    omega_error: float
    """Error of omega by the round-off of the model."""
    order: int | None = None
    """m, the number of half periods. Like `active` and `families`, None unless this is a recurrence point."""
    active: bool | None = None
    """Whether no impact recurs here at a smaller order."""
    families: tuple[Family, ...] | None = None
    """The paper's cases 1-4 with their number of periods n."""
    multiple: int | None = None
    """n, the period in forcing periods. Like `symmetric` and `bifurcation`, None unless this is a resonant point."""
    symmetric: bool | None = None
    """Whether the orbits have one impact on each stop (True), or one impact on one stop."""
    bifurcation: Bifurcation | None = None
    """The curve that leaves the grazing curve here."""
    unfolding: ResonantUnfolding | None = None
    """Leading order of that curve. None for a near-double point, where it is not defined."""
    stop: int | None = None
    """+1 or -1: the stop that is grazed, where the two are not alike; otherwise this, `amplitude_slope` and `margin`
    are None."""
    amplitude_slope: float | None = None
    """d A/d omega; None at a corner."""
    margin: float | None = None
    """Gap of the other stop minus the amplitude toward it; None if there is none."""
    corner: Corner | None = None
    """None for other points and near-double ones."""


@dataclass(frozen=True)
class _Zero:
    """A zero of g, h or h_s."""

    time: float
    """Time of the zero."""
    uncertainty: float
    """Uncertainty of the time."""
    status: Status
    """Whether the zero is near-double."""
    residual: float
    """Modulus of the function there."""


def families_of_order(order: int) -> tuple[Family, ...]:
    """Return the paper's (case, n) for the return after `order` half periods, equations (42).

    Case 1 is from A onto A, case 4 from C onto C (even orders); case 2 from C onto A, case 3 from A onto C (odd ones).
    """
    if order % 2 == 0:
        return Family(1, order // 2), Family(4, order // 2 - 1)
    return Family(2, (order - 1) // 2), Family(3, (order - 1) // 2)


def codimension_two_points(
    oscillator: Oscillator,
    omega_start: float,
    omega_stop: float,
    max_order: int = 8,
    max_multiple: int = 4,
    varied: VariedStop = ALIKE,
) -> list[CodimensionTwoPoint]:
    """Return every codimension-two point with omega in ``[omega_start, omega_stop]``, by increasing omega.

    Where the stops are not alike, a graze recurs after whole periods, and motions have all their impacts on one stop;
    where the other one is grazed too there is a double graze.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped. (With an undamped mode the periodic sums do not converge and the grazing motion is
        not unique, so recurrence points are not computed either.)
    omega_start, omega_stop : float
        0 < omega_start < omega_stop (rad/s in SI). A point within rounding of an end is included.
    max_order : int
        Largest return m of the recurrence points, >= 1.
    max_multiple : int
        Largest multiple n of the resonant points, >= 0; 0 for none.
    varied : VariedStop
        The stop whose clearance varies, and the other one; two equal ones unless it is given.

    Returns
    -------
    list of CodimensionTwoPoint

    Raises
    ------
    ParameterError
        Nothing is forced, the stops are to be alike and are not, a number is out of range, or the interval holds too
        many oscillations of g, or cells with two equal maxima, to search.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    require_forced(oscillator)
    require_damped(oscillator)
    checked_order("max_order", max_order, 1)
    checked_order("max_multiple", max_multiple, 0)
    if not (math.isfinite(omega_start) and math.isfinite(omega_stop) and 0.0 < omega_start < omega_stop):
        raise ParameterError("omega", "start must be greater than 0 and less than stop, both finite")
    if omega_stop > MAX_FREQUENCY_RATIO * omega_start:
        raise ParameterError("omega", f"stop must be at most {MAX_FREQUENCY_RATIO:.0e} times start")
    varied.require(oscillator)
    reduced, divisor = oscillator.at_own_period
    if divisor > 1:
        ends = omega_start, omega_stop
        points = codimension_two_points(reduced, divisor * ends[0], divisor * ends[1], max_order, max_multiple, varied)
        return [_at_declared_frequency(point, divisor, *ends) for point in points]
    response = impulse_response(modal_model(oscillator))
    if omega_stop > MAX_FREQUENCY_RATIO * float(np.sqrt(np.max(response.frequency_squared))):
        raise ParameterError(
            "omega", f"stop must be at most {MAX_FREQUENCY_RATIO:.0e} times the highest natural frequency"
        )
    points = _recurrences(response, omega_start, omega_stop, max_order, varied)
    differ = oscillator.restitution_left is not None
    points += _resonances(response, omega_start, omega_stop, max_multiple, varied.alike and not differ)
    points += _double_grazes(oscillator, varied, omega_start, omega_stop)
    if len(oscillator.drive) > 1:
        points += _corners(oscillator, response, varied, omega_start, omega_stop, max_order)
    if not points:
        return []
    points.sort(key=lambda point: (point.omega, point.kind, point.order or point.multiple or 0))
    if not varied.alike:
        points = [replace(point, stop=varied.stop) for point in points]
    elif differ:
        # motions on the one stop and on the other unfold differently; there are no symmetric ones
        points = [
            point if stop is None else replace(point, stop=stop)
            for point in points
            for stop in ((1, -1) if point.kind == "resonant" else (None,))
        ]
    return _on_the_curve(oscillator, response, points, varied)


def _at_declared_frequency(point: CodimensionTwoPoint, divisor: int, start: float, stop: float) -> CodimensionTwoPoint:
    """Return a point of the forces' own frequency, which is `divisor` times omega, with omega in [start, stop]."""
    unfolding, corner, slope = point.unfolding, point.corner, point.amplitude_slope
    if unfolding is not None:
        unfolding = replace(
            unfolding,
            slope=divisor * unfolding.slope,
            quadratic=None if unfolding.quadratic is None else divisor**2 * unfolding.quadratic,
            velocity_slope=divisor * unfolding.velocity_slope,
        )
    if corner is not None:
        corner = replace(
            corner,
            phase_before=corner.phase_before / divisor,
            phase_after=corner.phase_after / divisor,
            slope_before=divisor * corner.slope_before,
            slope_after=divisor * corner.slope_after,
        )
    return replace(
        point,
        omega=min(max(point.omega / divisor, start), stop),
        omega_error=point.omega_error / divisor,
        amplitude_slope=None if slope is None else divisor * slope,
        unfolding=unfolding,
        corner=corner,
    )


def _on_the_curve(
    oscillator: Oscillator, response: ImpulseResponse, points: list[CodimensionTwoPoint], varied: VariedStop
) -> list[CodimensionTwoPoint]:
    """Return points with their clearance, slope, margin and unfolding."""
    motion = steady_motion(oscillator, np.array([point.omega for point in points]), slopes=True)
    maxima = motion.toward(varied.stop)
    clearances = varied.clearance(oscillator, maxima.amplitude)
    margins = varied.margins(oscillator, motion, maxima.amplitude)
    columns = (clearances, margins, maxima.slope, maxima.curvature)
    each = zip(points, _sums_at(response, points), *(column.tolist() for column in columns), strict=True)
    return [
        replace(
            point,
            clearance=clearance,
            unfolding=None
            if sums is None
            else resonant_unfolding(
                sums, oscillator.restitution_of(point.stop or 1), curvature, point.bifurcation == "SN", not varied.alike
            ),
            amplitude_slope=None if varied.alike or point.kind == "corner" else slope,
            margin=margin if math.isfinite(margin) else None,
        )
        for point, sums, clearance, margin, slope, curvature in each
    ]


def _sums_at(response: ImpulseResponse, points: list[CodimensionTwoPoint]) -> list[PeriodicSums | None]:
    """Return the periodic sums at resonant points; None at other points and near-double ones, without an unfolding."""
    of_pattern: dict[Pattern, list[int]] = {}
    for place, point in enumerate(points):
        if point.multiple is not None and point.symmetric is not None and point.status == "simple":
            of_pattern.setdefault(Pattern(point.multiple, point.symmetric), []).append(place)
    result: list[PeriodicSums | None] = [None] * len(points)
    for pattern, places in of_pattern.items():
        omega = np.array([points[place].omega for place in places])
        for place, sums in zip(places, periodic_sums(response, pattern, omega), strict=True):
            result[place] = sums
    return result


def _double_grazes(oscillator: Oscillator, varied: VariedStop, start: float, stop: float) -> list[CodimensionTwoPoint]:
    """Return the points at which the other stop is grazed too, without their clearance."""
    symmetric, gap = oscillator.is_half_wave_symmetric, varied.other_gap(oscillator)
    if symmetric if varied.together else math.isinf(gap):
        return []  # the margin does not depend on omega
    coincidences = vanishing_margins(oscillator, varied, start, stop)
    return [_coincidence("double-graze", coincidence, start, stop) for coincidence in coincidences]


def _corners(
    oscillator: Oscillator,
    response: ImpulseResponse,
    varied: VariedStop,
    start: float,
    stop: float,
    max_order: int,
) -> list[CodimensionTwoPoint]:
    """Return the points at which two maxima toward the grazed stop are equal, without their clearance."""
    points = []
    for coincidence in equal_maxima(oscillator, varied.stop, start, stop):
        point = _coincidence("corner", coincidence, start, stop)
        if coincidence.simple:
            before, after = (_recurring(response, coincidence, i, max_order, varied.alike) for i in (0, 1))
            point = replace(point, corner=Corner(*coincidence.phases, *coincidence.slopes, before, after))
        points.append(point)
    return points


def _recurring(response: ImpulseResponse, corner: Coincidence, graze: int, max_order: int, alike: bool) -> int:
    """Return the number of the contact at which an impact first recurs after one of the two grazes of a corner."""
    delays = 2.0 * math.pi - (corner.phases[graze] - np.array(corner.phases)) % (2.0 * math.pi)
    signs = np.ones(2)
    if alike:  # half a period later the motion is at the other stop
        delays = np.append(delays, 2.0 * math.pi - (math.pi - delays) % (2.0 * math.pi))
        signs = np.array([1.0, 1.0, -1.0, -1.0])
    order = np.argsort(delays)
    turns = 2.0 * math.pi * np.arange((max_order + 1) // 2)
    contacts = (turns[:, None] + delays[order]).ravel()
    contacts = contacts[contacts <= max_order * math.pi * (1.0 + END_WIDTH)]
    sides = np.resize(signs[order], len(contacts))
    return int(first_recurrence(response, np.array([corner.omega]), contacts, sides)[0])


def _coincidence(kind: Kind, coincidence: Coincidence, start: float, stop: float) -> CodimensionTwoPoint:
    omega = min(max(coincidence.omega, start), stop)
    status: Status = "simple" if coincidence.simple else "near-double"
    return CodimensionTwoPoint(kind, omega, math.nan, coincidence.residual, status, coincidence.error)


def _recurrences(
    response: ImpulseResponse, start: float, stop: float, max_order: int, varied: VariedStop
) -> list[CodimensionTwoPoint]:
    """Return the recurrence points without their clearance; of stops that are not alike those of even orders."""
    each = varied.half_periods
    orders = range(each, max_order + 1, each)
    factors = [order * math.pi for order in orders]
    zeros = _zeros(response, IMPULSE, factors, start, stop)
    points = []
    for order, factor in zip(orders, factors, strict=True):
        inside = [(omega, zero) for zero in zeros if (omega := _inside(factor / zero.time, start, stop)) is not None]
        families = families_of_order(order) if varied.alike else None
        omegas = np.array([omega for omega, _ in inside])
        smaller = first_recurrence(response, omegas, *varied.returns(order // each - 1))
        for (omega, zero), recurring in zip(inside, smaller.tolist(), strict=True):
            points.append(_point("recurrence", omega, zero, order=order, active=recurring == 0, families=families))
    return points


def _resonances(
    response: ImpulseResponse, start: float, stop: float, max_multiple: int, with_symmetric: bool
) -> list[CodimensionTwoPoint]:
    """Return the resonant points of motions on one stop, and perhaps of symmetric ones, without their clearance."""
    one_sided = [(2.0 * math.pi * multiple, multiple, False) for multiple in range(1, max_multiple + 1)]
    symmetric = [(math.pi * multiple, multiple, True) for multiple in range(1, max_multiple + 1, 2) if with_symmetric]
    names: dict[tuple[int, bool], Bifurcation] = {
        (SAME_SIGN, False): "SN",
        (ALTERNATING, False): "PD",
        (SAME_SIGN, True): "SB",
        (ALTERNATING, True): "SN",
    }
    points = []
    for kind in (SAME_SIGN, ALTERNATING):
        zeros = _zeros(response, kind, [factor for factor, _, _ in one_sided + symmetric], start, stop)
        for factor, multiple, is_symmetric in one_sided + symmetric:
            for zero in zeros:
                omega = _inside(factor / zero.time, start, stop)
                if omega is not None:
                    bifurcation = names[kind, is_symmetric]
                    resonance = {"multiple": multiple, "symmetric": is_symmetric, "bifurcation": bifurcation}
                    points.append(_point("resonant", omega, zero, **resonance))
    return points


def _point(kind: Kind, omega: float, zero: _Zero, **fields: Any) -> CodimensionTwoPoint:
    """Return the point of a zero, with the fields of its kind, without its clearance."""
    return CodimensionTwoPoint(
        kind=kind,
        omega=omega,
        clearance=math.nan,
        residual=zero.residual,
        status=zero.status,
        omega_error=omega * zero.uncertainty / zero.time,
        **fields,
    )


def _inside(omega: float, start: float, stop: float) -> float | None:
    """Return omega, or the end of the interval if it lies outside by rounding only, or None if it lies outside."""
    if start * (1.0 - END_WIDTH) <= omega <= stop * (1.0 + END_WIDTH):
        return min(max(omega, start), stop)
    return None


def _zeros(response: ImpulseResponse, kind: int, factors: list[float], start: float, stop: float) -> list[_Zero]:
    """Return the zeros tau of one function with ``factor/tau`` in ``[start, stop]`` for any of the factors, once."""
    zeros: list[_Zero] = []
    for left, right in united([(factor / stop, factor / start) for factor in factors]):
        times, kinds, status = isolate(
            kind,
            response.blocks,
            response.conditioning,
            response.slowest,
            left * (1.0 - END_WIDTH),
            right * (1.0 + END_WIDTH),
        )
        if status == TOO_MANY_CELLS:
            raise ParameterError(
                "omega", "the interval holds too many zeros to search; raise start, or lower max_order or max_multiple"
            )
        if not len(times):
            continue
        if not np.all(times[:, 0] > 0.0):
            raise ConditioningError(_HIDDEN)
        value, _, _, terms = evaluate(response, times[:, 0], kind, shift=response.slowest)
        residuals = np.abs(value) / terms
        zeros += [
            _Zero(float(time), float(width), "near-double" if what == NEAR_DOUBLE else "simple", float(residual))
            for (time, width), what, residual in zip(times, kinds, residuals, strict=True)
        ]
    return zeros
