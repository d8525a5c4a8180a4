"""Basin fractions: counted by other trajectories, matched along the parameter, from states in their ranges."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from grazemap_core.maps.basin_fractions import (
    basin_fractions,
    fraction_tile,
    matched,
    points_along,
    random_states,
    ranges_of,
)
from grazemap_core.maps.basins import Attractor
from grazemap_core.maps.chaotic_transients import chance_in_fractions
from grazemap_core.maps.samples import sample
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.trajectories import trajectory
from tests.support.lines import line
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import KERNELS_FIRST

STATES = 40


def between_two_masses() -> Oscillator:
    """Return two masses with a contact between them, two restitutions and a bias."""
    structure = Matrices.create([[2.0, 0.0], [0.0, 1.0]], [[3.0, -1.0], [-1.0, 1.0]], damping=[[0.2, 0.0], [0.0, 0.2]])
    forces = [force(1, np.array([1.0, 0.0]))]
    return Oscillator.of_structure(structure, [1.0, -1.0], forces, 0.7, [0.1, 0.0], 0.5)


def found_along(oscillator, vary, values, fixed, displacement=None, velocity=None, phase=0.0):
    points = points_along(line(oscillator, vary, values, fixed))
    states = random_states(points, ranges_of(points, displacement, velocity), STATES, 3)
    return points, states, basin_fractions(fraction_tile(points, states, phase, 400))


@pytest.mark.parametrize(
    ("oscillator", "vary", "values", "fixed", "ranges"),
    [
        (DEFAULT, "clearance", [1.9, 1.95, 2.0], 0.29, ([(-1.9, 1.9), (-0.5, 0.5), (0.0, 0.0)], [(-1.0, 1.0)] * 3)),
        pytest.param(between_two_masses(), "omega", [2.5, 2.55], (0.4, 0.3), (None, None), marks=KERNELS_FIRST),
    ],
)
def test_shares_are_those_of_trajectories_that_are_simulated_one_by_one(oscillator, vary, values, fixed, ranges):
    points, states, fractions = found_along(oscillator, vary, values, fixed, *ranges, phase=0.4)
    for k, point in enumerate(points):
        counted: Counter[object] = Counter()
        for displacement, velocity in states:
            run = trajectory(*point, displacement, velocity, 0.4, transient_periods=300, periods=100)
            motion = run.motion
            counted[motion.kind, motion.period, motion.impacts_right, motion.impacts_left, motion.symmetric] += 1
        ours: Counter[object] = Counter()
        for limit_motion, number in zip(fractions.attractors, fractions.states[:, k].tolist(), strict=True):
            if number:
                ours[
                    limit_motion.kind,
                    limit_motion.period,
                    limit_motion.impacts_right,
                    limit_motion.impacts_left,
                    limit_motion.symmetric,
                ] += number
        assert ours == counted
        assert sum(ours.values()) == STATES
    np.testing.assert_array_equal(fractions.share, fractions.states / STATES)
    share = fractions.share[fractions.states > 0]
    assert np.any(share < 1.0)
    np.testing.assert_allclose(fractions.share_error[fractions.states > 0], np.sqrt(share * (1 - share) / STATES))
    assert not np.any(fractions.unresolved)


@KERNELS_FIRST
def test_attractors_of_one_name_keep_their_numbers_however_fine_the_steps():
    ends = []
    for points in (2, 11):
        _, _, fractions = found_along(between_two_masses(), "omega", np.linspace(1.6, 1.65, points), (0.8, 0.6))
        twins = [
            k
            for k, limit_motion in enumerate(fractions.attractors)
            if (limit_motion.period, limit_motion.impacts_right) == (2, 1)
        ]
        assert len(twins) == 2
        assert np.all(fractions.states[twins] > 0)
        assert np.max(np.abs(np.diff(fractions.mean_position[twins], axis=1))) < 0.5 / points
        assert np.all(fractions.multiplier[twins] < 1.0)
        assert np.all(fractions.verified[twins])
        ends.append(fractions.mean_position[twins][:, [0, -1]])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)


def attractor(mean, right=1, kind="periodic"):
    periodic = kind == "periodic"
    name = {"period": 2, "impacts_right": right, "impacts_left": 1, "symmetric": False, "sticking": False}
    means = {"mean_position": mean, "mean_velocity": 0.0}
    figures = {"multiplier": 0.5, "lyapunov": -0.3, "verified": True, "states": 3, "share": 0.3}
    return Attractor(kind=kind, **(name | means if periodic else dict.fromkeys([*name, *means])), **figures)


def test_attractors_of_one_name_are_matched_by_the_smallest_sum_of_squared_distances():
    known = [attractor(0.3), attractor(-0.3), attractor(0.9, right=4), attractor(None, kind="chaotic")]
    # greedily the first would take the nearest, and leave the second far away
    assert matched([attractor(-0.1), attractor(-0.35)], known) == [0, 1]
    assert matched([attractor(-0.35), attractor(-0.1)], known) == [1, 0]
    assert matched([attractor(0.29), attractor(0.9), attractor(-0.3)], known) == [0, 4, 1]
    assert matched([attractor(None, kind="chaotic"), attractor(0.9, right=5)], known) == [3, 4]
    assert matched([attractor(0.0), attractor(None, kind="quasi-periodic")], []) == [0, 1]


def test_the_chance_of_chaos_to_settle_is_that_of_longer_runs():
    points = points_along(line(DEFAULT, "clearance", [1.972, 1.985], 0.29))
    states = random_states(points, ranges_of(points, None, None), STATES, 1)
    short, long = (fraction_tile(points, states, 0.2, periods) for periods in (200, 2000))
    kind, chaotic = short["kind"], KINDS.index("chaotic")
    assert np.count_nonzero(kind == chaotic, axis=1).tolist() == [38, 0]
    kind[1] = chaotic  # planted: they settle
    rows, columns = np.nonzero(kind == chaotic)
    chosen = sample(len(rows), 200)
    settled = long["kind"][rows[chosen], columns[chosen]] == KINDS.index("periodic")
    chance = chance_in_fractions(kind, points, states, 0.2, 200, 32)
    assert (chance.chaotic, chance.sampled, chance.settled) == (len(rows), len(chosen), np.count_nonzero(settled))
    assert 0 < chance.settled < chance.sampled
    assert chance_in_fractions(np.ones_like(kind), points, states, 0.2, 200, 32) is None


def test_states_are_uniform_between_the_stops():
    relative = between_two_masses()
    points = points_along(line(relative, "omega", [1.0, 2.0], (1.0, 1.0)))
    ranges = ranges_of(points, [(-1.0, 1.0)] * 2, [(2.0, 2.0), (0.0, 1.0)])
    states = random_states(points, ranges, 4000, 0)
    place = states[:, 0] @ relative.contact
    assert np.max(np.abs(place)) < 1.0
    # the density of the difference of two numbers is a triangle, here without its ends
    inside = np.mean(np.abs(place) < 0.5)
    assert inside == pytest.approx(7.0 / 12.0, abs=4 * np.sqrt(7 / 12 * 5 / 12 / 4000))
    assert np.all(states[:, 1, 0] == 2.0)
    np.testing.assert_array_equal(random_states(points, ranges, 4000, 0), states)
    assert not np.array_equal(random_states(points, ranges, 4000, 1), states)
    # at every value of the clearance
    along = points_along(line(DEFAULT, "clearance", [0.5, 1.5], 0.29))
    assert np.max(np.abs(random_states(along, ranges_of(along, [(-1.5, 1.5)] * 3, None), 500, 0)[:, 0, 0])) < 0.5


def test_ranges_that_are_left_out_are_those_of_the_smallest_clearance():
    along = points_along(line(DEFAULT, "clearance", [0.5, 1.5], 0.29))
    ranges = ranges_of(along, None, None)
    np.testing.assert_array_equal(ranges.displacement, [(-0.5, 0.5)] * 3)
    np.testing.assert_allclose(ranges.velocity, [(-0.145, 0.145)] * 3)
    relative = between_two_masses()
    equilibrium = np.linalg.solve([[3.0, -1.0], [-1.0, 1.0]], [0.1, 0.0])
    ranges = ranges_of(points_along(line(relative, "omega", [2.0, 3.0], (1.0, 0.6))), None, None)
    np.testing.assert_allclose(ranges.displacement, equilibrium[:, None] + np.array([-0.8, 0.8]))
    np.testing.assert_allclose(ranges.velocity, [(-1.6, 1.6)] * 2)
    one_stop = ranges_of(points_along(line(relative, "omega", [2.0], (0.7, None))), None, None)
    np.testing.assert_allclose(one_stop.displacement[:, 1] - equilibrium, 0.7 - (equilibrium[0] - equilibrium[1]))


@pytest.mark.parametrize(
    ("displacement", "velocity", "name"),
    [
        ([(0.0, 1.0)] * 2, None, "displacement"),
        ([(0.0, np.inf)] * 3, None, "displacement"),
        (None, [(1.0, 0.0)] * 3, "velocity"),
        ([(1.6, 1.6)] * 3, None, "displacement"),
        ([(1.4999, 9.0)] * 3, None, "displacement"),
    ],
)
def test_ranges_without_states_between_the_stops_are_refused(displacement, velocity, name):
    along = points_along(line(DEFAULT, "clearance", [1.5, 1.6], 0.29))
    with refused(name):
        random_states(along, ranges_of(along, displacement, velocity), 50, 0)
