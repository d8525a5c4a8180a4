"""Complete chatter and sticking against independent 50-digit arithmetic, and how a rest begins and ends."""

import math

import numpy as np
import pytest

from grazemap_core.codes import INFINITE
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.general_oracle import GeneralOracle
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import STICKING, sticking_case
from tests.support.thorough import KERNELS_FIRST, every_fourth

oracle = GeneralOracle.between


@pytest.mark.parametrize("seed", every_fourth(STICKING))
def test_accumulation_and_release_times_are_those_of_50_digits(seed: int) -> None:
    oscillator, omega, clearance = sticking_case(seed)
    count = 1 if oscillator.restitution > 0.9 else 2
    result = trajectory(oscillator, omega, clearance, periods=2, samples_per_period=40)
    exact = oracle(oscillator, omega, clearance)
    exact.run(until=4 * math.pi / omega, releases=count)
    assert len(exact.releases) == count
    np.testing.assert_array_equal(result.sticking.stop[:count], exact.held_on)
    np.testing.assert_allclose(result.sticking.start[:count], [float(t) for t in exact.rests], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        result.sticking.stop_time[:count], [float(t) for t in exact.releases], rtol=0, atol=1e-12
    )
    # the whole state where mass 1 leaves, by samples that were taken while it rested and after
    after = int(np.searchsorted(result.time, float(exact.releases[-1])))
    if not np.any((result.impacts.time > float(exact.releases[-1])) & (result.impacts.time < result.time[after])):
        x, v = exact.at(float(result.time[after]))[:2]
        np.testing.assert_allclose(result.displacement[:, after], [float(a) for a in x], rtol=0, atol=1e-12)
        np.testing.assert_allclose(result.velocity[:, after], [float(a) for a in v], rtol=0, atol=1e-12)
    kinds = set(result.impacts.kind.tolist())
    assert kinds == ({"impact"} if oscillator.restitution == 0.0 else {"impact", "chatter"})


def test_every_listed_impact_of_a_chatter_is_that_of_50_digits() -> None:
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    result = trajectory(oscillator, 0.2, 0.3, periods=1)
    exact = oracle(oscillator, 0.2, 0.3)
    exact.run(until=30.0, releases=1)
    count = int(np.argmax(result.impacts.kind == "chatter")) + 1
    assert count > 20
    np.testing.assert_allclose(result.impacts.time[:count], [float(t) for t in exact.times[:count]], rtol=0, atol=1e-12)
    # each to its own relative precision: the last ones are a million times slower than the first
    np.testing.assert_allclose(result.impacts.velocity[:count], [float(v) for v in exact.speeds[:count]], rtol=1e-11)


def test_mass_one_stays_on_the_stop_from_the_start_of_the_rest_to_the_release() -> None:
    oscillator, omega, clearance = sticking_case(9)
    result = trajectory(oscillator, omega, clearance, periods=2, samples_per_period=400)
    for start, stop_time, stop in zip(
        result.sticking.start, result.sticking.stop_time, result.sticking.stop, strict=True
    ):
        there = (result.time >= start) & (result.time <= stop_time)
        assert np.all(result.displacement[0, there] == stop * clearance)
        assert np.all(result.velocity[0, there] == 0.0)
    assert np.all(np.abs(result.displacement[0]) <= clearance * (1 + 1e-15))


