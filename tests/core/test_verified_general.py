"""Motions of maps between unlike stops are verified by the same orbits as those that are solved for one by one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.trajectories import trajectory

CHAIN = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
PUSHED = np.array([0.04, 0.0, 0.0])


def dense() -> Oscillator:
    """Two harmonics, a relative contact and two restitutions."""
    damping = np.array([[0.3, -0.1, 0.0], [-0.1, 0.2, 0.1], [0.0, 0.1, 0.2]])
    mass = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.2], [0.0, 0.2, 1.5]])
    structure = Matrices.create(mass, np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -0.5], [0.0, -0.5, 4.0]]), damping)
    drive = [force(1, np.array([1.0, 0.0, 0.0]), np.array([0.4, 0.0, 0.0])), force(2, np.array([0.2, 0.1, 0.0]))]
    return Oscillator.of_structure(structure, [1.0, -1.0, 0.0], drive, 0.7, [0.02, 0.0, 0.0], restitution_left=0.5)


def beside_others() -> Oscillator:
    """A mass beside two that contact neither sees nor moves, one of which decays more slowly than it."""
    damping = np.diag([0.1, 0.02, 0.1])
    structure = Matrices.create(np.eye(3), np.diag([1.0, 2.0, 3.0]), damping)
    drive = [force(1, np.array([1.0, 0.0, 0.3]), np.array([0.4, 0.0, 0.0]))]
    return Oscillator.of_structure(structure, [1.0, 0.0, 0.0], drive, 0.8, restitution_left=0.5)


@pytest.mark.parametrize(
    ("oscillator", "omega", "clearances"),
    [
        (dataclasses.replace(CHAIN, restitution_left=0.6), 0.27, np.linspace(1.35, 1.85, 6)),
        (dataclasses.replace(CHAIN, bias=PUSHED), 0.285, np.linspace(1.4, 1.9, 6)),
        (dense(), 0.9, np.linspace(0.2, 0.5, 6)),
        (beside_others(), 1.25, np.linspace(0.6, 1.2, 6)),
    ],
)
def test_maps_verify_the_orbits_between_unlike_stops(
    oscillator: Oscillator, omega: float, clearances: np.ndarray
) -> None:
    tile = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), clearances))
    compared = 0
    for row, clearance in enumerate(clearances.tolist()):
        if not tile["verified"][row, 0] or tile["impacts_right"][row, 0] < 0 > tile["impacts_left"][row, 0]:
            continue
        run = trajectory(oscillator, omega, clearance, periods=64, transient_periods=1000, samples_per_period=1)
        orbit = periodic_orbit(oscillator, omega, clearance, impacts_of(run))
        assert orbit.verified
        assert not orbit.symmetric
        assert not tile["symmetric"][row, 0]
        counts = [int(tile[name][row, 0]) for name in ("impacts_right", "impacts_left")]
        assert (int(tile["period"][row, 0]), *counts) == (orbit.least_period, *orbit.impacts_per_period)
        assert tile["multiplier"][row, 0] == pytest.approx(np.max(np.abs(orbit.multipliers)), rel=1e-8)
        slowest = np.min(np.abs(orbit.impacts.velocities))
        assert tile["least_impact_velocity"][row, 0] == pytest.approx(slowest, rel=1e-10)
        compared += 1
    assert compared >= 3
