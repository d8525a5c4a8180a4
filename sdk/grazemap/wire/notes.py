"""Notes on requests that are allowed: what is probably not meant, as hertz for rad/s, and what a forcing period is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from grazemap.later import Later
from grazemap.wire.base import Interval, Range, Request
from grazemap.wire.job import Note
from grazemap.wire.linear import antiresonances, grazing_clearance, matrices, steady_amplitude
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.planes import AXES, Axis, OneParameterRequest, PlanePoint, PlaneRequest, WindowAxis
from grazemap.wire.process import ProcessRequest
from grazemap.wire.slips import Asked, is_likely, sizes_of, slips_in
from grazemap.wire.structure import SIDES, ClearancePair, StopName, as_pair
from grazemap.wire.structures import StructuresRequest

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

GOES_ON = "goes-on"
"""Code of the note on a job that is not stopped because others asked for it too."""
OTHER_MOTIONS = "other-motions"
"""The code of the note of a result at a point that other stable motions were seen."""
OTHER_MOTIONS_IN_MAP = "other-motions-in-map"
"""The code of that note of a map."""

Span = tuple[float, float]
# Frequencies at which the grazing curve is looked at, besides the natural ones; and that of a machine that is no chain
# with mass 1 between equal stops, where only the highest place of the curve counts.
_SAMPLES, _FEWER_SAMPLES = 257, 65
# The ratio of two values up to which they are not the ends of a range.
_APART = 1.02
# Stiffnesses, and natural frequencies, from which numbers are hardly nondimensional: these are of the order of 1.
_STIFF, _FAST = 100.0, 10.0
# The same where only the units of the result are missing.
_STIFFER = 1000.0
# Links damp high modes more than low ones: some do not oscillate in a machine whose lowest ratio is below this one.
_STRONG = 0.4
# What an oscillator in SI may leave out, as the paper's example has no units.
_SELDOM_MEANT = ("masses", "stiffnesses", "forcing", "restitution")
# The most equal dampers that a note lists.
_LISTED = 3
# The damping ratio for which a note says gamma.
_EXAMPLE = 0.02


def notes_on(request: ProcessRequest) -> list[Note]:
    """Return what is probably not meant in a request that is allowed."""
    notes = [*_lists(request), *_other_units(request), *_period(request)]
    omega, clearance = _span(request, "omega"), _span(request, "clearance")
    if omega is None or _moves_the_curve(request):
        return notes
    if clearance is not None and request.oscillator.beyond_the_chain() is None:
        notes += _window(request, omega, clearance)
    else:
        notes += _window_of_stops(request, omega, _stops(request))
    return notes


def _moves_the_curve(request: ProcessRequest) -> bool:
    """Return whether a parameter varies, other than omega, that changes the steady motion."""
    return not all(name == "omega" or name.startswith(("clearance", "restitution")) for name in _axes(request))


def unstated(request: ProcessRequest) -> list[Note]:
    """Return a note on each default that is seldom meant, in a request as a caller wrote it.

    A job's request has every default filled in, so neither a stored job nor a result has these notes: they are in the
    answer to the POST of the request.
    """
    oscillator = request.oscillator
    if oscillator.units != "SI":
        return [] if "units" in oscillator.model_fields_set else [*_units(request)]
    needless: set[str] = {"forcing"} if oscillator.base is not None else set()
    if oscillator.matrices is not None:
        needless = {"masses", "stiffnesses", "forcing"}
    return [
        Note(
            code=f"default-{name}",
            detail=f"{name} is not given, and its default {_text(getattr(oscillator, name))} is used: give the "
            f"oscillator its {name}, also where that is meant",
        )
        for name in _SELDOM_MEANT
        if name not in oscillator.model_fields_set | needless
    ]


def _text(value: float | list[float]) -> str:
    return f"[{', '.join(f'{number:g}' for number in value)}]" if isinstance(value, list) else f"{value:g}"


def _units(request: ProcessRequest) -> Iterator[Note]:
    """Look for a machine in SI of which the units were not given."""
    oscillator = request.oscillator
    stiffest, fastest = float(np.max(matrices(oscillator)[2])), float(oscillator.natural_frequencies[-1])
    if not (stiffest >= _STIFF and fastest >= _FAST):
        return
    means = "results have no units, and numbers are not compared with those of machines"
    if oscillator.matrices is None and isinstance(oscillator.damping, list):
        means = "a list of dampings then has ratios, each link's coefficient being twice its number, not N s/m"
    elif oscillator.matrices is None and "damping" not in oscillator.model_fields_set:
        means = f"damping, which is not given, then has its default {oscillator.damping:g}"
    elif stiffest < _STIFFER or not is_likely(_asked(request)):
        return
    detail = (
        f"units are not given, so that numbers are nondimensional: {means}. Stiffnesses up to {stiffest:.4g} and "
        f'natural frequencies up to {fastest:.4g} look like SI: give the oscillator units "SI", or "nondimensional" '
        "where that is meant"
    )
    yield Note(code="units-left-out", detail=detail)


def _axes(request: Request) -> dict[str, Range | Interval | list[float]]:
    """Return the parameters that vary in a request, with their values."""
    axes = (getattr(request, name, None) for name in ("axis", *AXES))
    return {axis.vary: axis.values for axis in axes if isinstance(axis, Axis | WindowAxis)}


def _values(request: Request, name: str) -> object:
    varied = _axes(request).get(name)
    return getattr(request, name, None) if varied is None else varied


def _span(request: Request, name: str) -> Span | None:
    """Return the least and the largest value of a parameter of a request; None if it has none."""
    values = _values(request, name)
    if isinstance(values, Interval):
        return values.start, values.stop
    if isinstance(values, list) and values:
        return min(values), max(values)
    return (values, values) if isinstance(values, float | int) else None


def _lists(request: ProcessRequest) -> Iterator[Note]:
    if isinstance(request, StructuresRequest):  # few frequencies are what one asks for
        return
    for name in ("omega", "clearance"):
        values = _values(request, name)
        if not isinstance(values, list):
            continue
        instead = f'for a range, {{"start": .., "stop": .., "points": ..}}; in Python ({values[0]:g}, {values[1]:g})'
        if len(values) == 2 and values[1] > _APART * values[0]:
            yield Note(code="two-values", detail=f"{name} has two values, {values[0]:g} and {values[1]:g}; {instead}")
        elif len(values) == 3 and values[2].is_integer() and values[2] > 10.0 * values[1]:
            detail = f"{name} has three values, the last one {values[2]:g}; {instead} and a number of points"
            yield Note(code="points-among-values", detail=detail)


def _damping(oscillator: Oscillator, is_ratio: bool) -> Iterator[Note]:
    """Say what a damping is, where modes of a chain do not oscillate, or where it was probably meant as a ratio."""
    if oscillator.matrices is not None or not np.any(oscillator.damping):
        return
    ratios, first = oscillator.damping_ratios, float(oscillator.natural_frequencies[0])
    if not first > 0.0:  # it is hidden by the rounding of the others
        return
    given = np.max(oscillator.damping)
    if isinstance(oscillator.damping, list):
        what = "a list of dampings has coefficients in N s/m"
    else:
        dampers = ", ".join([f"{given:.4g}"] * min(len(ratios), _LISTED) + ["..."] * (len(ratios) > _LISTED))
        what = f"a number is gamma in s, and dampers of {given:.4g} N s/m are the list [{dampers}]"
    gamma = (
        f"for a ratio of {_EXAMPLE:g} in the first mode give {_EXAMPLE:g}/omega_1, the number {_EXAMPLE / first:.4g}"
    )
    # NaN stands for a mode that does not oscillate, or for a ratio hidden by one that does not
    strong = int(np.count_nonzero(~(ratios < 1.0)))
    if strong and not ratios[0] < _STRONG:
        known = ratios[np.isfinite(ratios)]
        largest = f", with damping ratios of up to {known.max():.4g}" if len(known) == len(ratios) else ""
        detail = f"{strong} of {len(ratios)} modes do not oscillate{largest}: {what}; {gamma}"
        yield Note(code="strong-damping", detail=detail)
    elif is_ratio:
        meant = f"the damping ratio of the first mode is {ratios[0]:.2g}, and {given:.2g} was probably meant as it"
        code = "weak-damping" if ratios[0] < given else "strong-damping"
        yield Note(code=code, detail=f"{meant}: {what}; {gamma}")


def _period(request: ProcessRequest) -> Iterator[Note]:
    """Say what a period is where it is not 2 pi/omega."""
    divisor = request.oscillator.common_divisor
    if divisor == 1 or isinstance(request, StructuresRequest):
        return
    yield Note(
        code="forcing-period",
        detail=f"every harmonic of the forces is a multiple of {divisor}: periods, labels and exponents count their "
        f"period T = 2 pi/({divisor} omega); phases are omega t, modulo 2 pi/{divisor}",
    )


def _window(request: ProcessRequest, omega: Span, clearance: Span) -> Iterator[Note]:
    """Compare a window of clearances with the grazing curve."""
    oscillator = request.oscillator
    special = [oscillator.natural_frequencies, antiresonances(oscillator)]
    frequencies = np.concatenate([np.linspace(*omega, _SAMPLES), *special])
    frequencies = frequencies[(frequencies >= omega[0]) & (frequencies <= omega[1])]
    amplitude = steady_amplitude(oscillator, frequencies)
    low, high = float(amplitude.min()), float(amplitude.max())
    if not np.isfinite(high) or high == 0.0:
        return
    unit = " m" if oscillator.units == "SI" else ""
    if clearance[1] <= _APART * clearance[0] and omega[1] <= _APART * omega[0]:
        return  # a point, not a window
    where = f"which lies between {low:.4g} and {high:.4g}{unit} at {len(frequencies)} frequencies there"
    if omega[0] == omega[1]:
        where = f"which is at {low:.4g}{unit} at this frequency"
    if clearance[0] > high:
        detail = f"every clearance is above the grazing curve, {where}: the steady motion does not reach the stops"
        yield Note(code="above-grazing-curve", detail=detail)
    elif clearance[1] < low:
        detail = f"every clearance is below the grazing curve, {where}: the steady motion would pass the stops"
        yield Note(code="below-grazing-curve", detail=detail)


def _stops(request: ProcessRequest) -> dict[StopName, Span]:
    """Return the least and the largest clearance of each stop in a window; none of other requests."""
    if not isinstance(request, OneParameterRequest | PlaneRequest):
        return {}
    both, fixed = _span(request, "clearance"), request.clearance
    stops = {}
    for side in SIDES:
        distance = fixed.side(side) if isinstance(fixed, ClearancePair) else None
        span = both or _span(request, f"clearance_{side}") or (None if distance is None else (distance, distance))
        if span is not None:
            stops[side] = span
    return stops


def _window_of_stops(request: ProcessRequest, omega: Span, stops: dict[StopName, Span]) -> Iterator[Note]:
    """Compare a window of clearances of any machine with the grazing clearance of each stop."""
    oscillator = request.oscillator
    if not stops or all(high <= _APART * low for low, high in (omega, *stops.values())):
        return  # a point, not a window
    natural = [oscillator.natural_frequencies / order for order in oscillator.orders]
    if not natural:
        return  # nothing moves
    frequencies = np.concatenate([np.linspace(*omega, _FEWER_SAMPLES), *natural])
    frequencies = np.unique(frequencies[(frequencies >= omega[0]) & (frequencies <= omega[1])])
    highest = {side: float(grazing_clearance(oscillator, frequencies, side).max()) for side in stops}
    if not all(nearest > highest[side] for side, (nearest, _) in stops.items()):
        return
    unit = " m" if oscillator.units == "SI" else ""
    heights = [f"{height:.4g}{unit} at the {side} stop" for side, height in highest.items()]
    if len({f"{height:.4g}" for height in highest.values()}) == 1:
        heights = [heights[0].partition(" at ")[0]]
    where = "this frequency" if omega[0] == omega[1] else f"{len(frequencies)} frequencies there"
    detail = (
        f"every clearance is above the grazing curve, which goes up to {' and to '.join(heights)} at {where}: the "
        "steady motion does not reach the stops"
    )
    yield Note(code="above-grazing-curve", detail=detail)


def _other_units(request: ProcessRequest) -> Iterator[Note]:
    """Look for numbers in SI that were meant in another unit; a damping that is unlikely by itself is said, too."""
    if request.oscillator.units != "SI":
        return
    asked = _asked(request)
    slips = slips_in(asked)
    for slip in slips:
        if slip.remedy:
            yield Note(code=slip.code, detail=f"{sizes_of(asked)}: {slip.remedy}")
    if not slips or any("damping" in slip.code for slip in slips):
        yield from _damping(request.oscillator, any(not slip.remedy for slip in slips))


def _asked(request: ProcessRequest) -> Asked:
    """Return what a request says about its machine."""
    nearest = [near for point in _corners(request) if (near := _nearest_stop(point.clearance)) is not None]
    stops = (min(nearest), max(nearest)) if nearest else None
    # without forces a frequency is the unit of time alone
    omega = _span(getattr(request, "statement", request), "omega") if request.oscillator.orders else None
    return Asked(request.oscillator, omega, stops)


def _corners(request: ProcessRequest) -> list[PlanePoint]:
    """Return the machine, the frequency and the clearances at the ends of what varies; none without a clearance."""
    varied = getattr(request, "varied", None)
    if varied is not None:
        corners: list[PlanePoint] = varied.corners()
        return corners
    asked = getattr(request, "statement", request)
    clearance, omega = getattr(asked, "clearance", None), _span(asked, "omega")
    if clearance is None or omega is None:
        return []
    return [PlanePoint(request.oscillator, end, as_pair(clearance)) for end in {*omega}]


def _nearest_stop(clearance: ClearancePair) -> float | None:
    """Return the least distance of a stop; None without any but stops at 0, where a unit makes no difference."""
    return min((abs(stop) for stop in (clearance.right, clearance.left) if stop), default=None)
