"""Verified points of maps: run once more in 50 digits, and their orbits solved for in 50 digits."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core import codes
from grazemap_core.maps.kernels.lane_state import CODES, REASON, UNVERIFIED, is_captured
from grazemap_core.maps.map_settings import AtRest, MapSettings, RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.unfolding import arrays_of, unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.simulation.motion import KINDS, REASONS
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import solved
from tests.slow.verified_points import (
    DEFAULT,
    EQUAL,
    NO_VERDICT,
    OTHER,
    Point,
    impacts_in_fifty_digits,
    verdict,
    verified_point,
)
from tests.support.thorough import every_fourth

PERIODIC = KINDS.index("periodic")
ORBITS = 200
MOST_IMPACTS = 6  # of orbits that are solved for in 50 digits: the time that takes grows with their square


@pytest.mark.parametrize("first", every_fourth(range(0, 20, 5)))
def test_verified_points_are_as_in_fifty_digits(first: int) -> None:
    """From rest, by a simulator that shares nothing with the core; a fifth of them on random chains."""
    outcomes = []
    for seed in range(first, first + 5):
        point = verified_point(seed)
        outcomes.append(verdict(point, impacts_in_fifty_digits(point)))
    assert OTHER not in outcomes
    assert outcomes.count(EQUAL) >= 4


def test_wrong_labels_are_caught() -> None:
    omega, clearance = 0.27, 1.85  # one impact, on one stop
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([omega]), np.array([clearance])))
    label = [tile[name][0, 0].item() for name in ("period", "impacts_right", "impacts_left", "symmetric")]
    assert label[0] == 1
    assert sorted(label[1:3]) == [-1, 1]
    assert not label[3]
    after = tile["settled_after"][0, 0].item()
    right = Point(DEFAULT, omega, clearance, 1, 1, 0, False, after, 0.0, 0.0)
    run = impacts_in_fifty_digits(right)
    assert verdict(right, run) == EQUAL
    assert verdict(right._replace(right=0, left=1), run) == EQUAL  # the mirror image
    assert verdict(right, None) == NO_VERDICT
    for wrong in (
        {"right": 2},
        {"left": 1},
        {"period": 2, "right": 2},
        {"period": 3, "right": 3},
        {"symmetric": True},
    ):
        assert verdict(right._replace(**wrong), run) == OTHER, wrong


@pytest.mark.parametrize(("policy", "alike"), [("rest", 0.998), ("sweep-down", 0.98), ("ensemble", 0.998)])
def test_a_preview_names_what_is_verified(policy: str, alike: float) -> None:
    """It has the verified motions of the map, from rest the same bytes; motions that are not periodic are unresolved.

    In the map, a motion that is named but not verified runs on for its multiplier, so the rest of a sweep starts from
    another state. Where a sweep's motion ends, round-off chooses between mirror images, and all later motions have the
    same.
    """
    grid = (DEFAULT, np.linspace(0.26, 0.3, 6), np.linspace(1.3, 2.05, 64))
    settings = {"max_periods": 400, "policy": policy, "initial_conditions": 3}
    full, preview = (
        unfolding_map_tile(Plane.of(*grid), MapSettings(**settings)),
        unfolding_map_tile(Plane.of(*grid), MapSettings(**settings, preview=True)),
    )
    assert full.keys() - preview.keys() == {"multiplier", "lyapunov", "lyapunov_error"}
    if policy == "rest":
        assert ((full["kind"] == PERIODIC) == (preview["kind"] == PERIODIC)).all()
        for name, values in preview.items():
            np.testing.assert_array_equal(values[full["verified"]], full[name][full["verified"]], err_msg=name)
    both = full["verified"] & preview["verified"]
    assert both.sum() > 0.95 * full["verified"].sum()
    names = ("period", "impacts_right", "impacts_left", "symmetric", "sticking")
    assert np.mean([(full[name] == preview[name])[both].mean() for name in names]) > alike
    assert set(np.unique(preview["kind"])) <= {KINDS.index("unresolved"), PERIODIC}


@pytest.mark.thorough
def test_orbits_of_verified_points_are_those_of_fifty_digits() -> None:
    """Newton's method in 50 digits from M, C, K, f and R: slowest impact and largest multiplier as the map says."""
    rng = np.random.default_rng(8)
    omegas, clearances = np.sort(rng.uniform(0.26, 0.32, 8)), np.sort(rng.uniform(1.2, 2.0, 60))
    tile = unfolding_map_tile(Plane.of(DEFAULT, omegas, clearances), MapSettings(400))
    compared = 0
    for i, j in np.argwhere(tile["verified"]):
        point = {name: values[i, j].item() for name, values in tile.items()}
        impacts = max(point["impacts_right"], 0) + max(point["impacts_left"], 0)
        if not 0 < impacts <= MOST_IMPACTS or compared == ORBITS:
            continue
        omega, clearance = float(omegas[j]), float(clearances[i])
        run = trajectory(DEFAULT, omega, clearance, transient_periods=600, periods=32, samples_per_period=1)
        assert run.motion.kind == "periodic"
        orbit = solved(DEFAULT, omega, clearance, impacts_of(run))
        symmetric = orbit.sign == -1
        assert (orbit.half_periods // (1 if symmetric else 2), symmetric) == (point["period"], point["symmetric"])
        assert len(orbit.stops) * (2 if symmetric else 1) == impacts
        slowest = min(abs(float(v)) for v in orbit.velocities)
        assert point["least_impact_velocity"] == pytest.approx(slowest, rel=1e-11)
        with digits():
            largest = max(abs(value) for value in orbit.multipliers()) ** (2 if symmetric else 1)
        assert point["multiplier"] == pytest.approx(largest, rel=1e-8, abs=1e-12)
        compared += 1
    assert compared == ORBITS


def test_a_point_that_is_not_verified_has_a_reason() -> None:
    sticky = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.3)
    tile = unfolding_map_tile(Plane.of(sticky, np.array([0.28]), np.linspace(0.8, 1.9, 40)))
    rests = (tile["kind"] == PERIODIC) & tile["sticking"]
    assert rests.any()
    assert not tile["verified"][rests].any()
    assert set(tile["reason"][rests].tolist()) == {codes.STICKS}
    assert tile["verified"][(tile["kind"] == PERIODIC) & ~rests].mean() > 0.95
    undamped = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.0, [1.0, 0.0, 0.0], 0.6)
    tile = unfolding_map_tile(Plane.of(undamped, np.array([0.9]), np.linspace(0.3, 1.0, 12)))
    named = tile["kind"] == PERIODIC
    assert not tile["verified"].any()
    assert set(tile["reason"][named].tolist()) <= {codes.NOT_VERIFIED, codes.STICKS}
    assert all(REASONS[code] for code in tile["reason"][~tile["verified"] & (tile["kind"] != 3)].tolist())


