"""Lyapunov exponents: of periodic points against their multipliers, of chaos against 30-digit runs, and of tori."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm
from scipy.stats import t as student

from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.runs import ANCHOR, FOLLOWED, HELD, OK, new_run
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.lyapunov import orthonormalise, standard_error
from grazemap_core.simulation.monodromy import linearised_run, monodromy
from grazemap_core.simulation.tolerances import EXPONENT_STUDENT, EXPONENT_WINDOWS, SHORTEST_WINDOW
from tests.oracles.chaos_oracle import ChaosOracle
from tests.oracles.exponents import lyapunov_exponents
from tests.support.oscillators import DEFAULT
from tests.support.tori import TORI

ONE_MASS = Oscillator.create([1.0], [1.0], 0.02, [1.0], 0.8)
CHAOS = (0.9545, 6.2047)

# of random chains, the ones whose orbit does not close: masses, stiffnesses, gamma, forcing, R, omega, clearance

SPIRALS = [
    ([1.5401548035374886, 0.407715679484185], [2.1266106867809014, 0.6620268602581201], 0.034815304850488796,
     [-0.5427170069129441, 0.6725739657460132], 0.5590638811131802, 0.7071106195438466, 0.0033395540690229005),
    # growth stays within bounds for a thousand periods, and drifts
    ([0.7742246975195367, 0.6392805355740568], [0.5876098363173868, 0.9839802237057361], 0.0142959117732826,
     [0.8076868253661926, 0.03921125556477345], 0.8042868729493512, 1.138412389370542, 0.6781972425025936),
]  # fmt: skip


def test_on_a_periodic_point_the_exponent_is_that_of_its_multiplier() -> None:
    point = monodromy(DEFAULT, 0.29, 1.6)  # 1-2r-2l
    start = (point.displacement, point.velocity)
    assert (point.period, point.closing < 1e-13) == (1, True)
    exponents = lyapunov_exponents(DEFAULT, 0.29, 1.6, *start, periods=2000, transient_periods=200)
    assert exponents.first_weighted == pytest.approx(point.exponent, abs=1e-9)
    np.testing.assert_allclose(exponents.final.displacement, point.displacement, atol=1e-10)
    np.testing.assert_allclose(exponents.final.velocity, point.velocity, atol=1e-10)
    # the plain mean only as c over the number of periods, with the c of where the columns began
    bare = lyapunov_exponents(DEFAULT, 0.29, 1.6, *start, periods=2000, transient_periods=0)
    away = np.abs(bare.running - point.exponent) * np.arange(1, 2001) * point.time
    assert np.all(away < 5.0)
    assert np.max(away[1000:]) > 0.1 * np.max(away)
    assert exponents.kind == "unresolved"  # negative: not for this function to name


def test_where_every_change_dies_out_the_exponent_is_minus_infinity() -> None:
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    exponents = lyapunov_exponents(oscillator, 0.2, 0.3, periods=40, transient_periods=10)
    assert (exponents.first, exponents.second, exponents.kind) == (-math.inf, -math.inf, "unresolved")


def test_growth_is_that_of_two_trajectories_in_30_digits() -> None:
    omega, clearance = 1.7182, 0.1536
    oracle = ChaosOracle(ONE_MASS, omega, clearance)
    x, v, direction = 0.3 * clearance, 0.1 * omega * clearance, np.array([1.0, 0.5])
    growth = oracle.growth(x, v, (1.0, 0.5), 12)
    assert oracle.impacts > 60
    for periods in (1, 4, 12):
        matrix = monodromy(ONE_MASS, omega, clearance, np.array([x]), np.array([v]), period=periods).matrix
        stretch = math.log(np.linalg.norm(matrix @ direction) / np.linalg.norm(direction))
        # the trajectory's own round-off grows as the change does, and within a period by more
        whole = np.sum(growth[:periods])
        assert stretch == pytest.approx(whole, abs=1e-12 * math.exp(whole))


def test_a_chaotic_exponent_and_its_error_bar_are_those_of_an_independent_30_digit_run() -> None:
    omega, clearance = CHAOS
    exponents = lyapunov_exponents(ONE_MASS, omega, clearance, periods=20_000, transient_periods=200)
    assert exponents.kind == "chaotic"
    assert exponents.first_error < 0.01 * exponents.first
    # another start, so another stretch of the attractor; its error from means of 50 periods
    growth = ChaosOracle(ONE_MASS, omega, clearance).growth(1.0, -0.3, (0.2, 1.0), 3050)[50:]
    means = growth.reshape(60, 50).mean(axis=1) * omega / (2.0 * math.pi)
    error = np.std(means, ddof=1) / math.sqrt(60)
    assert error < 0.03 * exponents.first
    assert abs(np.mean(means) - exponents.first) < 4.0 * math.hypot(error, exponents.first_error)
    # the error bar itself: runs that share nothing but the attractor scatter by it
    runs = [
        lyapunov_exponents(ONE_MASS, omega, clearance, np.array([0.1 * k]), periods=2000, transient_periods=100)
        for k in range(24)
    ]
    scatter = np.std([run.first for run in runs], ddof=1)
    assert 0.6 < scatter / np.mean([run.first_error for run in runs]) < 1.6
    assert abs(np.mean([run.first for run in runs]) - exponents.first) < 4.0 * math.hypot(
        scatter / math.sqrt(24), exponents.first_error
    )


@pytest.mark.thorough
def test_two_trajectories_part_at_the_rate_of_the_exponent() -> None:
    # no linearisation: a neighbour 1e-7 away, brought back to that distance every half period
    omega, clearance = 0.4857, 0.2834
    run = linearised_run(DEFAULT, omega, clearance, None, None, 0.0)
    weight = np.stack([run.forced.free.frequency, np.ones(3)], axis=1)
    other, total, count = new_run(3, 1, events=64), 0.0, 0
    away = np.full((3, 2), 1e-7)
    for half in range(200):
        away *= 1e-7 / np.linalg.norm(weight * away)
        other.u[:] = run.run.u + away
        other.cursor[:] = 0
        on_its_way = run.run.cursor[ANCHOR] == 0 or run.run.near[0] > 1e-3 * clearance
        if half >= 100 and run.run.cursor[HELD] == 0 and on_its_way:
            tangent = np.ascontiguousarray(away.reshape(6, 1))
            assert run_half(run.forced, run.stops, other, half) == OK
            run.advance(1, tangent)
            away = other.u - run.run.u
            linear, apart = np.linalg.norm(weight * tangent.reshape(3, 2)), np.linalg.norm(weight * away)
            if np.linalg.norm(tangent.reshape(3, 2) * weight) < 1e-5:  # else a near graze: far from linear
                total += abs(math.log(apart / linear))
                count += 1
        else:
            run.advance(1, np.zeros((6, 0)))
    assert count > 80
    assert total / count < 1e-5


def test_the_exponents_of_one_mass_add_up_to_the_loss_by_damping_and_impacts() -> None:
    omega, clearance = CHAOS
    exponents = lyapunov_exponents(ONE_MASS, omega, clearance, periods=300, transient_periods=0)
    run = linearised_run(ONE_MASS, omega, clearance, None, None, 0.0)
    impacts = 0
    for _ in range(600):
        run.advance(1, np.zeros((2, 0)))
        impacts += int(run.run.tally[FOLLOWED])
    expected = -0.04 + 2.0 * math.log(0.8) * impacts / (300 * run.period)
    assert exponents.first + exponents.second == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("numbers", TORI)
def test_a_torus_is_distinguished_from_chaos_and_stays_quasi_periodic(numbers: tuple) -> None:  # type: ignore[type-arg]
    oscillator = Oscillator.create(*numbers[:5])
    short = lyapunov_exponents(oscillator, *numbers[5:], periods=1000, transient_periods=400)
    long = lyapunov_exponents(oscillator, *numbers[5:], periods=8000, transient_periods=400)
    assert short.kind == long.kind == "quasi-periodic"
    assert abs(long.first_weighted) < 1e-8  # zero, since the forcing is one clock and the torus has another
    assert short.second == pytest.approx(long.second, abs=5.0 * (short.second_error + long.second_error))
    assert abs(short.first) < short.first_error


@pytest.mark.parametrize("numbers", SPIRALS)
def test_a_slow_spiral_is_no_torus(numbers: tuple) -> None:  # type: ignore[type-arg]
    oscillator = Oscillator.create(*numbers[:5])
    assert lyapunov_exponents(oscillator, *numbers[5:], periods=1000, transient_periods=400).kind == "unresolved"
    assert lyapunov_exponents(oscillator, *numbers[5:], periods=20_000, transient_periods=400).first_weighted < -1e-5


@pytest.mark.parametrize(("memory", "least"), [(0.0, 0.998), (0.9, 0.99)])
def test_a_series_with_memory_is_within_three_standard_errors(memory: float, least: float) -> None:
    # with memory of a quarter of a window neighbouring windows depend on each other
    series = lfilter([1.0], [1.0, -memory], np.random.default_rng(3).normal(size=(4000, 600)), axis=1)[:, 100:]
    means, errors = series.mean(axis=1), np.array([standard_error(row.copy(), 500) for row in series])
    assert least < np.mean(np.abs(means) < 3.0 * errors)
    assert np.median(errors) < 1.3 * np.std(means)


def test_the_factor_of_the_standard_error_is_students() -> None:
    expected = student.ppf(norm.cdf(3.0), EXPONENT_WINDOWS - 1) / 3.0
    assert expected == pytest.approx(EXPONENT_STUDENT, abs=1e-5)


def test_windows_of_too_few_periods_have_no_standard_error() -> None:
    fewest = EXPONENT_WINDOWS * SHORTEST_WINDOW
    assert standard_error(np.zeros(fewest - 1), fewest - 1) == np.inf
    assert standard_error(np.zeros(fewest), fewest) == 0.0


def test_columns_become_orthonormal_in_the_energy_norm() -> None:
    rng = np.random.default_rng(4)
    frequency, columns = rng.uniform(0.1, 10, 3), rng.normal(size=(6, 4))
    columns[:, 3] = columns[:, 0] - 2.0 * columns[:, 2]
    weight = np.stack([frequency, np.ones(3)], axis=1).ravel()[:, None]
    r = np.linalg.qr(weight * columns)[1]
    growth = np.empty(4)
    orthonormalise(frequency, columns, growth)
    np.testing.assert_allclose(growth[:3], np.log(np.abs(np.diag(r)[:3])), atol=1e-12)
    assert growth[3] == -np.inf
    gram = (weight * columns).T @ (weight * columns)
    np.testing.assert_allclose(gram, np.diag([1.0, 1.0, 1.0, 0.0]), atol=1e-13)