def test_a_period_one_orbit_with_sticking_is_found_and_repeats() -> None:
    oscillator, omega, clearance = sticking_case(9)
    result = trajectory(oscillator, omega, clearance, periods=60, samples_per_period=8)
    motion = result.motion
    assert (motion.kind, motion.period, motion.sticking) == ("periodic", 1, True)
    assert INFINITE in (motion.impacts_right, motion.impacts_left)
    period = 2 * math.pi / omega
    late = result.sticking.stop_time > 40 * period
    releases = np.mod(result.sticking.stop_time[late][:-1], period)
    for release in releases:
        assert np.sum(np.abs(releases - release) < 1e-12 * period) >= 15
    np.testing.assert_allclose(result.displacement[:, -8:], result.displacement[:, -16:-8], rtol=0, atol=1e-12)
    # the orbit itself, one period on in 50 digits from a state of it, comes back to that state
    start = {"displacement": result.displacement[:, -9].tolist(), "velocity": result.velocity[:, -9].tolist()}
    again = trajectory(
        oscillator,
        omega,
        clearance,
        result.displacement[:, -9],
        result.velocity[:, -9],
        periods=1,
        samples_per_period=8,
    )
    np.testing.assert_allclose(again.displacement[:, -1], start["displacement"], rtol=0, atol=1e-12)
    exact = oracle(oscillator, omega, clearance, **start)
    exact.run(until=period, releases=1)
    assert again.sticking.stop_time[0] == pytest.approx(float(exact.releases[0]), abs=1e-12)


@pytest.mark.parametrize("restitution", [0.2, 0.8, 0.95, 0.999])
def test_a_constant_force_gives_the_geometric_series_of_the_bouncing_ball(restitution: float) -> None:
    # force 1 on mass 1, as good as constant and without a spring: bounces last 2 R^k w, all of them 2 w/(1 - R)
    ball = Oscillator.create([1.0], [1e-13], 0.0, [1.0], restitution)
    result = trajectory(
        ball, 1e-7, 1.0, np.array([1.0]), np.array([-1e-2]), phase=math.pi / 2, periods=1, samples_per_period=1
    )
    assert result.sticking.start[0] == pytest.approx(2e-2 / (1 - restitution), rel=1e-12)


def test_a_complete_chatter_of_a_hundred_thousand_bounces_is_followed_to_its_end() -> None:
    ball = Oscillator.create([1.0], [1e-13], 0.0, [1.0], 0.9999)
    x, v = np.array([1.0]), np.array([-2e-3])
    result = trajectory(ball, 1e-3, 1.0, x, v, phase=math.pi / 2, periods=1, samples_per_period=1)
    chatter = int(np.argmax(result.impacts.kind == "chatter"))
    assert chatter > 80_000
    # 2 w/(1 - R) under a steady unit force; this one falls off as cos(1e-3 t), which makes it longer by less than 3e-4
    assert 40.0 < result.sticking.start[0] < 40.0 * (1 + 3e-4)
    # each bounce loses the same share, up to the change of the force from one to the next
    speeds = np.abs(result.impacts.velocity[:chatter])
    np.testing.assert_allclose(speeds[1:] / speeds[:-1], 0.9999, rtol=1e-6)


@pytest.mark.parametrize("restitution", [1.0, pytest.param(1.0 - 1e-7, marks=pytest.mark.thorough)])
def test_bounces_that_practically_never_end_are_stopped_with_a_reason(restitution: float) -> None:
    ball = Oscillator.create([1.0], [1e-13], 0.0, [1.0], restitution)
    x, v = np.array([1.0]), np.array([-1e-5])
    start = {"phase": math.pi / 2, "periods": 1, "samples_per_period": 1}
    result = trajectory(ball, 1e-3, 1.0, x, v, **start)
    assert result.motion.kind == "unresolved"
    assert (result.motion.reason or "").startswith("too many impacts")
    # what was followed is right: bounces of 2 v under unit force, each as long as the one before
    np.testing.assert_allclose(np.diff(result.impacts.time[:1000]), 2e-5, rtol=1e-3)
    assert len(result.impacts.time) > 300_000
    # pressed on the stop at no speed at all, mass 1 stays there
    rests = trajectory(ball, 1e-3, 1.0, x, np.zeros(1), **start)
    assert rests.sticking.start[0] == 0.0
    assert rests.sticking.stop_time[0] == pytest.approx(math.pi / 2 / 1e-3, rel=1e-9)


