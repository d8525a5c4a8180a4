"""Motions of maps between unlike stops are verified by the same orbits as those that are solved for one by one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.grazing.grazing_curve import steady_motion
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.trajectories import trajectory
from tests.support.lines import column
from tests.support.oscillators import DEFAULT

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
        (dataclasses.replace(DEFAULT, restitution_left=0.6), 0.27, np.linspace(1.35, 1.85, 6)),
        (dataclasses.replace(DEFAULT, bias=PUSHED), 0.285, np.linspace(1.4, 1.9, 6)),
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


@pytest.mark.parametrize("side", [0, 1])
def test_a_stop_out_of_reach_changes_nothing(side: int) -> None:
    omegas, nearer = np.array([0.265, 0.285, 0.31]), np.linspace(1.2, 2.1, 24)

    def tile(other: float) -> dict[str, np.ndarray]:
        clearances = np.column_stack([nearer, np.full_like(nearer, other)])
        return unfolding_map_tile(Plane.of(DEFAULT, omegas, clearances[:, ::-1] if side else clearances))

    alone, beyond = tile(math.inf), tile(1e6)
    both = alone["verified"] & beyond["verified"]
    assert np.count_nonzero(alone["verified"] ^ beyond["verified"]) <= 1  # chaotic transients differ by round-off
    assert np.mean(both) > 0.9
    for name in ("kind", "period", "impacts_right", "impacts_left"):
        np.testing.assert_array_equal(beyond[name][both], alone[name][both])
    np.testing.assert_allclose(beyond["multiplier"][both], alone["multiplier"][both], rtol=1e-8)


def test_motions_beside_the_steady_maxima_are_free_of_impacts_for_ever() -> None:
    oscillator, omega = dense(), 0.9
    motion, rest = steady_motion(oscillator, np.array([omega])), contact_equilibrium(oscillator)
    right, left = (float(motion.toward(stop).amplitude[0]) for stop in (1, -1))
    clearances = np.array([[factor * right + rest, factor * left - rest] for factor in (0.999, 1.001, 1.005)])
    assert np.all(clearances + np.array([-rest, rest]) < np.sum(np.abs(motion.response)))
    tile = column(oscillator, omega, clearances, 1000)
    assert tile["verified"][:, 0].tolist() == [True, True, True]
    assert tile["impacts_left"][:, 0].tolist()[1:] == [-1, -1]
    assert tile["impacts_left"][0, 0] > 0
    both = float(clearances[1, 0]), float(clearances[1, 1])
    run = trajectory(oscillator, omega, both, periods=64, transient_periods=1000, samples_per_period=1)
    assert (run.motion.kind, run.motion.period, run.motion.impacts_right) == ("periodic", 1, -1)


@pytest.mark.parametrize(("gamma", "omega"), [(0.05, 0.29), (1e-5, 0.277), (1e-9, 1.0)])
def test_the_bound_of_a_steady_motion_is_reduced_to_its_maxima(gamma: float, omega: float) -> None:
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], gamma, [0.0, 0.0, 0.0], 0.8)
    if gamma == 1e-9:  # the second harmonic is in resonance
        omega = 0.5 * math.sqrt(modal_model(chain).frequency_squared[0])
    drive = [force(k, np.array([a, 0.0, 0.0]), np.array([p, 0.0, 0.0])) for k, a, p in ((1, 1.0, 0.0), (2, 0.7, 0.3))]
    oscillator = Oscillator.of_structure(chain.structure, chain.contact, drive, 0.8)
    (structure,) = forced_structures(trajectory_models(oscillator), np.array([omega]))
    for phase in (0.0, 0.7):
        problem = structure.at_phase(phase).free
        assert (problem.half_jump.shape[1] > 0) == (gamma == 1e-9)
        motion = steady_motion(oscillator, np.array([omega]))
        for stop, unreached in zip((1, -1), problem.unreached.tolist(), strict=True):
            above = (problem.lasting_bound - unreached) - float(motion.toward(stop).amplitude[0])
            assert 0.0 < above < 2e-12 * problem.lasting_bound
