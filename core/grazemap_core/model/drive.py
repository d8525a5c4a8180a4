"""Harmonic forces on a structure, and how they depend on the forcing frequency.

Every law is a polynomial: the k-th harmonic has the complex amplitude ``constant + i s rate + s^2 quadratic``, where
``s = k omega`` and x(t) = Im(amplitude e^{i s t}). A constant force has the first term, an unbalance the last one, and
a moving base with stops fixed in space the first two, from the stiffness and the damping between the structure and the
ground (theory, "Any linear structure").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class Harmonic:
    """One harmonic of the forces, with the amplitudes ``constant + i s rate + s^2 quadratic`` at s = order omega."""

    order: int
    """Frequency of the harmonic over that of the forcing."""
    constant: Complexes
    """(N,) As above."""
    rate: Complexes
    """(N,) As above."""
    quadratic: Complexes
    """(N,) As above."""

    def amplitudes(self, omega: Floats) -> Complexes:
        """Return the amplitudes of the forces at forcing frequencies (n,), shape (n, N)."""
        s = self.order * omega[:, None]
        result = np.empty((len(omega), len(self.constant)), dtype=np.complex128)
        result[:] = self.constant
        has_rate, has_quadratic = self._terms
        if has_rate:
            result = result + 1j * s * self.rate
        if has_quadratic:
            result = result + s * s * self.quadratic
        return result

    @cached_property
    def _terms(self) -> tuple[bool, bool]:
        """Whether `rate`, and `quadratic`, is not 0."""
        return bool(np.any(self.rate)), bool(np.any(self.quadratic))

    def slopes(self, omega: Floats) -> Complexes:
        """Return the derivatives of `amplitudes` with respect to omega, shape (n, N)."""
        s = self.order * omega[:, None]
        return self.order * (1j * self.rate + 2.0 * s * self.quadratic)


def harmonics(parts: Iterable[Harmonic]) -> tuple[Harmonic, ...]:
    """Return harmonics in increasing order, those of one order added up, without those that are zero."""
    of_orders: dict[int, list[Harmonic]] = {}
    for part in parts:
        of_orders.setdefault(part.order, []).append(part)
    sums = (_sum(of_orders[order]) for order in sorted(of_orders))
    return tuple(
        harmonic
        for harmonic in sums
        if any(np.any(part) for part in (harmonic.constant, harmonic.rate, harmonic.quadratic))
    )


def _sum(parts: Sequence[Harmonic]) -> Harmonic:
    """Return the sum of harmonics of one order, rounded once."""
    if len(parts) == 1:
        return parts[0]
    sums = []
    for name in ("constant", "rate", "quadratic"):
        terms = np.stack([getattr(part, name) for part in parts], axis=1)
        sums.append(np.array([complex(math.fsum(row.real), math.fsum(row.imag)) for row in terms]))
    return Harmonic(parts[0].order, *sums)


def force(order: int, amplitude: Floats, phase: Floats | None = None, *, unbalance: bool = False) -> Harmonic:
    """Return a harmonic ``amplitude sin(order omega t + phase)``, with an unbalance times ``(order omega)^2``."""
    complex_amplitude = amplitude.astype(np.complex128)
    if phase is not None:
        complex_amplitude = amplitude * (np.cos(phase) + 1j * np.sin(phase))
    nothing = np.zeros_like(complex_amplitude)
    if unbalance:
        return Harmonic(order, nothing, nothing, complex_amplitude)
    return Harmonic(order, complex_amplitude, nothing, nothing)


def base_in_space(amplitude: complex, stiffness: Floats, damping: Floats) -> Harmonic:
    """Return the force of a ground that moves, with the stops fixed in space, on absolute displacements.

    `stiffness` and `damping`, (N,), are the forces on the structure at rest by a unit displacement and a unit velocity
    of the ground.
    """
    forces = [(amplitude * coefficients).astype(np.complex128) for coefficients in (stiffness, damping)]
    return Harmonic(1, forces[0], forces[1], np.zeros(len(stiffness), dtype=np.complex128))


def base_with_stops(amplitude: complex, momentum: Floats) -> Harmonic:
    """Return the force on displacements relative to a ground that moves together with the stops.

    `momentum` is M r, (N,): that of the structure when it moves with the ground at unit velocity.
    """
    nothing = np.zeros(len(momentum), dtype=np.complex128)
    return Harmonic(1, nothing, nothing, (amplitude * momentum).astype(np.complex128))