def test_a_start_at_rest_on_a_stop_stays_when_pressed_and_leaves_when_not() -> None:
    oscillator = Oscillator.create([1.0, 2.0], [1.0, 1.0], 0.1, [1.0, 0.0], 0.7)
    x, v = np.array([0.1, 0.0]), np.zeros(2)
    pressed = trajectory(oscillator, 0.3, 0.1, x, v, phase=math.pi / 2, periods=1)
    exact = oracle(oscillator, 0.3, 0.1, displacement=[0.1, 0.0], velocity=[0.0, 0.0], phase=math.pi / 2)
    exact.run(until=20.0, releases=1)
    assert pressed.sticking.start[0] == 0.0
    assert pressed.sticking.stop_time[0] == pytest.approx(float(exact.releases[0]), abs=1e-12)
    assert np.all(pressed.displacement[0, pressed.time <= pressed.sticking.stop_time[0]] == 0.1)
    assert not np.any(pressed.impacts.time < pressed.sticking.stop_time[0])
    free = trajectory(oscillator, 0.3, 0.1, x, v, phase=-math.pi / 2, periods=1)
    assert not np.any(free.sticking.start == 0.0)
    assert not np.any(free.impacts.time < 0.05)
    assert free.displacement[0, 1] < 0.1


def test_the_record_may_begin_and_end_at_rest() -> None:
    oscillator, omega, clearance = sticking_case(9)
    period = 2 * math.pi / omega
    whole = trajectory(oscillator, omega, clearance, periods=6, samples_per_period=16)
    tail = trajectory(oscillator, omega, clearance, periods=3, transient_periods=3, samples_per_period=16)
    np.testing.assert_allclose(tail.displacement, whole.displacement[:, 48:], rtol=0, atol=1e-12)
    late = whole.sticking.stop_time > 3 * period
    np.testing.assert_allclose(
        tail.sticking.start, np.maximum(whole.sticking.start[late] - 3 * period, 0.0), rtol=0, atol=1e-11
    )
    np.testing.assert_allclose(tail.sticking.stop_time, whole.sticking.stop_time[late] - 3 * period, rtol=0, atol=1e-11)


@pytest.mark.parametrize("damping", [0.05, [0.1, 0.0, 0.3, 0.2]])
def test_the_chain_held_by_a_resting_mass_has_its_own_matrices(damping: object) -> None:
    oscillator = Oscillator.create([1.0, 10.0, 0.5, 2.0], [3.0, 5.0, 1e3, 0.2], damping, [1.0, 0, 0, 0], 0.8)
    model = trajectory_models(oscillator).held
    assert model is not None
    stiffness, drag = oscillator.stiffness_matrix[1:, 1:], oscillator.damping_matrix[1:, 1:]
    mass = oscillator.masses[1:, None]
    first_order = np.block([[np.zeros((3, 3)), np.eye(3)], [-stiffness / mass, -drag / mass]])
    blocks = np.zeros((6, 6))
    for j in range(3):
        blocks[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [
            [0.0, 1.0],
            [-model.frequency_squared[j], -2 * model.decay[j]],
        ]
    rebuilt = model.from_modal @ blocks @ model.to_modal
    np.testing.assert_allclose(rebuilt, first_order, rtol=0, atol=1e-10)
    np.testing.assert_allclose(model.to_modal @ model.from_modal, np.eye(6), atol=1e-11)


def test_points_that_chatter_in_their_transient_settle() -> None:
    omega, clearance = np.linspace(0.262, 0.27, 3), np.linspace(1.3, 1.4, 3)
    result = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance), MapSettings(max_periods=400))
    assert not np.any(result["reason"] == 4)


@pytest.mark.parametrize(
    ("oscillator", "omega", "clearance"),
    [
        (Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.2), 0.28, 0.5),
        pytest.param(Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8), 0.2, 0.3, marks=KERNELS_FIRST),
    ],
    ids=["three masses", "one mass"],
)
def test_a_point_of_a_map_that_rests_on_both_stops_is_named(
    oscillator: Oscillator, omega: float, clearance: float
) -> None:
    result = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), np.array([clearance])))
    assert (result["period"][0, 0], bool(result["sticking"][0, 0])) == (1, True)
    assert result["impacts_right"][0, 0] == result["impacts_left"][0, 0] == INFINITE
    assert result["least_impact_velocity"][0, 0] == 0.0
