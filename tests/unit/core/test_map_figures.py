"""The numbers that a map has of its motions, and the starts of its trajectories."""

import numpy as np
import pytest

from grazemap_core.codes import NOT_CLOSED, RESOLVED
from grazemap_core.errors import LinearisationError
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import MapSettings, RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.unfolding import named_arrays, unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.exponents import lyapunov_exponents
from tests.oracles.steady_displacements import contact_amplitude
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST, the_first
from tests.support.tori import TORI

PER_LINK = Oscillator.create([1.0, 4.0, 2.0], [1.0, 2.0, 3.0], [0.08, 0.03, 0.05], [1.0, 0.2, 0.0], 0.6)
STICKY = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.3)
PERIODIC, QUASI_PERIODIC, CHAOTIC, UNRESOLVED = (
    KINDS.index(kind) for kind in ("periodic", "quasi-periodic", "chaotic", "unresolved")
)


@pytest.mark.parametrize(
    ("oscillator", "omega"), the_first(2, [(DEFAULT, 0.45), (PER_LINK, 0.6), (DEFAULT, 0.28), (STICKY, 0.3)])
)
def test_multipliers_are_those_of_the_motion(oscillator: Oscillator, omega: float) -> None:
    clearances = np.linspace(0.5, 1.05, 36) * contact_amplitude(oscillator, omega)
    tile = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), clearances))
    compared = 0
    for i in np.flatnonzero(tile["kind"][:, 0] == PERIODIC):
        period, multiplier = int(tile["period"][i, 0]), tile["multiplier"][i, 0]
        try:
            expected = monodromy(oscillator, omega, clearances[i])
        except LinearisationError:  # without Newton's method it has not come close enough in as many periods
            continue
        if expected.period != period:  # another motion, which can be where several exist
            continue
        largest = abs(expected.multipliers[0])
        assert multiplier == pytest.approx(largest, rel=1e-7, abs=1e-9), clearances[i]
        with np.errstate(divide="ignore"):
            assert tile["lyapunov"][i, 0] == pytest.approx(np.log(multiplier) / period, rel=1e-12)
        assert multiplier < 1.0
        compared += 1
    assert compared >= 12
    assert tile["sticking"].any() == (oscillator is STICKY)


def test_without_impacts_the_slowest_mode_gives_the_exponent() -> None:
    for oscillator, omega in ((DEFAULT, 0.29), (PER_LINK, 0.6)):
        clearance = 3.0 * contact_amplitude(oscillator, omega)
        tile = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), np.array([clearance])))
        assert tile["impacts_right"][0, 0] == -1
        expected = monodromy(oscillator, omega, clearance, period=1)
        assert tile["multiplier"][0, 0] == pytest.approx(abs(expected.multipliers[0]), rel=1e-11)
        assert tile["lyapunov"][0, 0] == pytest.approx(np.log(abs(expected.multipliers[0])), rel=1e-11)


def test_an_exponent_is_finite_where_its_multiplier_underflows() -> None:
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([5e-5, 1e-4]), np.array([5.0])), MapSettings(5, 1))
    assert tile["multiplier"][0, 0] == 0.0
    assert tile["lyapunov"][0, 0] == pytest.approx(2.0 * tile["lyapunov"][0, 1], rel=1e-9)
    assert np.isfinite(tile["lyapunov"]).all()


def test_chaos_is_named_with_its_exponent() -> None:
    clearances = np.linspace(1.2, 2.1, 32)
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.28]), clearances))
    chaotic = np.flatnonzero(tile["kind"][:, 0] == CHAOTIC)
    assert len(chaotic) >= 1
    for i in chaotic[:2]:
        expected = lyapunov_exponents(DEFAULT, 0.28, clearances[i], periods=1000, transient_periods=500)
        assert expected.kind == "chaotic"
        period = 2.0 * np.pi / 0.28
        # the map measures over half as long, so its error is larger by sqrt(2)
        assert (
            abs(tile["lyapunov"][i, 0] - expected.first * period) < 6.0 * np.sqrt(3.0) * expected.first_error * period
        )
        assert tile["lyapunov"][i, 0] > 0.0
        assert tile["lyapunov_error"][i, 0] == pytest.approx(
            np.sqrt(2.0) * expected.first_error * period, rel=0.6
        )  # itself good to 13 % each, of a series that is correlated
        assert np.isnan(tile["multiplier"][i, 0])
        assert tile["period"][i, 0] == 0
    periodic = tile["kind"][:, 0] == PERIODIC
    assert np.isnan(tile["lyapunov_error"][periodic, 0]).all()


