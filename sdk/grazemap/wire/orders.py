"""The harmonics in which an oscillator is forced: those whose amplitudes, summed exactly, are not all zero.

Amplitudes are those of forces and of a moving base together, for all omega: a law that depends on omega differently, or
another phase, cancels nothing. (Of distinct numbers e^(i phase) no sum with rational factors vanishes: Lindemann.)
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from grazemap.wire import linear
from grazemap.wire.structure import Base, Forcing, RayleighDamping

if TYPE_CHECKING:
    from grazemap.wire.oscillator import Oscillator

Exact = list[Fraction]
Key = tuple[str, int, float]
"""A power of the frequency, by the name of its law, a degree of freedom, and a phase."""


def forced_orders(oscillator: Oscillator) -> list[int]:
    """Return the harmonics in which the forces are not 0, increasing; that of a moving base is 1."""
    forcings = oscillator.harmonics or [Forcing.model_validate({"amplitude": oscillator.forcing})]
    parts: dict[int, list[Forcing | Base]] = {}
    for forcing in forcings:
        parts.setdefault(forcing.harmonic, []).append(forcing)
    if oscillator.base is not None:
        parts.setdefault(1, []).append(oscillator.base)
    return sorted(order for order, of_order in parts.items() if _moves(oscillator, of_order))


def _moves(oscillator: Oscillator, parts: Sequence[Forcing | Base]) -> bool:
    if len(parts) == 1 and isinstance(parts[0], Forcing):
        return any(parts[0].amplitude)
    sums: dict[Key, Fraction] = defaultdict(Fraction)
    for part in parts:
        terms = _of_force(part) if isinstance(part, Forcing) else _of_base(oscillator, part)
        for key, value in terms:
            sums[key] += value
    return any(sums.values())


def _of_force(force: Forcing) -> Iterator[tuple[Key, Fraction]]:
    phases = force.phase or [0.0] * len(force.amplitude)
    for i, (value, phase) in enumerate(zip(force.amplitude, phases, strict=True)):
        yield (force.law, i, phase), Fraction(value)


def _of_base(oscillator: Oscillator, base: Base) -> Iterator[tuple[Key, Fraction]]:
    """Yield the terms of the ground's forces, exactly but for the damping of modes."""
    if base.amplitude == 0.0:
        return
    moved = list(map(Fraction, [1.0] * oscillator.size if base.influence is None else base.influence))
    mass, stiffness = _products(oscillator, moved)
    laws = {"unbalance": mass} if base.stops_move else {"constant": stiffness, "rate": _damped(oscillator, moved)}
    for law, forces in laws.items():
        for i, value in enumerate(forces):
            yield (law, i, base.phase), Fraction(base.amplitude) * value


def _products(oscillator: Oscillator, moved: Exact) -> tuple[Exact, Exact]:
    """Return M r and K r."""
    matrices = oscillator.matrices
    if matrices is not None:
        return _product(matrices.mass, moved), _product(matrices.stiffness, moved)
    mass = [Fraction(m) * r for m, r in zip(oscillator.masses, moved, strict=True)]
    return mass, _of_links(oscillator.stiffnesses, moved)


def _damped(oscillator: Oscillator, moved: Exact) -> Exact:
    """Return C r, of a chain over a factor."""
    matrices = oscillator.matrices
    if matrices is None:
        of = oscillator.damping
        return _of_links(of if isinstance(of, list) else [of * k for k in oscillator.stiffnesses], moved)
    if isinstance(matrices.damping, list):
        return _product(matrices.damping, moved)
    if isinstance(matrices.damping, RayleighDamping):
        alpha, beta = map(Fraction, matrices.damping.rayleigh)
        return [alpha * m + beta * k for m, k in zip(*_products(oscillator, moved), strict=True)]
    return _product(linear.matrices(oscillator)[1].tolist(), moved)


def _product(matrix: Sequence[Sequence[float]], moved: Exact) -> Exact:
    return [sum((Fraction(a) * r for a, r in zip(row, moved, strict=True)), Fraction()) for row in matrix]


def _of_links(links: Sequence[float], moved: Exact) -> Exact:
    """Return the forces of the links of a chain."""
    after = [*moved[1:], Fraction()]
    pulls = [Fraction(link) * (r - other) for link, r, other in zip(links, moved, after, strict=True)]
    return [pull - before for pull, before in zip(pulls, [Fraction(), *pulls[:-1]], strict=True)]
