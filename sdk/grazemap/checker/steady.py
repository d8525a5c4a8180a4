"""The steady motion without impacts, a sum of harmonics, and its maximum in a period."""

from __future__ import annotations

from typing import Any, NamedTuple

from flint import acb, acb_mat, arb

from grazemap.checker.arithmetic import Refused, ball, identity
from grazemap.checker.system import System

PARTS = 16
"""Number of parts of a period with which the search for the maximum begins, divided by the largest order."""
MAX_HALVINGS = 60
"""Halvings after which it is undecided which part of a period has the maximum."""
MAX_PARTS = 4096
"""Number of parts that may have the maximum after a halving; with more of them it is undecided too."""


class Maximum(NamedTuple):
    """The largest displacement of a motion towards a stop, from the equilibrium."""

    value: arb
    """The displacement."""
    phase: arb
    """Phase 2 pi t/T at which it is attained."""


def harmonic_amplitudes(system: System, divisor: int) -> dict[int, acb]:
    """Return complex amplitudes X_k of the contact coordinate, q = sum Im(X_k exp(2 pi i k t/T)), by k.

    k is the order of a harmonic over `divisor`, the greatest common divisor of the orders.
    """
    free, size = acb_mat(system.free_block(system.matrix)), system.size
    amplitudes = {}
    for i, order in enumerate(system.orders):
        pairs = [row[size + 2 * i : size + 2 * i + 2] for row in system.matrix.tolist()[:size]]
        push = acb_mat([[sine + cosine * acb(0, 1)] for sine, cosine in pairs]) * system.force_scale
        steady = (acb_mat(identity(size)) * acb(0, order * system.omega) - free).solve(push)
        row = acb_mat([system.rows.tolist()[0][:size]])
        amplitudes[order // divisor] = (row * steady)[0, 0]
    return amplitudes


def maximum(amplitudes: dict[int, acb], stop: int) -> Maximum:
    """Return the maximum of a steady motion towards a stop.

    Shows that it is attained at one phase of the period T only, with a negative second derivative. Smaller local maxima
    are allowed.
    """

    def values(phase: Any) -> tuple[Any, Any, Any]:
        """Return the displacement towards the stop, and its derivatives by the phase."""
        turned = {k: stop * x * (acb(0, 1) * k * phase).exp() for k, x in amplitudes.items()}
        return (
            sum((x.imag for x in turned.values()), arb(0)),
            sum((k * x.real for k, x in turned.items()), arb(0)),
            sum((-k * k * x.imag for k, x in turned.items()), arb(0)),
        )

    count = PARTS * max(amplitudes, default=1)
    half, parts = arb.pi() / count, list(range(count))
    for _ in range(MAX_HALVINGS):
        known = []
        for part in parts:
            middle = (2 * part + 1) * half
            value, slope, _ = values(middle)
            bend = values(middle + ball(half))[2]
            known.append((part, value, value + (slope + bend * ball(half) / 2) * ball(half)))
        least = max((value.lower() for _, value, _ in known), default=arb(0))
        parts = [part for part, _, enclosure in known if not enclosure < least]
        gaps = [(b - a) % count for a, b in zip(parts, [*parts[1:], parts[0]], strict=True)]
        begin = (gaps.index(max(gaps)) + 1) % len(parts)
        length = (parts[begin - 1] - parts[begin]) % count + 1
        hull = (2 * parts[begin] + length) * half + ball(length * half)
        if length < count // 2 and values(hull)[2] < 0:
            return _solved(values, hull)
        parts, count, half = [child for part in parts for child in (2 * part, 2 * part + 1)], 2 * count, half / 2
        if len(parts) > MAX_PARTS:
            break
    raise Refused("the maximum of the steady motion is not shown to be the only one, and quadratic")


def _solved(values: Any, hull: arb) -> Maximum:
    """Return the maximum in an interval in which the second derivative is negative, by Newton's method."""
    phase = hull
    while True:
        middle = phase.mid()
        _, slope, _ = values(middle)
        better = (middle - slope / values(phase)[2]).intersection(phase)
        if better.rad() * 2 > phase.rad():
            break
        phase = better
    value, _, _ = values(phase.mid())
    return Maximum(value + values(phase)[1] * (phase - phase.mid()), phase)
