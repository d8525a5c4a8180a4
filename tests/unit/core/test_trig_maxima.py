"""Highest maxima of trigonometric polynomials, and what contact makes of them, against 50 digits."""

from __future__ import annotations

import numpy as np
import pytest
from flint import acb, acb_poly, arb

from grazemap_core.arrays import Complexes
from grazemap_core.contact import reference_motion
from grazemap_core.contact.tolerances import CLEARED, HIGHEST_ERROR
from grazemap_core.numerics.trig_maxima import highest_points, roundoff
from tests.oracles.fifty_digits import digits


def value(orders: tuple[int, ...], amplitudes: Complexes, turn: acb) -> arb:
    """Return u where exp(i theta) is `turn`."""
    terms = (acb(x.real, x.imag) * turn**k for k, x in zip(orders, amplitudes.tolist(), strict=True))
    return sum((term.imag for term in terms), arb(0))


def highest(orders: tuple[int, ...], amplitudes: Complexes) -> arb:
    """Return the largest u, at a zero of u', which times z^K is a polynomial in z = exp(i theta)."""
    coefficients = [acb(0)] * (2 * orders[-1] + 1)
    for k, x in zip(orders, amplitudes.tolist(), strict=True):
        coefficients[orders[-1] + k] += k * acb(x.real, x.imag)
        coefficients[orders[-1] - k] += k * acb(x.real, -x.imag)
    zeros = [
        acb(zero.real.mid(), zero.imag.mid()) for zero in acb_poly(coefficients).roots(tol=arb(10) ** -40, maxprec=2000)
    ]
    turns = [zero / abs(zero) for zero in zeros if abs(float(abs(zero)) - 1.0) < 1e-6]
    return max((value(orders, amplitudes, turn).mid() for turn in turns), key=float)


def random_amplitudes(orders: tuple[int, ...], count: int) -> Complexes:
    random = np.random.default_rng(len(orders))
    amplitudes = random.normal(size=(count, len(orders))) + 1j * random.normal(size=(count, len(orders)))
    return amplitudes * 10.0 ** random.uniform(-3, 0, size=amplitudes.shape)


@pytest.mark.parametrize("orders", [(1, 2), (1, 2, 3), (2, 5), (7, 11, 13), (1, 40)])
def test_the_highest_maximum_and_its_bound_hold_in_fifty_digits(orders: tuple[int, ...]) -> None:
    k, amplitudes = np.array(orders, dtype=np.float64), random_amplitudes(orders, 20)
    points, errors = highest_points(k, amplitudes), roundoff(k, amplitudes)
    with digits():
        for i, each in enumerate(amplitudes):
            largest, size = highest(orders, each), float(np.sum(np.abs(each)))
            assert abs(float(largest - arb(points.height[i]))) <= errors[i]
            assert abs(float(largest - value(orders, each, acb(0, points.phase[i]).exp()))) < 1e-15 * size
            for stop, unreached in zip((1, -1), reference_motion._unreached(k, each).tolist(), strict=True):
                above = float(arb(CLEARED) - (arb(unreached) + highest(orders, stop * each)) / arb(size))
                assert 0.5 * HIGHEST_ERROR < above < 2.0 * HIGHEST_ERROR + errors[i] / size


@pytest.mark.parametrize("change", [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9])
def test_a_maximum_with_hardly_any_curvature_is_found(change: float) -> None:
    """cos(t) - cos(2 t)/4 is 3/4 at t = 0, where its first three derivatives vanish."""
    orders, random = (1, 2), np.random.default_rng(3)
    k = np.array(orders, dtype=np.float64)
    for place in random.uniform(-np.pi, np.pi, 20):
        amplitudes = 1j * np.array([1.0, -0.25 + change]) * np.exp(-1j * k * place)
        (height,) = highest_points(k, amplitudes[None, :]).height
        near = place + np.append(0.0, np.geomspace(1e-8, 1e-3, 40) * np.array([[1.0], [-1.0]]))
        with digits():
            sampled = max(
                float(value(orders, amplitudes, acb(0, angle).exp()) - arb(height)) for angle in near.tolist()
            )
        assert abs(sampled) < 1e-14
