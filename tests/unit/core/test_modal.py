"""The modal model against 50-digit arithmetic made from M, C and K."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from flint import acb_mat

from grazemap_core.errors import ConditioningError
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import Chain, digits, first_order_matrix, flow


def oscillator_and_chain(masses, stiffnesses, damping):
    count = len(masses)
    oscillator = Oscillator.create(masses, stiffnesses, damping, [1.0] + [0.0] * (count - 1), 0.8, units="SI")
    if np.ndim(damping) == 0:
        return oscillator, Chain.proportional(masses, stiffnesses, float(damping), oscillator.forcing)
    return oscillator, Chain(masses, stiffnesses, damping, oscillator.forcing)


def propagator(oscillator, time):
    model = modal_model(oscillator)
    count = oscillator.size
    blocks = np.zeros((2 * count, 2 * count))
    for j in range(count):
        blocks[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = np.reshape(
            block_flow(model.decay[j], model.discriminant[j], model.frequency_squared[j], time), (2, 2)
        )
    return model.from_modal @ blocks @ model.to_modal


def energy_error(oscillator, chain, time):
    """Largest error of the flow in the energy norm, in which the flow itself is at most 1."""
    count = oscillator.size
    exact = flow(chain, time, precision=150)
    exact = np.array([[float(exact[i, j].mid()) for j in range(2 * count)] for i in range(2 * count)])
    stretch = np.eye(count) - np.eye(count, k=1)
    weights = np.zeros((2 * count, 2 * count))
    weights[:count, :count] = np.sqrt(oscillator.stiffnesses)[:, None] * stretch
    weights[count:, count:] = np.diag(np.sqrt(oscillator.masses))
    return np.linalg.norm(weights @ (propagator(oscillator, time) - exact) @ np.linalg.inv(weights), 2)


def test_proportional_modes_are_m_orthonormal():
    oscillator, _ = oscillator_and_chain([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05)
    model = modal_model(oscillator)
    shapes = model.shape[:, :, 0]
    assert np.allclose(shapes.T @ oscillator.mass_matrix @ shapes, np.eye(3), atol=1e-14)
    assert np.allclose(shapes.T @ oscillator.stiffness_matrix @ shapes, np.diag(model.frequency_squared), atol=1e-14)
    assert not np.any(model.shape[:, :, 1])
    assert np.array_equal(model.unit_impulse[:, 1], oscillator.masses[0] * shapes[0])
    assert np.all(np.diff(model.frequency_squared) > 0)


@pytest.mark.parametrize("damping", [0.05, [0.1, 0.1, 0.1], [0.0, 3.0, 0.2], [40.0, 0.01, 7.0]])
def test_to_modal_and_from_modal_are_inverse_and_describe_shape_and_kick(damping):
    oscillator, _ = oscillator_and_chain([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping)
    model = modal_model(oscillator)
    assert np.allclose(model.to_modal @ model.from_modal, np.eye(6), atol=1e-13 * model.conditioning)
    assert np.array_equal(model.shape.reshape(3, 6), model.from_modal[:3])
    assert np.array_equal(model.unit_impulse.ravel(), model.to_modal[:, 3])


CRITICAL = [0.0] + [sign * distance for distance in (1e-15, 1e-12, 1e-9, 1e-6, 1e-3) for sign in (-1, 1)]


@pytest.mark.parametrize("offset", CRITICAL)
def test_flows_through_critical_damping_keep_their_digits(offset):
    masses, stiffnesses = [1.0, 10.0, 10.0], [1.0, 5.0, 5.0]
    undamped, _ = oscillator_and_chain(masses, stiffnesses, 0.0)
    critical = 1.0 / np.sqrt(modal_model(undamped).frequency_squared[1])
    gamma = float(critical * (1.0 + offset))
    for damping in (gamma, [2 * gamma * k for k in stiffnesses]):
        oscillator, chain = oscillator_and_chain(masses, stiffnesses, damping)
        assert max(energy_error(oscillator, chain, time) for time in (0.3, 4.0, 30.0)) < 2e-14


@pytest.mark.parametrize("offset", CRITICAL)
def test_a_critical_pair_of_one_link_keeps_its_digits(offset):
    # one damper on the first link: its value at which two real exponents meet, by bisection on the flow of exponents
    masses, stiffnesses = [1.0, 3.0], [1.0, 2.0]

    def real_exponents(c):
        matrix = np.block(
            [
                [np.zeros((2, 2)), np.eye(2)],
                [
                    -np.array([[1.0, -1.0], [-1.0, 3.0]]) / np.array([[1.0], [3.0]]),
                    -np.array([[c, -c], [-c, c + 0.1]]) / np.array([[1.0], [3.0]]),
                ],
            ]
        )
        return int(np.sum(np.abs(np.linalg.eigvals(matrix).imag) < 1e-30))

    low, high = 0.1, 20.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if real_exponents(middle) == 0 else (low, middle)
    oscillator, chain = oscillator_and_chain(masses, stiffnesses, [high * (1.0 + offset), 0.1])
    assert modal_model(oscillator).conditioning < 100
    assert max(energy_error(oscillator, chain, time) for time in (0.3, 4.0, 30.0)) < 2e-14


def test_random_chains_with_dampings_from_light_to_overdamped():
    random = np.random.default_rng(20240611)
    worst = 0.0
    for number, count in itertools.product(range(25), range(1, 7)):
        masses, stiffnesses = 10 ** random.uniform(-1, 1, (2, count))
        damping = 10 ** random.uniform(-3, 1.5, count)
        oscillator, chain = oscillator_and_chain(masses, stiffnesses, float(damping[0]) if number % 2 else damping)
        model = modal_model(oscillator)
        time = 10 ** random.uniform(-1, 1.5)
        # exponents are rounded: a phase or a decay errs in proportion to time, as long as there is motion left
        split = np.sqrt(np.abs(model.discriminant))
        slow = np.where(model.discriminant > 0, model.decay, model.frequency_squared / (model.decay + split))
        rate = np.where(model.discriminant > 0, np.sqrt(model.frequency_squared), slow)
        inherent = 1.0 + np.max(rate * time * np.exp(-slow * time))
        worst = max(worst, energy_error(oscillator, chain, time) / (model.conditioning * inherent))
    assert worst < 20 * 2.3e-16


@pytest.mark.parametrize("kind", ["proportional", "per link"])
def test_exponents_of_a_very_stiff_chain_are_right_relative_to_themselves(kind):
    masses = [1.0, 1e-3, 30.0, 2.0, 1e4, 0.5]
    stiffnesses = [1e-6, 1e12, 3.0, 1e5, 1e-2, 7e9]
    damping = 1e-4 if kind == "proportional" else [1e-5, 2e3, 1e-2, 0.0, 1e-3, 8.0]
    oscillator, chain = oscillator_and_chain(masses, stiffnesses, damping)
    model = modal_model(oscillator)
    with digits(80):
        exponents = acb_mat(first_order_matrix(chain)).eig()
        # conjugates and equal pairs: a block's numbers are checked by the polynomial it divides
        for square, decay, discriminant in zip(model.frequency_squared, model.decay, model.discriminant, strict=True):
            root = complex(discriminant) ** 0.5
            ours = -decay + 1j * root if discriminant > 0 else complex(-square / (decay + abs(root)))
            nearest = min(float(abs(exponent - ours).mid()) for exponent in exponents) / abs(ours)
            assert nearest < 3e-15, (ours, nearest)


def test_slow_modes_of_a_stiff_chain_would_lose_digits_without_the_refinement(monkeypatch):
    # the checker above is worth something only if a plain Schur form fails it
    monkeypatch.setattr("grazemap_core.model.tolerances.MODAL_REFINEMENT_GOAL", np.inf)
    monkeypatch.setattr(
        "grazemap_core.model.structure.Structure.invariance_residual",
        lambda chain, columns, *rest: np.zeros_like(columns),
    )
    with pytest.raises(AssertionError):
        test_exponents_of_a_very_stiff_chain_are_right_relative_to_themselves("per link")


def test_two_blocks_that_are_defective_together_are_refused():
    # (lambda^2 + (2/3) lambda + 4/3)^2: two equal complex pairs with one shape
    oscillator, _ = oscillator_and_chain([1.0, 3.0], [1.0, 16.0 / 3.0], [1.0, 0.0])
    with pytest.raises(ConditioningError):
        modal_model(oscillator)


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6])
def test_near_that_point_the_condition_number_measures_the_loss_of_digits(distance):
    oscillator, chain = oscillator_and_chain([1.0, 3.0], [1.0, 16.0 / 3.0], [1.0 + distance, 0.0])
    conditioning = modal_model(oscillator).conditioning
    assert conditioning == pytest.approx(1.0 / np.sqrt(distance), rel=3.0)
    assert energy_error(oscillator, chain, 5.0) < 2e-15 * conditioning


def test_one_damped_middle_link_can_leave_a_mode_undamped():
    oscillator, _ = oscillator_and_chain([1.0, 1.0, 1.0], [1.0, 1.3, 2.0], [0.0, 0.1, 0.0])
    assert np.array_equal(np.sort(modal_model(oscillator).undamped), [False, False, True])
    oscillator, _ = oscillator_and_chain([1.0, 1.0, 1.0], [1.0, 1.3, 2.0 + 1e-6], [0.0, 0.1, 0.0])
    assert not np.any(modal_model(oscillator).undamped)


@pytest.mark.parametrize(("stiffnesses", "damping"), [
    ([1.0, 1e-60], [0.1, 0.1]),
    ([1.0, 1e-60], [0.1, 0.0]),
    ([1.0, 1e-16], [0.0, 5.0]),
    ([1e-60, 1.0], [0.0, 5.0]),
])  # fmt: skip
def test_a_mode_lost_in_the_round_off_of_the_others_is_refused_with_this_reason(stiffnesses, damping):
    oscillator, _ = oscillator_and_chain([1.0, 1.0], stiffnesses, damping)
    with pytest.raises(ConditioningError, match="so slow compared with the others"):
        modal_model(oscillator)


@pytest.mark.thorough
def test_chains_of_any_numbers_have_a_model_or_are_refused():
    rng = np.random.default_rng(3)
    models = 0
    for _ in range(200):
        count = int(rng.integers(1, 5))
        masses, stiffnesses, damping = 10.0 ** rng.uniform(-30, 30, (3, count))
        oscillator, _ = oscillator_and_chain(masses, stiffnesses, damping * (rng.random(count) < 0.7))
        try:
            model = modal_model(oscillator)
        except ConditioningError:
            continue
        models += 1
        assert np.all(model.frequency_squared > 0.0)
        assert np.all(model.decay >= 0.0)
        assert np.all(np.isfinite(model.from_modal))
        assert np.all(np.isfinite(model.to_modal))
    assert 40 < models < 200