def test_a_trajectory_without_damping_has_nothing_of_those_before_it() -> None:
    """It carries no error of its own, and the scratch still holds the errors of the last trajectories."""
    undamped = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.0, [1.0, 0.0, 0.0], 0.6)
    settings, clearances = RunSettings(200, 16), np.linspace(0.3, 1.0, 12)
    before = Runner(DEFAULT, settings)
    before.run(before.at(0.9), np.linspace(0.05, 0.3, 64), AtRest())
    outcomes = [
        runner.run(runner.at(0.9), clearances, AtRest())
        for runner in (Runner(undamped, settings, before), Runner(undamped, settings))
    ]
    for ours, alone in zip(*outcomes, strict=True):
        np.testing.assert_array_equal(ours, alone)


def test_a_motion_that_is_named_at_the_end_is_not_verified() -> None:
    grid = np.array([0.29]), np.linspace(1.5, 1.9, 12)
    codes, figures = PlaneRunner(Plane.of(DEFAULT, *grid), RunSettings(400, 32, early=False)).grid()
    tile = arrays_of(codes[..., 0], figures[..., 0])
    named = tile["kind"] == PERIODIC
    assert named.any()
    assert not tile["verified"][named & (tile["impacts_right"] > 0)].any()


def test_motions_without_impacts_are_verified_only_clear_of_the_stops() -> None:
    """The steady motion is the only one where its amplitude, and all that is left of the start, stay below them."""
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.29]), np.array([2.5, 3.0])))
    assert tile["verified"].all()
    assert (tile["impacts_right"] == -1).all()
    assert (tile["impacts_left"] == -1).all()
    assert np.isnan(tile["least_impact_velocity"]).all()


def test_near_a_bifurcation_a_motion_is_not_called_stable() -> None:
    """Within round-off of a saddle-node or a breaking of the symmetry the orbit that it happens to is not verified."""
    places = [
        special.clearance
        for special in one_impact_branch(DEFAULT, 0.28, 1, symmetric=True).special_points
        if special.type in ("SB", "SN", "PD")
    ]
    assert places
    for clearance in places:
        near = clearance * (1.0 + np.array([-1e-3, -1e-12, 1e-12, 1e-3]))
        tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.28]), np.sort(near)), MapSettings(400))
        one_one = (tile["period"] == 1) & (tile["impacts_right"] == 1) & (tile["impacts_left"] == 1)
        assert not (tile["verified"] & tile["symmetric"] & one_one)[1:3].any()


def test_a_trajectory_is_captured_where_its_motion_is_named_and_round_off_does_at_most_decide() -> None:
    """For kernels, which sweep a column, as for Python, which sweeps where points share no tables."""

    @kernel
    def in_kernel(row: np.ndarray) -> bool:
        return is_captured(row)

    row = np.zeros(CODES, dtype=np.int64)
    for reason in range(codes.ROUNDING_DECIDES + 1):
        for unverified in range(codes.ROUNDING_DECIDES + 1):
            row[REASON], row[UNVERIFIED] = reason, unverified
            expected = reason == codes.RESOLVED and unverified in (codes.RESOLVED, codes.ROUNDING_DECIDES)
            assert is_captured(row) is in_kernel(row) is expected
