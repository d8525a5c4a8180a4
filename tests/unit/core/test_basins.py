"""Basins: every state has the motion of its own trajectory, and attractors with one name are distinguished."""

from __future__ import annotations

import math

import numpy as np
import pytest

from grazemap_core.maps.basins import Coordinate, _clusters, attractors, basin_tile
from grazemap_core.simulation.tolerances import LIMIT_DISTANCE, SEPARATION
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused

OMEGA, CLEARANCE = 0.29, 1.9927
ACROSS = Coordinate("displacement", 1, np.linspace(-1.99, 1.99, 24))
UP = Coordinate("velocity", 1, np.linspace(-1.0, 1.0, 17))


@pytest.fixture(scope="module")
def tile():
    return basin_tile(DEFAULT, OMEGA, CLEARANCE, ACROSS, UP)


def test_the_two_motions_that_coexist_are_found_with_their_shares(tile):
    label, motions = attractors(tile)
    named = [
        (attractor.kind, attractor.period, attractor.impacts_right, attractor.impacts_left, attractor.symmetric)
        for attractor in motions
    ]
    assert named == [("periodic", 1, -1, -1, True), ("periodic", 3, 1, 1, True)]
    assert sum(attractor.share for attractor in motions) == pytest.approx(1.0)
    assert [attractor.states for attractor in motions] == np.bincount(label.ravel()).tolist()
    # about a third of this rectangle leads to impacts
    assert 0.3 < motions[1].share < 0.42
    assert all(attractor.multiplier < 1.0 and attractor.lyapunov < 0.0 for attractor in motions)


def test_the_label_of_a_state_is_that_of_its_trajectory(tile):
    label, motions = attractors(tile)
    random = np.random.default_rng(3)
    for row, column in zip(random.integers(0, 17, 12), random.integers(0, 24, 12), strict=True):
        x, v = ACROSS.values[column], UP.values[row]
        run = trajectory(
            DEFAULT,
            OMEGA,
            CLEARANCE,
            np.array([x, 0.0, 0.0]),
            np.array([v, 0.0, 0.0]),
            transient_periods=300,
            periods=60,
        )
        attractor = motions[label[row, column]]
        assert (run.motion.period, run.motion.impacts_right) == (attractor.period, attractor.impacts_right)


def test_tiles_have_the_bytes_of_the_whole(tile):
    part = basin_tile(DEFAULT, OMEGA, CLEARANCE, ACROSS._replace(values=ACROSS.values[5:9]), UP)
    for name, values in part.items():
        assert values.tobytes() == np.ascontiguousarray(tile[name][:, 5:9]).tobytes(), name


def test_the_other_coordinates_and_the_phase_have_the_requested_values():
    across = Coordinate("velocity", 2, np.array([-0.3, 0.1]))
    up = Coordinate("displacement", 3, np.array([0.2, 0.4, 0.6]))
    rest = {"displacement": np.array([0.5, -0.1, 9.0]), "velocity": np.array([0.2, 9.0, 0.3])}  # 9: replaced
    tile = basin_tile(DEFAULT, 0.27, 1.84, across, up, **rest, phase=1.0, max_periods=400)
    for row, column in ((0, 0), (2, 1)):
        x, v = np.array([0.5, -0.1, up.values[row]]), np.array([0.2, across.values[column], 0.3])
        run = trajectory(DEFAULT, 0.27, 1.84, x, v, 1.0, transient_periods=300, periods=60)
        assert tile["period"][row, column] == run.motion.period
        assert tile["impacts_right"][row, column] == run.motion.impacts_right
        assert tile["impacts_left"][row, column] == run.motion.impacts_left


def test_mirror_images_are_two_attractors():
    # 1-1r-(-1)l and its mirror image; a state and its mirror image half a period later lead to mirror images
    across = Coordinate("displacement", 1, np.linspace(-1.8, 1.8, 16))
    up = Coordinate("velocity", 1, np.linspace(-1.0, 1.0, 16))
    here = basin_tile(DEFAULT, 0.27, 1.85, across, up)
    later = basin_tile(DEFAULT, 0.27, 1.85, across, up, phase=np.pi)
    named = {(attractor.impacts_right, attractor.impacts_left) for attractor in attractors(here)[1]}
    assert {(1, -1), (-1, 1)} <= named
    np.testing.assert_array_equal(here["impacts_right"], later["impacts_left"][::-1, ::-1])


