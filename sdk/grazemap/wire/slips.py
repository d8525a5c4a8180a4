"""Numbers in SI that were probably meant in other units.

The numbers of a request fit together: the frequencies asked for lie near natural ones, modes are damped by some per
cent, the stops are of the order of the amplitude, and the contact moves as machines do. How usual its sizes are makes a
request more or less likely. Each slip is undone in turn, and told where that makes the request much likelier.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from grazemap.later import Later
from grazemap.wire.linear import contact_equilibrium, grazing_clearance, matrices
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.structure import SIDES, Forcing, ModalDamping

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

Span = tuple[float, float]

# For each size, in decades: the range in which most machines have it, and the standard deviation outside of it.
_SIZES: dict[str, tuple[float, float, float]] = {
    # a band of frequencies over a natural frequency; over the highest one if it is above it: up to twice
    "place": (-0.1, 0.1, 0.15),
    "above": (0.0, 0.3, 0.2),
    # damping ratio of the lowest mode: from a metal part to a bolted structure
    "damping": (-2.5, -1.3, 0.4),
    # the largest damping ratio: a model leaves out what does not oscillate
    "strongest": (-math.inf, -0.3, 0.2),
    # nearest stop over how far the contact goes without it: impacts are asked about, and some are hard
    "stop": (-1.3, 0.0, 0.7),
    # metres: from a fit of 30 micrometres to a gap of 30 mm
    "clearance": (-4.5, -1.5, 0.8),
    # metres up to 30 mm, and m/s^2 from a tenth of the earth's to a hundred times it
    "amplitude": (-4.0, -1.5, 0.8),
    "acceleration": (0.0, 3.0, 0.7),
    # m/s^2 of a base: from a smooth road to three times the earth's
    "shaking": (-0.5, 1.5, 0.4),
    # m/s of an eccentric mass about its axis: from 0.1 to 30 mm/s, the grades of balance of most rotors
    "unbalance": (-4.0, -1.5, 0.4),
}
# The share of requests in which a size is any.
_ODD = math.exp(-5.0)
# One of so many requests is about frequencies above all resonances: few machines run there.
_ABOVE = 5.0
# The slowest mode is asked about so much less often than the one in which the contact is fastest.
_SLOWEST = 0.1
# What it costs that springs that are unlike have dampers that are alike; damping ratios often are.
_COINCIDENCE = 2.5
# A slip is told that makes a request seven times likelier where it is undone, and not twenty times less likely than the
# best one does; at most so many.
_LIKELIER, _AS_GOOD, _TOLD = math.log(7.0), math.log(20.0), 3
# Where a request costs more, its numbers are hardly in SI.
_UNLIKELY = 4.0
_MILLI = 1e3
# Requests may have sizes of any kind, whose products round to 0.
_SMALLEST = 1e-300
# Frequencies between the ends of a band at which the steady motion is looked at.
_SAMPLES = 5
# Impacts at two stops, or at one where the mass rests, raise a resonance up to so many times its frequency.
_RAISED = 2.0
# The share of the largest amplitude below which the contact does not see a mode.
_SEEN = 1e-3
# A square of a natural frequency below this share of the largest one is that of a free mode.
_FREE = 1e-12


class Asked(NamedTuple):
    """What a request says about one machine in SI."""

    oscillator: Oscillator
    """The machine."""
    omega: Span | None
    """The frequencies asked for."""
    stops: Span | None
    """The least distance of a stop, at the ends of what varies; None without a stop but at 0."""

    def with_(self, **changes: Any) -> Asked:
        """Return the same request about a changed machine."""
        return self._replace(oscillator=self.oscillator.model_copy(update=changes))


class Slip(NamedTuple):
    """A quantity that was meant in another unit; without a remedy, it was meant as a ratio of the damping."""

    code: str
    """The code of its note."""
    remedy: str
    """What to do about it."""
    undone: Callable[[Asked], Asked | None]
    """Returns the request as it was meant; None where it has no such quantity."""


class _Motion(NamedTuple):
    """How the contact moves without a stop."""

    band: Span
    """The frequencies."""
    natural: Any
    """The natural frequencies of the modes that it sees, increasing."""
    speeds: Any
    """How fast it is at each of them."""
    steady: float
    """How far it goes in the band, from the equilibrium."""
    farthest: float
    """The same from where no spring is stretched."""
    raised: float
    """The same at the resonances, too, that impacts may raise into the band."""


def is_likely(asked: Asked) -> bool:
    """Return whether a machine in SI has such numbers."""
    return _cost(asked) < _UNLIKELY


def slips_in(asked: Asked) -> list[Slip]:
    """Return the slips that explain the numbers of a request, the best one first, and those that are as good."""
    most = _cost(asked) - _LIKELIER
    if most <= 0.0:
        return []
    left = [(_cost_of_undone(slip, asked), slip) for slip in SLIPS]
    explained = sorted((pair for pair in left if pair[0] < most), key=lambda pair: pair[0])
    return [slip for cost, slip in explained if cost < explained[0][0] + _AS_GOOD][:_TOLD]


def sizes_of(asked: Asked) -> str:
    """Return in words what the numbers of a request say about its machine."""
    natural, ratios = _seen_modes(asked.oscillator)
    words = []
    if len(natural):
        span = f"{natural[0]:.4g}" if len(natural) == 1 else f"{natural[0]:.4g} to {natural[-1]:.4g}"
        words.append(f"natural frequencies are {span} rad/s and the lowest damping ratio is {ratios[0]:.2g}")
    if asked.omega is not None and math.isfinite(
        moved := _motion(asked.oscillator, asked.omega, natural, ratios).steady
    ):
        low, high = asked.omega
        where = f"at {low:.4g} rad/s" if low == high else f"from {low:.4g} to {high:.4g} rad/s"
        words.append(f"the steady motion goes at most {moved:.3g} m {where}")
    if asked.stops is not None:
        words.append(f"the nearest stop is {asked.stops[0]:.4g} m away")
    return ", ".join(words)


def _cost(asked: Asked) -> float:
    """Return how unlikely a request is: the negative logarithm of a product over its sizes."""
    natural, ratios = _seen_modes(asked.oscillator)
    motion = None if asked.omega is None else _motion(asked.oscillator, asked.omega, natural, ratios)
    cost = sum(_unusual(name, span) for name, span in _sizes(asked, ratios, motion))
    cost += _COINCIDENCE if _has_dampers_alike(asked.oscillator) else 0.0
    return cost if motion is None or not len(natural) else cost + _cost_of_place(motion)


def _cost_of_undone(slip: Slip, asked: Asked) -> float:
    """Return the cost of a request as it was meant; infinite where it is none, or has numbers that no request has."""
    try:
        meant = slip.undone(asked)
        return math.inf if meant is None else _cost(meant)
    except ValidationError:
        return math.inf


def _unusual(name: str, span: Span) -> float:
    """Return how unlikely the likeliest size in an interval is, 0 for a usual one."""
    least, most, deviation = _SIZES[name]
    outside = max(least - span[1], span[0] - most, 0.0) / deviation
    return -math.log((math.exp(-0.5 * outside**2) + _ODD) / (1.0 + _ODD))


def _cost_of_place(motion: _Motion) -> float:
    """Return how unlikely a band is: near a resonance, the likelier the faster the contact is there; or above all.

    The speed counts, not the amplitude: impacts are as hard as the contact is fast.
    """
    places = [_place(motion.band, mode) for mode in motion.natural]
    shares = np.maximum(motion.speeds / motion.speeds.max(), _SLOWEST)
    costs = [_unusual("place", (place, place)) for place in places] - np.log(shares)
    above = _unusual("above", (places[-1], places[-1])) + math.log(_ABOVE) if places[-1] > 0.0 else math.inf
    return min(float(costs.min()), above)


def _has_dampers_alike(oscillator: Oscillator) -> bool:
    """Return whether the springs of a chain are unlike, and its dampers alike."""
    if oscillator.matrices is not None or not isinstance(oscillator.damping, list) or not oscillator.damping[0]:
        return False
    return len({*oscillator.damping}) == 1 < len({*oscillator.stiffnesses})


def _motion(oscillator: Oscillator, band: Span, natural: Any, ratios: Any) -> _Motion:
    """Return how the contact moves in a band."""
    low, high = band
    frequencies = np.concatenate([np.linspace(low, high, _SAMPLES), natural])
    reached = np.max([grazing_clearance(oscillator, frequencies, stop) for stop in SIDES], axis=0)
    if not np.any(ratios > 0.0):  # a resonance without damping has no size but round-off
        reached[_SAMPLES:] = math.inf
    still = abs(contact_equilibrium(oscillator))
    speeds = natural * (reached[_SAMPLES:] - still)
    if not (np.all(np.isfinite(speeds)) and np.any(speeds > 0.0)):
        speeds = np.ones(len(natural))
    farthest = float(reached[(frequencies >= low) & (frequencies <= high)].max())
    raised = float(reached[(frequencies >= low / _RAISED) & (frequencies <= high)].max())
    return _Motion(band, natural, speeds, farthest - still, farthest, raised)


def _sizes(asked: Asked, ratios: Any, motion: _Motion | None) -> Iterator[tuple[str, Span]]:
    """Yield the sizes that a request has, in decades, from the least to the largest value."""
    if np.any(ratios > 0.0):
        yield "damping", _decades(ratios[0], ratios[0])
        yield "strongest", _decades(ratios.max(), ratios.max())
    if motion is None:
        return
    yield from _driven(asked.oscillator, motion.band)
    if not (math.isfinite(motion.steady) and motion.steady > 0.0):
        return
    moved = _decade(motion.steady)
    yield "amplitude", (moved, moved)
    low, high = _decades(*motion.band)
    yield "acceleration", (moved + 2.0 * low, moved + 2.0 * high)
    if asked.stops is not None:
        # a motion that starts elsewhere may go as far as at a resonance
        nearest, last = _decades(*asked.stops)
        yield "clearance", (nearest, last)
        yield "stop", (nearest - _decade(motion.raised), last - _decade(motion.farthest))


def _driven(oscillator: Oscillator, band: Span) -> Iterator[tuple[str, Span]]:
    """Yield how a base or an unbalance moves at the ends of a band."""
    if oscillator.base is not None and oscillator.base.amplitude:
        yield "shaking", _decades(*(abs(oscillator.base.amplitude) * omega**2 for omega in band))
    masses = np.diag(matrices(oscillator)[0])
    for force in oscillator.harmonics:
        eccentricity = float(np.max(np.abs(force.amplitude) / masses))
        if force.law == "unbalance" and eccentricity:
            yield "unbalance", _decades(*(eccentricity * force.harmonic * omega for omega in band))


def _decade(size: float) -> float:
    """Return the logarithm of a size; what is too small for a number has none but the smallest one."""
    return math.log10(max(size, _SMALLEST))


def _decades(low: float, high: float) -> Span:
    return _decade(low), _decade(high)


def _place(band: Span, natural: float) -> float:
    """Return how far the middle of a band is from a natural frequency, 0 if the band contains it."""
    low, high = (_decade(omega) - _decade(natural) for omega in band)
    return 0.0 if low <= 0.0 <= high else 0.5 * (low + high)


def _seen_modes(oscillator: Oscillator) -> tuple[Any, Any]:
    """Return the natural frequencies of the modes that the contact sees, increasing, and their damping ratios."""
    mass, damping, stiffness = matrices(oscillator)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    inner = inverse @ stiffness @ inverse.T
    squares, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
    modes = inverse.T @ vectors
    shares = np.abs(np.array(oscillator.contact_row) @ modes)
    seen = (shares > _SEEN * shares.max()) & (squares > _FREE * squares.max())
    frequencies = np.sqrt(squares[seen])
    rates = 0.5 * np.einsum("ij,ik,kj->j", modes[:, seen], damping, modes[:, seen])
    return frequencies, rates / frequencies


def _times(factor: float, values: Any) -> Any:
    """Return a number, or lists of numbers, multiplied by a factor."""
    return [_times(factor, value) for value in values] if isinstance(values, list) else factor * values


def _of_structure(chain: str, matrix: str, factor: float) -> Callable[[Asked], Asked | None]:
    """Return what multiplies the masses, stiffnesses or dampings of a machine."""

    def undone(asked: Asked) -> Asked | None:
        given = asked.oscillator.matrices
        values = getattr(asked.oscillator, chain) if given is None else getattr(given, matrix)
        if not isinstance(values, list):
            return None
        if given is None:
            return asked.with_(**{chain: _times(factor, values)})
        return asked.with_(matrices=given.model_copy(update={matrix: _times(factor, values)}))

    return undone


def _of_band(factor: float) -> Callable[[Asked], Asked | None]:
    def undone(asked: Asked) -> Asked | None:
        band = asked.omega
        return None if band is None else asked._replace(omega=(factor * band[0], factor * band[1]))

    return undone


def _of_stops(factor: float) -> Callable[[Asked], Asked | None]:
    def undone(asked: Asked) -> Asked | None:
        stops = asked.stops
        return None if stops is None else asked._replace(stops=(factor * stops[0], factor * stops[1]))

    return undone


def _of_forces(law: str, factor: float) -> Callable[[Asked], Asked | None]:
    """Return what multiplies the forces of a law; None where a base moves the machine, or forces have another law."""

    def undone(asked: Asked) -> Asked | None:
        oscillator = asked.oscillator
        harmonics = oscillator.harmonics
        laws = {force.law for force in harmonics} or {"constant"}
        if laws != {law} or not oscillator.orders or oscillator.base is not None:
            return None
        if not harmonics:
            return asked.with_(forcing=_times(factor, oscillator.forcing))
        return asked.with_(forcing=[_with_amplitude(force, factor) for force in harmonics])

    return undone


def _with_amplitude(force: Forcing, factor: float) -> Forcing:
    return force.model_copy(update={"amplitude": _times(factor, force.amplitude)})


def _of_base(factor: float) -> Callable[[Asked], Asked | None]:
    def undone(asked: Asked) -> Asked | None:
        base = asked.oscillator.base
        return (
            None if base is None else asked.with_(base=base.model_copy(update={"amplitude": factor * base.amplitude}))
        )

    return undone


def _of_modal_ratios(asked: Asked) -> Asked | None:
    given = asked.oscillator.matrices
    if given is None or not isinstance(given.damping, ModalDamping):
        return None
    ratios = ModalDamping.model_construct(modal=_times(0.01, given.damping.modal))
    return asked.with_(matrices=given.model_copy(update={"damping": ratios}))


def _of_ratio(asked: Asked) -> Asked | None:
    """Return a chain whose dampings were meant as ratios: each of its link, or one of the first mode."""
    oscillator = asked.oscillator
    if oscillator.matrices is not None or not 0.0 < np.max(oscillator.damping) < 1.0:
        return None
    natural = _seen_modes(oscillator)[0]
    if not isinstance(oscillator.damping, list):
        return asked.with_(damping=oscillator.damping / float(natural[0])) if len(natural) else None
    links = zip(oscillator.damping, oscillator.masses, oscillator.stiffnesses, strict=True)
    return asked.with_(damping=[2.0 * ratio * math.sqrt(mass * stiffness) for ratio, mass, stiffness in links])


SLIPS = (
    Slip("clearances-in-millimetres", "divide by 1000 if clearance was meant in millimetres", _of_stops(1.0 / _MILLI)),
    Slip("frequencies-in-hertz", "multiply by 2 pi if omega was meant in hertz", _of_band(2.0 * math.pi)),
    Slip("frequencies-in-rpm", "multiply by pi/30 if omega was meant in rpm", _of_band(math.pi / 30.0)),
    Slip(
        "stiffnesses-in-newtons-per-millimetre",
        "multiply by 1000 if stiffnesses were meant in N/mm",
        _of_structure("stiffnesses", "stiffness", _MILLI),
    ),
    Slip(
        "masses-in-grams",
        "divide by 1000 if masses were meant in grams",
        _of_structure("masses", "mass", 1.0 / _MILLI),
    ),
    Slip(
        "damping-in-newton-seconds-per-millimetre",
        "multiply by 1000 if damping was meant in N s/mm",
        _of_structure("damping", "damping", _MILLI),
    ),
    Slip("weak-damping", "", _of_ratio),
    Slip("damping-in-per-cent", "divide by 100 if the damping ratios were meant in per cent", _of_modal_ratios),
    Slip(
        "unbalance-in-kilogram-millimetres",
        "divide by 1000 if the unbalance was meant in kg mm",
        _of_forces("unbalance", 1.0 / _MILLI),
    ),
    Slip(
        "unbalance-in-gram-millimetres",
        "divide by 1000000 if the unbalance was meant in g mm",
        _of_forces("unbalance", _MILLI**-2),
    ),
    Slip(
        "base-in-millimetres",
        "divide by 1000 if the amplitude of the base was meant in millimetres",
        _of_base(1.0 / _MILLI),
    ),
    Slip("forces-in-kilonewtons", "multiply by 1000 if the forces were meant in kN", _of_forces("constant", _MILLI)),
)
