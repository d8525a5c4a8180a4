"""Periodic motions with rests, found by simulation: against their own return and differences of neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.codes import INFINITE
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.simulated_orbits import simulated_orbit
from grazemap_core.simulation.trajectories import trajectory

CASES = {
    # restitution, omega, clearance, phase, impacts on either stop, rests at phase 0
    "chatter": (0.8, 0.226, 0.799, 0.4, INFINITE, False),
    "chatter over the section": (0.6, 0.469, 0.35, -1.0, INFINITE, True),
    "rests longer than flights": (0.6, 0.11, 0.393, 1.0, INFINITE, False),
    "one impact and a rest": (0.0, 0.262, 1.171, 2.5, 1, False),
    "two impacts and a rest": (0.0, 0.148, 1.253, 0.0, 2, False),
}


def settled(restitution, omega, clearance, phase):
    oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], restitution)
    run = trajectory(oscillator, omega, clearance, phase=phase, periods=8, transient_periods=300, samples_per_period=1)
    return oscillator, run


@pytest.mark.parametrize("case", CASES)
def test_a_motion_with_rests_returns_to_its_start(case):
    restitution, omega, clearance, phase, impacts, at_start = CASES[case]
    oscillator, run = settled(restitution, omega, clearance, phase)
    orbit = simulated_orbit(oscillator, omega, clearance, run)
    motion = orbit.motion
    assert (motion.kind, motion.period, motion.sticking, motion.verified) == ("periodic", 1, True, False)
    assert (motion.impacts_right, motion.impacts_left) == (impacts, impacts)
    assert "simulation" in motion.reason
    assert orbit.closing < 1e-12
    assert orbit.stable
    x, v = orbit.start.displacement, orbit.start.velocity
    assert (abs(x[0]) == clearance and v[0] == 0.0) == at_start
    after = trajectory(oscillator, omega, clearance, x, v, periods=3, samples_per_period=1)
    np.testing.assert_allclose(after.displacement[:, -1], x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(after.velocity[:, -1], v, rtol=0, atol=1e-12)
    assert after.motion.impacts_right == impacts
    # the record is of one period: a rest that goes on over its end is in two parts
    assert len(orbit.sticking.start) == 2 + at_start
    if impacts != INFINITE:
        assert len(orbit.impacts.time) == 2 * impacts


@pytest.mark.parametrize("case", ["chatter", "one impact and a rest"])
def test_multipliers_are_those_of_neighbours_after_a_period(case):
    restitution, omega, clearance, phase, _, _ = CASES[case]
    oscillator, run = settled(restitution, omega, clearance, phase)
    orbit = simulated_orbit(oscillator, omega, clearance, run)
    base = np.concatenate([orbit.start.displacement, orbit.start.velocity])
    columns = []
    for i in range(len(base)):
        ends = []
        for step in (1e-6, -1e-6):
            moved = base.copy()
            moved[i] += step
            final = trajectory(oscillator, omega, clearance, moved[:3], moved[3:], samples_per_period=1).final
            ends.append(np.concatenate([final.displacement, final.velocity]))
        columns.append((ends[0] - ends[1]) / 2e-6)
    theirs = np.linalg.eigvals(np.array(columns).T)
    theirs = theirs[np.argsort(-np.abs(theirs))]
    np.testing.assert_allclose(np.abs(orbit.multipliers[:4]), np.abs(theirs[:4]), rtol=1e-4)
    # a rest forgets place and speed of mass 1
    assert np.max(np.abs(orbit.multipliers[4:])) < 1e-12


def test_other_motions_are_refused():
    oscillator, run = settled(0.8, 0.29, 1.6, 0.0)
    assert run.motion.kind == "periodic"
    with pytest.raises(ParameterError, match="rests on a stop"):
        simulated_orbit(oscillator, 0.29, 1.6, run)