def arrays_of(kind, period, right, left, mean):
    count = len(kind)
    return {
        "kind": np.array(kind, dtype=np.int8),
        "reason": np.zeros(count, dtype=np.int8),
        "period": np.array(period),
        "impacts_right": np.array(right),
        "impacts_left": np.array(left),
        "symmetric": np.zeros(count, dtype=bool),
        "sticking": np.zeros(count, dtype=bool),
        "multiplier": np.full(count, 0.5),
        "lyapunov": np.linspace(-0.3, -0.1, count),
        "verified": np.arange(count) != 2,
        "mean_position": np.array(mean),
        "mean_velocity": np.zeros(count),
    }


def test_motions_with_one_name_are_distinguished_by_their_positions():
    mean = [0.1, -0.1, 0.1 + 1e-8, np.nan, np.nan, 0.1 - 1e-8, np.nan]
    label, motions = attractors(
        arrays_of([1, 1, 1, 3, 0, 1, 3], [2, 2, 2, 0, 0, 2, 0], [1, 1, 1, 0, 0, 1, 0], [1, 1, 1, 0, 0, 1, 0], mean)
    )
    assert label.tolist() == [0, 2, 0, 1, -1, 0, 1]
    assert [(attractor.kind, attractor.states) for attractor in motions] == [
        ("periodic", 3),
        ("chaotic", 2),
        ("periodic", 1),
    ]
    assert [attractor.verified for attractor in motions] == [False, False, True]  # from one of three states it is not
    assert motions[0].mean_position == 0.1
    assert motions[1].period is None
    assert motions[1].mean_position is None
    assert motions[1].lyapunov == pytest.approx(np.linspace(-0.3, -0.1, 7)[[3, 6]].mean())


def clusters_by_definition(means):
    """Grown point by point: what is connected by distances up to the tolerance."""
    left, clusters = set(range(len(means))), []
    while left:
        due, cluster = [left.pop()], []
        while due:
            here = due.pop()
            cluster.append(here)
            near = [k for k in left if math.dist(means[here], means[k]) <= SEPARATION * LIMIT_DISTANCE]
            left -= set(near)
            due += near
        clusters.append(sorted(cluster))
    return sorted(clusters)


def test_means_are_of_one_attractor_where_they_are_connected_by_short_distances():
    tolerance = SEPARATION * LIMIT_DISTANCE
    steps = np.arange(12) * 0.6
    corner = np.concatenate([np.stack([0.0 * steps, steps], axis=1), np.stack([steps, 0.0 * steps], axis=1)])
    inside = np.array([[4.0, 4.0], [4.5, 4.4]])  # neither axis has a gap between them and the corner
    stairs = np.stack([10.0 + np.arange(6) * 1.01, np.arange(6) * 0.01], axis=1)
    for points, number in ((np.concatenate([corner, inside]), 2), (stairs, 6)):
        means = tolerance * points
        clusters = sorted(sorted(members.tolist()) for members in _clusters(means))
        assert clusters == clusters_by_definition(means)
        assert len(clusters) == number
    rng = np.random.default_rng(0)
    for _ in range(50):
        means = tolerance * rng.uniform(-4.0, 4.0, (40, 2))
        assert sorted(sorted(members.tolist()) for members in _clusters(means)) == clusters_by_definition(means)


def test_unresolved_states_belong_to_no_attractor():
    label, motions = attractors(arrays_of([0, 0], [0, 0], [0, 0], [0, 0], [np.nan, np.nan]))
    assert label.tolist() == [-1, -1]
    assert motions == []


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"vertical": ACROSS}, "vertical"),
        ({"horizontal": Coordinate("displacement", 1, np.array([0.0, CLEARANCE]))}, "displacement"),
        ({"horizontal": Coordinate("displacement", 4, np.array([0.0, 1.0]))}, "horizontal"),
        ({"vertical": Coordinate("phase", 1, np.array([0.0, 1.0]))}, "vertical"),
        ({"vertical": Coordinate("velocity", 1, np.array([0.0, np.nan]))}, "vertical"),
        ({"displacement": [0.0, 0.0]}, "displacement"),
        ({"velocity": [0.0, np.inf, 0.0]}, "velocity"),
        ({"phase": np.nan}, "phase"),
        ({"clearance": 0.0}, "clearance"),
        ({"omega": -1.0}, "omega"),
        ({"max_periods": 0}, "max_periods"),
    ],
)
def test_a_rectangle_that_is_not_between_the_stops_is_refused(change, name):
    arguments = {"omega": OMEGA, "clearance": CLEARANCE, "horizontal": ACROSS, "vertical": UP, **change}
    with refused(name):
        basin_tile(DEFAULT, **arguments)
