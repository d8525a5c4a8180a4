"""g, its periodic sums and their bounds against sums of residues in 50 digits."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb

from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.kernels.response_sums import ALTERNATING, IMPULSE, SAME_SIGN, curvature_bound
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import Residues, digits
from tests.oracles.impact_orbit_oracle import chain_of
from tests.support.oscillators import DEFAULT
from tests.support.thorough import the_first

KINDS = {"impulse": IMPULSE, "same": SAME_SIGN, "alternating": ALTERNATING}


def systems():
    random = np.random.default_rng(3)
    yield DEFAULT
    yield Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 1e-5, [1.0, 0.0, 0.0], 0.8)
    yield Oscillator.create([1.0], [1.0], 1.0 + 1e-7, [1.0], 0.8)
    for number in range(40):
        count = int(random.integers(1, 6))
        masses, stiffnesses = 10 ** random.uniform(-1, 1, (2, count))
        damping = 10 ** random.uniform(-3, 1, count)
        yield Oscillator.create(
            masses, stiffnesses, float(damping[0]) if number % 2 else damping, [1.0] + [0.0] * (count - 1), 0.8
        )


@pytest.mark.parametrize("kind", list(KINDS))
def test_values_stay_within_a_third_of_their_roundoff_bound(kind):
    worst = 0.0
    for oscillator in systems():
        response = impulse_response(modal_model(oscillator))
        residues = Residues.of(chain_of(oscillator))
        times = np.geomspace(0.3, 200.0, 60)
        values, slopes, bounds, _ = evaluate(response, times, KINDS[kind])
        for time, value, slope, bound in zip(times, values, slopes, bounds, strict=True):
            if bound == 0.0:  # underflown
                continue
            with digits():
                exact = residues.value(kind, arb(time))
                worst = max(worst, float(abs(exact - arb(value)).mid()) / bound)
                rate = float(residues.value(kind, arb(time), 1).mid())
            assert slope == pytest.approx(rate, rel=1e-9, abs=1e3 * bound * np.sqrt(response.frequency_squared.max()))
    assert worst < 1.0 / 3.0


@pytest.mark.parametrize("kind", the_first(1, KINDS))
def test_the_curvature_bound_holds_and_is_not_too_loose(kind):
    tightest = np.inf
    for oscillator in systems():
        response = impulse_response(modal_model(oscillator))
        residues = Residues.of(chain_of(oscillator))
        for middle in (0.7, 3.0, 20.0):
            for radius in (0.3, 0.01):
                bound = curvature_bound(KINDS[kind], response.blocks, response.slowest, middle, radius)
                bound *= np.exp(-response.slowest * middle)
                with digits():
                    actual = max(
                        abs(float(residues.value(kind, arb(middle + radius * part), 2).mid()))
                        for part in np.linspace(-1, 1, 21)
                    )
                assert actual <= bound
                tightest = min(tightest, bound / actual)
    assert tightest < 1.2


def test_the_sums_agree_with_their_definitions():
    response = impulse_response(modal_model(next(systems())))
    spacing = 5.0
    terms = evaluate(response, spacing * np.arange(1, 20_000))[0]
    assert evaluate(response, [spacing], SAME_SIGN)[0][0] == pytest.approx(np.sum(terms), rel=1e-12)
    signs = np.where(np.arange(1, 20_000) % 2, -1.0, 1.0)
    assert evaluate(response, [spacing], ALTERNATING)[0][0] == pytest.approx(np.sum(signs * terms), rel=1e-12)


def test_an_impulse_starts_with_unit_velocity_and_no_displacement():
    for oscillator in systems():
        response = impulse_response(modal_model(oscillator))
        assert np.sum(response.value) == pytest.approx(0.0, abs=1e-12)
        assert np.sum(response.slope) == pytest.approx(1.0, abs=1e-12)
