"""The linearised flow against differences of 50-digit runs, closed forms, and the invariants that it must have."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from grazemap_core.contact.kernels.runs import (
    CHATTER,
    EVENT_COLUMNS,
    EVENT_COUNT,
    HELD,
    IMPACT,
    IMPACT_AND_REST,
    KIND,
    OK,
    RECORD_FULL,
    RELEASE,
    STOP,
    TIME,
    new_run,
)
from grazemap_core.errors import LinearisationError, ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.kernels.eigenvalues import QR_NOT_CONVERGED, eigenvalues
from grazemap_core.simulation.kernels.lyapunov import begin_matrix, leading_multiplier, tangents
from grazemap_core.simulation.kernels.tangent import GRAZED, carry_tangent, run_half_linearised
from grazemap_core.simulation.monodromy import linearised_run, monodromy
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.steady_displacements import contact_amplitude
from tests.oracles.tangent_oracle import difference
from tests.support.oscillators import DEFAULT, first_order

PHASE = 0.7


def random_case(seed: int) -> tuple[Oscillator, float, float, np.ndarray, np.ndarray, np.ndarray]:
    """A chain of 1..4 masses, R in {0, 0.3, 0.8, 1}, either kind of damping, a state, and a direction from it."""
    rng = np.random.default_rng(seed)
    count = 1 + seed % 4
    restitution = [0.0, 0.3, 0.8, 1.0][(seed // 4) % 4]
    damping = float(rng.uniform(0.01, 0.3)) if (seed // 16) % 2 else rng.uniform(0.01, 0.4, count)
    forcing = rng.uniform(-1, 1, count)
    forcing[0] = 1.0
    oscillator = Oscillator.create(
        rng.uniform(0.5, 3, count), rng.uniform(0.5, 3, count), damping, forcing, restitution
    )
    omega = float(rng.uniform(0.3, 1.2))
    clearance = float(rng.uniform(0.2, 0.8)) * contact_amplitude(oscillator, omega)
    x = rng.uniform(-0.5, 0.5, count) * clearance
    v = rng.uniform(-0.5, 0.5, count) * omega * clearance
    return oscillator, omega, clearance, x, v, rng.normal(size=2 * count)


# what happens in the period: by seed, so that every kind of event and both dampings come with every number of masses
SEEDS = {
    4: {IMPACT}, 8: {IMPACT}, 28: {IMPACT}, 16: {IMPACT_AND_REST, RELEASE}, 20: {IMPACT, CHATTER, RELEASE},
    5: {IMPACT, CHATTER, RELEASE}, 13: {IMPACT}, 21: {IMPACT, CHATTER, RELEASE}, 1: {IMPACT_AND_REST, RELEASE},
    2: {IMPACT, IMPACT_AND_REST, RELEASE}, 10: {IMPACT}, 14: {IMPACT}, 22: {IMPACT, CHATTER, RELEASE},
    3: {IMPACT, IMPACT_AND_REST, RELEASE}, 15: {IMPACT}, 23: {IMPACT}, 27: {IMPACT},
}  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_changes_evolve_as_the_difference_of_two_50_digit_runs(seed: int) -> None:
    oscillator, omega, clearance, x, v, direction = random_case(seed)
    exact, end = difference(
        oscillator, omega, clearance, x.tolist(), v.tolist(), direction.tolist(), periods=1, phase=PHASE
    )
    result = monodromy(oscillator, omega, clearance, x, v, PHASE, period=1)
    size = np.max(np.abs(result.matrix)) * np.max(np.abs(direction))
    np.testing.assert_allclose(result.matrix @ direction, exact, rtol=0, atol=1e-13 * size)
    run = linearised_run(oscillator, omega, clearance, x, v, PHASE)
    seen = set()
    for _ in range(2):
        run.advance(1, np.zeros((2 * oscillator.size, 0)))
        seen |= set(run.run.events[: run.run.cursor[EVENT_COUNT], KIND].astype(int).tolist())
    # the rounding of an input travels as any other change does
    carried = max(1.0, float(np.max(np.abs(result.matrix))))
    np.testing.assert_allclose(run.physical_state, end, rtol=0, atol=1e-13 * carried * (clearance + omega * clearance))
    assert seen == SEEDS[seed]


def test_a_period_that_ends_and_begins_at_rest_is_the_product_of_its_parts() -> None:
    # half periods from every phase: some of them end while mass 1 rests, and the next goes on from there
    oscillator, omega, clearance, x, v, direction = random_case(22)
    at_rest = 0
    for phase in np.linspace(0.0, math.pi, 8, endpoint=False):
        run = linearised_run(oscillator, omega, clearance, x, v, phase)
        whole = np.eye(6)
        run.advance(1, whole)
        at_rest += run.run.cursor[HELD] != 0
        run.advance(1, whole)
        if run.run.cursor[HELD] == 0 and at_rest == 1:
            exact, _ = difference(
                oscillator, omega, clearance, x.tolist(), v.tolist(), direction.tolist(), periods=1, phase=phase
            )
            matrix = run.forced.held.from_free @ whole @ run.forced.held.to_free
            np.testing.assert_allclose(matrix @ direction, exact, rtol=0, atol=1e-13 * np.max(np.abs(matrix)))
    assert at_rest >= 1


@pytest.mark.parametrize("seed", [4, 8, 9, 10, 11, 12, 13, 14, 15, 26, 27])
def test_every_impact_multiplies_the_volume_by_the_square_of_the_restitution(seed: int) -> None:
    # det M = exp(T trace) R^(2 impacts), whatever the speeds
    oscillator, omega, clearance, x, v, _ = random_case(seed)
    result = monodromy(oscillator, omega, clearance, x, v, PHASE, period=1)
    impacts = trajectory(oscillator, omega, clearance, x, v, PHASE, periods=1).impacts
    assert "chatter" not in impacts.kind
    assert len(impacts.time) >= 1
    sign, logarithm = np.linalg.slogdet(result.matrix)
    expected = np.trace(first_order(oscillator)) * result.time
    expected += 2.0 * len(impacts.time) * math.log(oscillator.restitution)
    assert sign == 1.0
    assert logarithm == pytest.approx(expected, abs=1e-15 * np.linalg.cond(result.matrix) + 1e-12)


@pytest.mark.parametrize(("seed", "lost"), [(0, 1), (1, 2), (3, 2), (22, 2)])
def test_rank_falls_by_one_with_an_impact_without_rebound_and_by_two_with_a_rest(seed: int, lost: int) -> None:
    oscillator, omega, clearance, x, v, _ = random_case(seed)
    singular = np.linalg.svd(monodromy(oscillator, omega, clearance, x, v, PHASE, period=1).matrix, compute_uv=False)
    kept = 2 * oscillator.size - lost
    assert np.all(singular[kept:] < 1e-14 * singular[0])
    assert singular[kept - 1] > 1e-10 * singular[0]


def test_neighbouring_motions_of_a_single_mass_that_rests_become_equal_to_it() -> None:
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    result = monodromy(oscillator, 0.2, 0.3)
    assert result.period == 1
    assert np.all(result.matrix == 0.0)
    assert result.exponent == -math.inf


def test_one_impact_a_period_has_the_multipliers_of_its_closed_form() -> None:
    # det(mu I - M) = det(mu I - e^(A T)) chi(mu)/v, from periodic sums of the impulse response g and the impact's speed
    omega, clearance = 0.27, 1.85
    result = monodromy(DEFAULT, omega, clearance, period=None)
    there = trajectory(DEFAULT, omega, clearance, result.displacement, result.velocity, periods=1)
    assert (result.period, len(there.impacts.time)) == (1, 1)
    period = 2.0 * math.pi / omega
    matrix = first_order(DEFAULT)
    flow, unit = expm(matrix * period), np.eye(6)[3]

    def sums(mu: complex) -> tuple[complex, complex, complex]:
        """Sums over k of mu^-k (g, g', g'')(k T)."""
        total = np.linalg.solve(mu * np.eye(6) - flow, flow @ unit)
        return total[0], total[3], (matrix @ total)[3]

    speed, factor = abs(there.impacts.velocity[0]), 1.8
    h, _, bend = sums(1.0)
    for mu in (0.3, -0.4, 0.2 + 0.5j, 2.0, *result.multipliers):
        at, slope, second = sums(mu)
        chi = speed * (1.0 + factor * slope) ** 2 + factor * at * (
            omega**2 * (clearance + factor * speed * h) + factor * speed * (bend - second)
        )
        expected = np.linalg.det(mu * np.eye(6) - flow) * chi / speed
        product = np.prod(mu - result.multipliers)
        assert abs(product - expected) < 1e-11


def test_free_motion_has_the_multipliers_of_its_exponents() -> None:
    oscillator = Oscillator.create([1.0, 2.0, 0.5], [1.0, 3.0, 2.0], [0.1, 0.4, 0.2], [1.0, 0.0, 0.3], 0.7)
    result = monodromy(oscillator, 0.8, 10.0 * contact_amplitude(oscillator, 0.8))
    np.testing.assert_allclose(
        result.matrix, expm(first_order(oscillator) * result.time), rtol=0, atol=1e-13 * np.max(np.abs(result.matrix))
    )


def test_multipliers_are_those_of_the_motion_wherever_it_is_cut() -> None:
    whole = monodromy(DEFAULT, 0.29, 1.6)
    assert (whole.period, whole.closing < 1e-13) == (1, True)
    quarter = trajectory(DEFAULT, 0.29, 1.6, whole.displacement, whole.velocity, periods=1, samples_per_period=4)
    other = monodromy(
        DEFAULT, 0.29, 1.6, quarter.displacement[:, 1], quarter.velocity[:, 1], phase=math.pi / 2, period=1
    )
    np.testing.assert_allclose(np.abs(other.multipliers), np.abs(whole.multipliers), rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("omega", "clearance", "symmetric", "period"), [(0.29, 1.6, True, 1), (0.27, 1.85, False, 1), (0.27, 1.4, True, 1)]
)
def test_the_multiplier_for_maps_is_the_largest_of_the_matrix(
    omega: float, clearance: float, symmetric: bool, period: int
) -> None:
    whole = monodromy(DEFAULT, omega, clearance)
    motion = trajectory(DEFAULT, omega, clearance, transient_periods=300).motion
    assert (motion.period, motion.symmetric, whole.period) == (period, symmetric, period)
    run = linearised_run(DEFAULT, omega, clearance, whole.displacement, whole.velocity, 0.0)
    scratch = tangents(3)
    begin_matrix(scratch)
    halves = period if symmetric else 2 * period
    run.advance(halves, scratch.full)
    modulus = leading_multiplier(run.forced.free, scratch) ** (2 if symmetric else 1)
    assert modulus == pytest.approx(abs(whole.multipliers[0]), abs=1e-11)


def test_a_record_that_is_too_short_leaves_everything_as_it_was() -> None:
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.95)
    run = linearised_run(oscillator, 0.02, 0.3, None, None, 0.0)
    before, tangent = run.run.u.copy(), np.eye(2)
    short = run.run._replace(events=np.zeros((8, EVENT_COLUMNS + 2)))
    assert run_half_linearised(run.forced, run.stops, short, 0, tangent, run.began) == RECORD_FULL
    assert np.all(run.run.u == before)
    assert np.all(tangent == np.eye(2))
    assert np.all(short.cursor == 0)
    run.advance(1, tangent)  # makes it longer by itself
    assert len(run.run.events) > 64


