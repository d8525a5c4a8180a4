"""Impacts of any structure between any stops: a single trajectory and lanes against fifty digits."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.simulation.trajectories import Trajectory, trajectory
from tests.oracles.first_events import Events, compared, outcomes, pairs, resting_outcome
from tests.support.random_systems import RESTING, System, doubled, mirrored, random_system, resting_system
from tests.support.thorough import KERNELS_FIRST, the_first

FEW_EVENTS = (78, 93, 115)
"""Seeds of systems that leave the stops soon, or whose events an error of round-off soon decides."""


@pytest.mark.parametrize("seed", the_first(6, range(200)))
def test_the_first_events_are_those_of_fifty_digits(seed: int) -> None:
    alone, _ = outcomes(random_system(seed), lockstep=False)
    assert not alone.wrong
    assert alone.compared >= (0 if seed in FEW_EVENTS else 10)


@pytest.mark.parametrize("seed", the_first(2, RESTING))
def test_rests_and_releases_are_those_of_fifty_digits(seed: int) -> None:
    assert not resting_outcome(resting_system(seed)).wrong


@KERNELS_FIRST
@pytest.mark.parametrize("seed", [2, 8, 14, *range(20, 44)])
def test_lanes_have_the_events_of_fifty_digits(seed: int) -> None:
    alone, lanes = outcomes(random_system(seed))
    assert lanes is not None
    assert not alone.wrong
    assert not lanes.wrong


def test_events_that_differ_are_noticed() -> None:
    events = Events(np.array([1.0, -2.0, 3.0, 4.0]), [3], np.array([3.5]), True)
    limits = np.full(4, 1e-9), np.full(1, 1e-9)
    system = random_system(0)
    assert [pair[2:] for pair in pairs(events, events)] == [(1.0, 1.0), (-2.0, -2.0), (3.5, 3.5), (4.0, 4.0)]
    assert not compared(system, events, events, limits).wrong
    for changed in (
        events._replace(impacts=np.array([1.0, -2.0, 3.0])),  # the last one is missed
        events._replace(impacts=np.array([1.0, 2.0, 3.0, 4.0])),  # another stop
        events._replace(impacts=np.array([1.0, -2.0, 3.0, 4.00001])),
        events._replace(releases=np.array([3.50001])),
    ):
        assert compared(system, changed, events, limits).wrong
    # the number of bounces before the others are summed does not matter
    fewer = Events(np.array([1.0, -2.0, 4.0]), [2], np.array([3.5]), True)
    assert not compared(system, fewer, events, limits).wrong


def whole(system: System) -> Trajectory:
    return trajectory(*system, periods=40, samples_per_period=3)


@pytest.mark.parametrize("seed", range(6))
def test_mirror_images_and_twice_the_contact_row_are_the_same_to_the_byte(seed: int) -> None:
    system = random_system(seed)
    run = whole(system)
    for image, turned, speeds in ((mirrored, -1.0, -1.0), (doubled, 1.0, 2.0)):
        other = whole(image(system))
        np.testing.assert_array_equal(run.impacts.time, other.impacts.time)
        np.testing.assert_array_equal(speeds * run.impacts.velocity, other.impacts.velocity)
        np.testing.assert_array_equal(turned * run.displacement, other.displacement)
        counts = [other.motion.impacts_right, other.motion.impacts_left][:: int(turned)]
        assert [run.motion.impacts_right, run.motion.impacts_left] == counts
