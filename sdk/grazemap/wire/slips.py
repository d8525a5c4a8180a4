"""Numbers in SI that were probably meant in other units.

The numbers of a request fit together: the frequencies asked for lie near natural ones, modes are damped by some per
cent, the stops are of the order of the amplitude, and the contact moves as machines do. Each of these sizes has a range
in which machines have it, and a request costs what its sizes are outside of their ranges. Where that is much, each slip
is undone in turn: numbers that then cost little were probably meant in the other unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from grazemap.later import Later
from grazemap.wire.linear import contact_equilibrium, grazing_clearance, matrices, resonant_amplitude
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.structure import SIDES, Forcing, ModalDamping

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")

Span = tuple[float, float]

# For each size, in decades: the range in which machines have it, and how far outside of it one is as unlikely as the
# slip of a unit.
_SIZES: dict[str, tuple[float, float, float]] = {
    # a band of frequencies over the natural frequency that is nearest to it
    "place": (-0.4, 0.35, 0.1),
    # damping ratio of the lowest mode: a thousandth to four tenths
    "damping": (-3.0, -0.4, 0.25),
    # nearest stop over how far the steady motion goes, and over the geometric mean of that and a resonance
    "near": (-2.7, math.inf, 0.3),
    "far": (-math.inf, 0.7, 0.3),
    # how far the steady motion goes over how far constant forces would move the contact
    "gain": (-0.8, math.inf, 0.2),
    # metres: a tenth of a micrometre to ten metres, near a resonance
    "amplitude": (-7.0, 1.0, 0.35),
    # m/s^2: a thousandth of the earth's to a thousand times it
    "acceleration": (-2.0, 4.0, 0.5),
    # m/s^2 of a base: up to ten times the earth's
    "shaking": (-4.0, 2.0, 0.3),
    # m/s of an eccentric mass about its axis: the grade of its balance, of which the worst engines have 4 m/s
    "unbalance": (-7.0, -0.5, 0.3),
}
# What a request must cost before a slip is looked for, what a slip must save, what it may leave, and how much more
# another one may leave.
_SUSPICIOUS, _SAVED, _EXPLAINED, _AS_GOOD = 1.3, 1.1, 1.0, 0.5
# Of so many slips that are as good, each is told.
_TOLD = 3
_MILLI = 1e3
# Requests may have sizes of any kind, whose products round to 0.
_SMALLEST = 1e-300
# Frequencies between the ends of a band at which the steady motion is looked at.
_SAMPLES = 5
# A stop at less than so many times what the steady motion reaches may be met.
_WITHIN_REACH = 2.0
# A band above the resonances counts as so much less far from them where a stop there may be met, or none is known.
_KNOWN = 0.75
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


def is_likely(asked: Asked) -> bool:
    """Return whether a machine in SI has such numbers."""
    return _cost(asked) < _SUSPICIOUS


def slips_in(asked: Asked) -> list[Slip]:
    """Return the slips that explain the numbers of a request, the best one first, and those that are as good."""
    cost = _cost(asked)
    if cost < _SUSPICIOUS:
        return []
    left = [(_cost_of_undone(slip, asked), slip) for slip in SLIPS]
    explained = sorted((pair for pair in left if pair[0] < min(cost - _SAVED, _EXPLAINED)), key=lambda pair: pair[0])
    return [slip for cost, slip in explained if cost <= explained[0][0] + _AS_GOOD][:_TOLD]


def sizes_of(asked: Asked) -> str:
    """Return in words what the numbers of a request say about its machine."""
    natural, ratios = _seen_modes(asked.oscillator)
    words = []
    if len(natural):
        span = f"{natural[0]:.4g}" if len(natural) == 1 else f"{natural[0]:.4g} to {natural[-1]:.4g}"
        words.append(f"natural frequencies are {span} rad/s and the lowest damping ratio is {ratios[0]:.2g}")
    sizes = dict(_sizes(asked))
    if asked.omega is not None and "amplitude" in sizes:
        low, high = asked.omega
        where = f"at {low:.4g} rad/s" if low == high else f"from {low:.4g} to {high:.4g} rad/s"
        words.append(f"the steady motion goes at most {10 ** sizes['amplitude'][0]:.3g} m {where}")
    if asked.stops is not None:
        words.append(f"the nearest stop is {asked.stops[0]:.4g} m away")
    return ", ".join(words)


def _cost(asked: Asked) -> float:
    """Return what the sizes of a request are outside of their ranges, squared and summed."""
    return sum(_outside(name, low, high) ** 2 for name, (low, high) in _sizes(asked))


def _cost_of_undone(slip: Slip, asked: Asked) -> float:
    """Return the cost of a request as it was meant; infinite where it is none, or has numbers that no request has."""
    try:
        meant = slip.undone(asked)
        return math.inf if meant is None else _cost(meant)
    except ValidationError:
        return math.inf


def _outside(name: str, low: float, high: float) -> float:
    """Return how far an interval of a size is outside of its range, in the scale of that size."""
    least, most, scale = _SIZES[name]
    return max(least - high, low - most, 0.0) / scale


def _sizes(asked: Asked) -> Iterator[tuple[str, Span]]:
    """Yield the sizes that a request has, in decades, from the least to the largest value."""
    oscillator, band = asked.oscillator, asked.omega
    natural, ratios = _seen_modes(oscillator)
    if len(ratios) and ratios[0] > 0.0:
        yield "damping", _decades(ratios[0], ratios[0])
    if band is None:
        return
    yield from _driven(oscillator, band)
    within = natural[(natural > band[0]) & (natural < band[1])]
    frequencies = np.unique(np.concatenate([np.linspace(*band, _SAMPLES), within]))
    farthest = max(float(grazing_clearance(oscillator, frequencies, stop).max()) for stop in SIDES)
    moved = farthest - abs(contact_equilibrium(oscillator))
    # who knows a stop within reach knows the machine far above its resonances
    met = asked.stops is not None and asked.stops[0] < _WITHIN_REACH * farthest
    if len(natural):
        place = min((_place(band, float(mode)) for mode in natural), key=abs)
        place *= _KNOWN if (met or asked.stops is None) and place > 0.0 else 1.0
        yield "place", (place, place)
    endless = len(within) > 0 and not np.any(ratios > 0.0)  # a resonance without damping has no size
    if endless or not (math.isfinite(farthest) and moved > 0.0):
        return
    yield "amplitude", _decades(moved, moved)
    still = _amplitude_of_constant_forces(oscillator)
    if still > 0.0 and not met:
        gain = _decade(moved) - _decade(still)
        yield "gain", (gain, gain)
    low, high = _decades(*band)
    yield "acceleration", (_decade(moved) + 2.0 * low, _decade(moved) + 2.0 * high)
    if asked.stops is not None:
        # a motion that starts elsewhere may meet a stop that the steady motion meets at a resonance only
        resonant = abs(contact_equilibrium(oscillator)) + resonant_amplitude(oscillator) if len(ratios) else 0.0
        there = _decade(farthest)
        reach = 0.5 * (there + _decade(max(farthest, resonant))) if math.isfinite(resonant) else there
        nearest, last = _decades(*asked.stops)
        yield "near", (nearest - there, last - there)
        yield "far", (nearest - reach, last - reach)


def _amplitude_of_constant_forces(oscillator: Oscillator) -> float:
    """Return how far the forces, held still, move the contact; 0 where a base or an unbalance drives it."""
    if oscillator.base is not None or any(force.law != "constant" for force in oscillator.harmonics):
        return 0.0
    forces = [np.array(force.amplitude) for force in oscillator.harmonics] or [np.array(oscillator.forcing)]
    stiffness = matrices(oscillator)[2]
    moved = np.linalg.lstsq(stiffness, np.abs(np.sum(forces, axis=0)), rcond=None)[0]
    return abs(float(np.array(oscillator.contact_row) @ moved))


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
    """Return a chain whose dampings were meant as a ratio of its first mode."""
    oscillator = asked.oscillator
    if oscillator.matrices is not None or not len(natural := _seen_modes(oscillator)[0]):
        return None
    ratio = float(np.mean(oscillator.damping))
    return asked.with_(damping=ratio / float(natural[0])) if 0.0 < ratio < 1.0 else None


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