def test_a_graze_has_no_derivative() -> None:
    run = linearised_run(DEFAULT, 0.29, 1.6, None, None, 0.0)
    grazing = new_run(3, 1, events=1)
    grazing.cursor[EVENT_COUNT] = 1
    grazing.events[0, [TIME, STOP]] = 1.0, 1.0
    # as Python: no result calls it by itself, and compiling it takes long
    assert carry_tangent.py_func(run.forced, run.stops, grazing, 0, False, np.eye(6)) == GRAZED
    with pytest.raises(LinearisationError, match="graze"):
        run.require(GRAZED)


def test_a_motion_that_does_not_settle_has_no_multipliers() -> None:
    with pytest.raises(LinearisationError, match="did not close"):
        monodromy(Oscillator.create([1.0], [1.0], 0.02, [1.0], 0.8), 1.7182, 0.1536, max_periods=50)
    with pytest.raises(ParameterError, match="period"):
        monodromy(DEFAULT, 0.29, 1.6, period=0)


def test_eigenvalues_of_small_matrices() -> None:
    rng = np.random.default_rng(0)
    for trial in range(400):
        n = int(rng.integers(1, 11))
        matrix = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-6, 6)
        if trial % 4 == 1:
            matrix = np.roll(np.eye(n), 1, axis=0)  # all on one circle: only an exceptional shift gets on
        if trial % 4 == 2:
            matrix = np.outer(matrix[0], matrix[-1])
        if trial % 4 == 3:
            matrix = np.linalg.qr(matrix)[0]
        real, imaginary = np.empty(n), np.empty(n)
        assert eigenvalues(matrix.copy(), real, imaginary) == OK
        spectrum, norm = real + 1j * imaginary, np.linalg.norm(matrix)
        for value in spectrum:  # each is exact for a matrix this close
            assert np.linalg.svd(matrix - value * np.eye(n), compute_uv=False)[-1] < 1e-14 * norm
        coefficients = np.poly(spectrum / norm)
        np.testing.assert_allclose(coefficients, np.poly(matrix / norm), rtol=0, atol=1e-12)
    assert eigenvalues(np.array([[1.0, np.nan], [0.0, 1.0]]), np.empty(2), np.empty(2)) == QR_NOT_CONVERGED
