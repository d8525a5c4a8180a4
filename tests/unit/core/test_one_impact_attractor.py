"""Where the simulation finds and loses a motion with one impact: at the ends that the closed form gives its branch."""

from __future__ import annotations

import math

import numpy as np
import pytest

from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbits_at_clearance
from tests.support.orbits import one_impact_motions, special_motion
from tests.support.oscillators import DEFAULT

OMEGA = 0.27


def settled(clearance, state):
    """What the motion becomes from a state, and the state it ends in."""
    end = trajectory(DEFAULT, OMEGA, clearance, *state, periods=20, transient_periods=6000, samples_per_period=1)
    return end, (end.final.displacement, end.final.velocity, end.final.phase)


def is_the_motion(clearance, state):
    """Whether a trajectory settles to one impact a period on one stop, and none on the other."""
    end, state = settled(clearance, state)
    stops = end.impacts.stop
    right, left = int((stops > 0).sum()), int((stops < 0).sum())
    return sorted((right, left)) == [0, 20] and end.motion.kind in ("periodic", "unresolved"), state


def followed(start, step, state, goal=1e-7):
    """Follow the motion in small steps of the clearance until it is lost, and halve the step until it is `goal`."""
    clearance = start
    while abs(step) > goal:
        there, after = is_the_motion(clearance + step, state)
        if there:
            clearance, state = clearance + step, after
        else:
            step *= 0.5
    return clearance


@pytest.fixture(scope="module")
def start():
    branch = one_impact_branch(DEFAULT, OMEGA)
    (orbit,) = (orbit for orbit in orbits_at_clearance(branch, 1.86) if orbit.stable)
    # a third of a period behind the impact, so that mass 1 is away from the stops as these are moved
    time = np.array([2.0 * math.pi / OMEGA / 3.0])
    x, v = trajectory(DEFAULT, OMEGA, 1.86, orbit.displacement, orbit.velocity, orbit.phase).at(time)
    # and from beside the orbit, not on it
    there, state = is_the_motion(1.86, (0.999 * x[:, 0], 1.001 * v[:, 0], orbit.phase + OMEGA * time[0]))
    assert there
    return state


def test_the_branch_ends_at_its_saddle_node_and_at_its_graze():
    motions = one_impact_motions(DEFAULT, OMEGA)
    turn, graze = special_motion(motions, "SN"), special_motion(motions, "GR")
    assert turn.gap == pytest.approx(1.868341055, abs=5e-10)
    assert graze.gap == pytest.approx(1.844237331, abs=5e-10)
    assert turn.admissible
    assert graze.stop == -1
    assert motions.orbits.gap(motions.phases_of_impacts.ends[0]) == pytest.approx(1.854989818, abs=5e-10)


@pytest.mark.thorough
def test_the_simulated_motion_is_lost_at_the_saddle_node(start):
    point = special_motion(one_impact_motions(DEFAULT, OMEGA), "SN")
    last = followed(1.86, 1e-3, start)
    assert abs(last - point.gap) < 1e-6
    # beyond it the motion without impacts is left
    end, _ = settled(point.gap + 1e-6, start)
    assert (end.motion.impacts_right, end.motion.impacts_left) == (-1, -1)


def test_the_simulated_motion_is_lost_at_its_graze_with_the_other_stop(start):
    point = special_motion(one_impact_motions(DEFAULT, OMEGA), "GR")
    last = followed(1.86, -1e-3, start)
    assert abs(last - point.gap) < 1e-6
    end, _ = settled(point.gap - 1e-6, start)
    assert set(end.impacts.stop.tolist()) == {1, -1}


def test_two_orbits_meet_at_the_saddle_node_as_the_square_root():
    branch = one_impact_branch(DEFAULT, OMEGA)
    point = next(p for p in branch.special_points if p.type == "SN")
    gaps = []
    for below in (1e-6, 4e-6):
        slow, fast = orbits_at_clearance(branch, point.clearance - below)
        assert (slow.stable, fast.stable) == (False, True)
        gaps.append(fast.impact_velocity - slow.impact_velocity)
    assert gaps[1] / gaps[0] == pytest.approx(2.0, abs=1e-3)
