"""The grazing curve against a direct complex solve in 50 digits, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb

from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.structure import Response
from grazemap_core.model.tolerances import STEADY_ACCURACY
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits, impulse, steady_amplitude
from tests.oracles.impact_orbit_oracle import chain_of
from tests.oracles.steady_displacements import forced_response, steady_response
from tests.support.oscillators import DEFAULT

SYSTEMS = 10_000


def relative_error(response, exact):
    with digits():
        ours_re, ours_im = arb(float(response.real)), arb(float(response.imag))
        distance = ((exact.real - ours_re) ** 2 + (exact.imag - ours_im) ** 2).sqrt()
        return float((distance / abs(exact)).mid())


def random_system(random):
    """Return an oscillator and a frequency, at a resonance in a third of the cases."""
    count = int(random.integers(1, 7))
    masses, stiffnesses = 10 ** random.uniform(-2, 2, (2, count))
    forcing = random.normal(size=count) * (random.random(count) < 0.7)
    forcing[random.integers(count)] = 1.0
    per_link = bool(random.integers(2))
    # light 1e-3 to far overdamped, and now and then a mode that is critical to a rounding
    damping = 10 ** random.uniform(-3, 2, count)
    omega = float(10 ** random.uniform(-2, 1.5))
    if per_link:
        return Oscillator.create(masses, stiffnesses, damping, forcing, 0.8), omega
    frequencies = np.sqrt(modal_model(Oscillator.create(masses, stiffnesses, 0.0, forcing, 0.8)).frequency_squared)
    gamma = float(damping[0] / frequencies[0])
    what = random.integers(6)
    if what == 0:
        gamma = float(1.0 / random.choice(frequencies))
    elif what <= 2:
        gamma = float(1e-3 / frequencies[-1])
        omega = float(random.choice(frequencies))
    return Oscillator.create(masses, stiffnesses, gamma, forcing, 0.8), omega


def largest_errors_of_random_systems(count):
    """Return the largest error of chains with ``C = 2 gamma K``, and that of chains with given link dampings."""
    random = np.random.default_rng(7)
    proportional, per_link = [0.0], [0.0]
    for _ in range(count):
        oscillator, omega = random_system(random)
        exact = steady_amplitude(chain_of(oscillator), omega)
        errors = per_link if oscillator.structure.gamma is None else proportional
        errors.append(relative_error(steady_response(oscillator, [omega])[0, 0], exact))
    return max(proportional), max(per_link)


def test_reference_amplitudes():
    curve = grazing_curve(DEFAULT, [0.1, 0.28109])
    assert curve.clearance == pytest.approx([1.4415071166664197, 1.9203051890379243], rel=0, abs=1e-13)


@pytest.mark.parametrize("count", [1000, pytest.param(SYSTEMS, marks=pytest.mark.thorough)])
def test_random_systems_agree_with_a_direct_solve(count):
    # relative to |x_1| itself, which is no larger than the sum of its modal terms
    proportional, per_link = largest_errors_of_random_systems(count)
    assert per_link < 0.5 * EPSILON + STEADY_ACCURACY
    assert proportional < 1e-15  # 2 gamma k_i is rounded


@pytest.mark.thorough
def test_plain_double_precision_fails_the_same_comparison(monkeypatch):
    # the comparison above is worth something only because it sees what refinement adds
    def plain(chain, omega, forces, row):
        matrix = chain.stiffness_matrix - omega[0] ** 2 * chain.mass_matrix + 1j * omega[0] * chain.damping_matrix
        amplitudes = np.linalg.solve(matrix, forces[0])[None]
        return Response(amplitudes, amplitudes @ row, np.ones(1, dtype=np.bool_))

    monkeypatch.setattr("grazemap_core.model.structure.Structure.response", plain)
    assert min(largest_errors_of_random_systems(1000)) > 1e-13


@pytest.mark.parametrize("gamma", [1e-6, 1e-9, 1e-12])
def test_a_sharp_resonance_is_right_to_the_last_digits(gamma):
    oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], gamma, [1.0, 0.0, 0.0], 0.8)
    chain = chain_of(oscillator)
    for omega in np.sqrt(modal_model(oscillator).frequency_squared):
        response = steady_response(oscillator, [omega])[0, 0]
        assert relative_error(response, steady_amplitude(chain, omega)) < 1e-15


def test_a_part_of_the_chain_that_resonates_by_itself_is_solved_correctly():
    # masses 2 and 3 held at mass 1 resonate at this frequency: the pivot of the last two rows nearly vanishes
    oscillator = Oscillator.create([1.0, 1.0, 1.0], [1.0, 1.0, 1.0], 1e-13, [1.0, 0.0, 0.0], 0.8)
    exact = steady_amplitude(chain_of(oscillator), 1.0)
    assert relative_error(steady_response(oscillator, [1.0])[0, 0], exact) < 1e-15


@pytest.mark.parametrize("with_matrices", [False, True])
def test_a_pivot_of_zero_is_no_resonance(with_matrices):
    # K - M = [[0, -1, 0], [-1, 1, -1], [0, -1, 1]], whose inverse has the first column (0, -1, -1)
    oscillator = Oscillator.create([1.0, 1.0, 1.0], [1.0, 1.0, 1.0], 0.0, [1.0, 0.0, 0.0], 0.8)
    if with_matrices:
        matrices = Matrices.create(oscillator.mass_matrix, oscillator.stiffness_matrix)
        oscillator = Oscillator.of_structure(matrices, oscillator.contact, oscillator.drive, 0.8)
    assert forced_response(oscillator, [1.0])[0] == pytest.approx([0.0, -1.0, -1.0], rel=1e-15, abs=1e-30)


def test_the_phase_puts_the_contact_at_time_zero():
    omega = np.linspace(0.05, 2.5, 50)
    curve = grazing_curve(DEFAULT, omega)
    response = steady_response(DEFAULT, omega)[:, 0]
    assert np.imag(response * np.exp(1j * curve.phase)) == pytest.approx(curve.clearance, rel=1e-15)
    assert np.real(response * np.exp(1j * curve.phase)) == pytest.approx(0.0, abs=2e-15)
    assert np.all((curve.phase > -np.pi) & (curve.phase <= np.pi))


def test_the_phase_is_that_of_equation_16():
    # x_1 = d1 sin(tau) + d2 cos(tau) at time 0, its rate omega (d1 cos(tau) - d2 sin(tau)): tau = atan2(d1, d2)
    omega = np.linspace(0.05, 2.5, 50)
    d1, d2 = np.zeros(50), np.zeros(50)
    model = modal_model(DEFAULT)
    for j in range(3):
        weight = model.shape[0, j, 0] * (model.shape[:, j, 0] @ DEFAULT.forcing)
        gap, drag = model.frequency_squared[j] - omega**2, 2.0 * model.decay[j] * omega
        d1 += weight * gap / (gap**2 + drag**2)
        d2 += -weight * drag / (gap**2 + drag**2)
    assert grazing_curve(DEFAULT, omega).phase == pytest.approx(np.arctan2(d1, d2), abs=1e-13)


@pytest.mark.parametrize("damping", [0.05, [0.05, 0.05, 0.05], [0.3, 0.0, 2.0]])
def test_the_first_recurrence_follows_the_sign_rule_in_50_digits(damping):
    oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], 0.8)
    chain = chain_of(oscillator)
    omega = np.linspace(0.05, 2.5, 60)
    curve = grazing_curve(oscillator, omega, max_order=8)
    for w, order, stop in zip(omega, curve.first_recurrence, curve.recurrence_stop, strict=True):
        with digits():
            half = arb.pi() / arb(w)
            exact = next((m for m in range(1, 9) if (-1) ** m * impulse(chain, m * half) < 0), 0)
        assert (order, stop) == (exact, 0 if exact == 0 else (1 if exact % 2 == 0 else -1))


def test_systems_without_a_grazing_curve_are_refused():
    def chain(damping, forcing, stiffnesses=(1.0, 1.3, 2.0)):
        return Oscillator.create([1.0, 1.0, 1.0], list(stiffnesses), damping, forcing, 0.8)

    with pytest.raises(ParameterError, match="forcing"):
        grazing_curve(chain(0.05, [0.0, 0.0, 0.0]), [0.3])
    for omega in ([0.0], [-1.0], [np.nan], [[0.3]]):
        with pytest.raises(ParameterError, match="omega"):
            grazing_curve(chain(0.05, [1.0, 0.0, 0.0]), omega)
    with pytest.raises(ParameterError, match="max_order"):
        grazing_curve(chain(0.05, [1.0, 0.0, 0.0]), [0.3], max_order=0)
    for undamped in (0.0, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0]):
        with pytest.raises(SteadyMotionError, match="undamped"):
            grazing_curve(chain(undamped, [1.0, 0.0, 0.0]), [0.3])
    with pytest.raises(SteadyMotionError, match="resonance"):
        forced_response(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), [1.0])