def test_chaos_with_uneven_growth_is_named() -> None:
    """Its exponent is within five standard errors of zero after 500 periods, beyond them after 4000."""
    omega, clearances = np.array([0.297]), np.linspace(1.33, 1.385, 96)
    short = unfolding_map_tile(Plane.of(DEFAULT, omega, clearances), MapSettings(max_periods=500))
    uneven = ((short["kind"] == CHAOTIC) & (short["lyapunov"] < 5.0 * short["lyapunov_error"]))[:, 0]
    assert uneven.sum() >= 8
    long = unfolding_map_tile(Plane.of(DEFAULT, omega, clearances[uneven]), MapSettings(max_periods=4000))
    assert (long["lyapunov"] > 5.0 * long["lyapunov_error"]).mean() > 0.8
    assert (long["kind"] == CHAOTIC).all()
    # with less time it is not told
    brief = unfolding_map_tile(Plane.of(DEFAULT, omega, clearances[uneven]), MapSettings(max_periods=150))
    assert (brief["kind"] == UNRESOLVED).mean() > 0.8


def test_growth_along_lanes_is_that_along_one_trajectory() -> None:
    """Motions that are not named because they take two periods and more, and go on with growth until the last one."""
    clearances = np.linspace(1.2, 2.1, 64)
    task = RunSettings(80, 1, early=False)
    codes, figures = PlaneRunner(Plane.of(DEFAULT, np.array([0.27]), clearances), task).grid()
    exponents = figures[lane_state.LYAPUNOV, :, 0, 0] / (2.0 * np.pi / 0.27)
    grown = np.flatnonzero((codes[lane_state.REASON, :, 0, 0] == NOT_CLOSED) & np.isfinite(exponents))
    compared = 0
    for i in grown:
        after_a_quarter = trajectory(DEFAULT, 0.27, clearances[i], periods=20, samples_per_period=1)
        x, v = after_a_quarter.displacement[:, -1], after_a_quarter.velocity[:, -1]
        expected = lyapunov_exponents(DEFAULT, 0.27, clearances[i], x, v, periods=56, transient_periods=4)
        if expected.first < 0.0:  # else round-off grows
            assert exponents[i] == pytest.approx(expected.first, abs=1e-9)
            compared += 1
    assert compared >= 5


def test_a_torus_is_not_chaotic_where_the_growth_of_all_windows_is_the_same() -> None:
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.2860869565217391]), np.array([1.5010443864229766])))
    assert tile["kind"][0, 0] != CHAOTIC
    assert abs(tile["lyapunov"][0, 0]) < tile["lyapunov_error"][0, 0]


@KERNELS_FIRST
@pytest.mark.parametrize("numbers", TORI)
def test_a_motion_on_a_torus_is_named(numbers: tuple) -> None:  # type: ignore[type-arg]
    oscillator, omega, clearance = Oscillator.create(*numbers[:5]), numbers[5], numbers[6]
    tile = unfolding_map_tile(
        Plane.of(oscillator, np.array([omega]), np.array([clearance])), MapSettings(max_periods=2500)
    )
    assert tile["kind"][0, 0] == QUASI_PERIODIC
    assert abs(tile["lyapunov"][0, 0]) < 1e-3
    assert tile["settled_after"][0, 0] == -1


def test_verified_motions_are_those_that_trajectories_settle_to() -> None:
    rng = np.random.default_rng(3)
    clearances = np.sort(rng.uniform(1.2, 2.1, 96))
    omegas = rng.uniform(0.26, 0.32, 5)
    quick, _ = PlaneRunner(Plane.of(DEFAULT, omegas, clearances), RunSettings(1000, 32)).grid()
    slow, _ = PlaneRunner(Plane.of(DEFAULT, omegas, clearances), RunSettings(1000, 32, early=False)).grid()
    named = (quick[lane_state.REASON] == 0) & (slow[lane_state.REASON] == 0)
    assert named.mean() > 0.8
    assert (quick[lane_state.REASON] == 0).sum() >= (slow[lane_state.REASON] == 0).sum()
    same = quick[lane_state.PERIOD] == slow[lane_state.PERIOD]
    for row, other in (
        (lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT),
        (lane_state.SYMMETRIC, lane_state.SYMMETRIC),
        (lane_state.STICKING, lane_state.STICKING),
    ):
        same &= np.minimum(quick[row], quick[other]) == np.minimum(slow[row], slow[other])
        same &= np.maximum(quick[row], quick[other]) == np.maximum(slow[row], slow[other])
    assert same[named].all()
    assert quick[lane_state.HALVES_RUN].sum() < slow[lane_state.HALVES_RUN].sum()


def test_a_sweep_follows_its_motion() -> None:
    """Up and down, a sweep stays on a branch past where rest leads elsewhere; every column on its own."""
    omega, clearances = np.array([0.27, 0.281]), np.linspace(1.5, 1.9, 41)
    maps = {
        policy: unfolding_map_tile(Plane.of(DEFAULT, omega, clearances), MapSettings(400, policy=policy))
        for policy in ("rest", "sweep-up", "sweep-down")
    }
    for policy in ("sweep-up", "sweep-down"):
        alone = unfolding_map_tile(Plane.of(DEFAULT, omega[1:], clearances), MapSettings(400, policy=policy))
        for name, array in alone.items():
            assert array.tobytes() == maps[policy][name][:, 1:].tobytes(), name
        # it begins at rest at its first clearance
        first = 0 if policy == "sweep-up" else -1
        for name in ("period", "impacts_right", "impacts_left"):
            np.testing.assert_array_equal(maps[policy][name][first], maps["rest"][name][first])
        # where it goes on, it is settled much sooner than from rest
        both = (maps[policy]["kind"] == PERIODIC) & (maps["rest"]["kind"] == PERIODIC)
        after = maps[policy]["settled_after"][both], maps["rest"]["settled_after"][both]
        assert np.median(after[0]) < np.median(after[1])
    labels = {
        policy: np.stack([tile[name] for name in ("kind", "period", "impacts_right", "impacts_left")])
        for policy, tile in maps.items()
    }
    assert (labels["sweep-up"] != labels["sweep-down"]).any()


@pytest.mark.parametrize("policy", ["sweep-up", "sweep-down"])
def test_a_sweep_continues_from_the_final_state_of_the_previous_point(policy: str) -> None:
    """The same sweep by single trajectories, each from the last one's end, settled to round-off."""
    omega, clearances = 0.27, np.linspace(1.6, 1.7, 6)
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([omega]), clearances), MapSettings(policy=policy))
    order = range(6) if policy == "sweep-up" else range(5, -1, -1)
    displacement, velocity = np.zeros(3), np.zeros(3)
    compared = 0
    for i in order:
        if abs(displacement[0]) >= clearances[i]:
            displacement = displacement.copy()
            displacement[0] = np.copysign(clearances[i], displacement[0])
        whole = trajectory(
            DEFAULT,
            omega,
            clearances[i],
            displacement,
            velocity,
            transient_periods=1500,
            periods=4,
            samples_per_period=1,
        )
        displacement, velocity = whole.displacement[:, -1], whole.velocity[:, -1]
        if KINDS[tile["kind"][i, 0]] == whole.motion.kind == "periodic":
            assert tile["period"][i, 0] == whole.motion.period
            assert sorted([tile["impacts_right"][i, 0], tile["impacts_left"][i, 0]]) == sorted(
                [whole.motion.impacts_right, whole.motion.impacts_left]
            )
            compared += 1
    assert compared


def test_an_ensemble_counts_the_motions_to_which_its_states_lead() -> None:
    omega, clearances = np.array([0.29]), np.array([1.9, 1.9927])
    tile = unfolding_map_tile(
        Plane.of(DEFAULT, omega, clearances), MapSettings(policy="ensemble", initial_conditions=12, seed=4)
    )
    again = unfolding_map_tile(
        Plane.of(DEFAULT, omega, clearances[1:]), MapSettings(policy="ensemble", initial_conditions=12, seed=4)
    )
    for name, array in again.items():
        assert array.tobytes() == tile[name][1:].tobytes(), name
    starts = np.random.default_rng(4).uniform(-1.0, 1.0, (12, 2, 3))
    # at the second, one touches no stop and one has the period 3
    for i, clearance in enumerate(clearances):
        motions = []
        for x, v in starts:
            whole = trajectory(
                DEFAULT,
                0.29,
                clearance,
                clearance * x,
                clearance * 0.29 * v,
                transient_periods=1500,
                periods=4,
                samples_per_period=1,
            )
            motions.append((whole.motion.period, *sorted([whole.motion.impacts_right, whole.motion.impacts_left])))
        counts = {motion: motions.count(motion) for motion in motions}
        here = (tile["period"][i, 0], *sorted([tile["impacts_right"][i, 0], tile["impacts_left"][i, 0]]))
        assert tile["share"][i, 0] == max(counts.values()) / 12.0 == counts[here] / 12.0
        assert tile["motions_found"][i, 0] == len(counts)
    assert (tile["motions_found"] > 1).any()


def test_of_equally_frequent_motions_the_first_counts_and_unresolved_ones_only_where_there_is_no_other() -> None:
    """Planted: a period for each of four initial states; 0 stands for an unresolved motion."""
    points = {
        (2, 1, 1, 2): (0, 0.5, 2),
        (3, 2, 3, 1): (0, 0.5, 3),
        (0, 0, 0, 4): (3, 0.25, 1),
        (0, 0, 0, 0): (0, 1.0, 0),
    }
    codes = np.zeros((lane_state.CODES, 1, len(points), 4), dtype=np.int64)
    codes[lane_state.PERIOD, 0] = list(points)
    codes[lane_state.REASON] = np.where(codes[lane_state.PERIOD] == 0, NOT_CLOSED, RESOLVED)
    codes[lane_state.IMPACTS] = np.arange(4)  # does not name a motion
    figures = np.tile(np.arange(4.0), (lane_state.FIGURES, 1, len(points), 1))
    arrays = named_arrays(codes, figures, MapSettings(policy="ensemble"), mirrors=True)
    named = zip(arrays["multiplier"][0], arrays["share"][0], arrays["motions_found"][0], strict=True)
    assert list(named) == list(points.values())


@pytest.mark.parametrize(("mirrors", "share", "count"), [(True, 10 / 16, 2), (False, 6 / 16, 3)])
def test_mirror_images_are_one_motion_only_between_symmetric_stops(mirrors: bool, share: float, count: int) -> None:
    """Planted: five states lead to 1-1-2, five to 1-2-1, six to 1-1-1."""
    codes = np.zeros((lane_state.CODES, 1, 1, 16), dtype=np.int64)
    codes[lane_state.REASON], codes[lane_state.PERIOD] = RESOLVED, 1
    codes[lane_state.IMPACTS_RIGHT, 0, 0] = [1] * 5 + [2] * 5 + [1] * 6
    codes[lane_state.IMPACTS_LEFT, 0, 0] = [2] * 5 + [1] * 5 + [1] * 6
    figures = np.zeros((lane_state.FIGURES, 1, 1, 16))
    arrays = named_arrays(codes, figures, MapSettings(policy="ensemble"), mirrors)
    assert (arrays["share"][0, 0], arrays["motions_found"][0, 0]) == (share, count)
