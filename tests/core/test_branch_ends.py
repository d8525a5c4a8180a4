"""Where a branch ends on another one: type and place do not depend on where the branch is begun, nor on round-off."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from test_branch_switching import orbit_of, parent, special
from test_periodic_orbits import DEFAULT

from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops

MASS = np.array([[0.84, 0.1323, 0.1237], [0.1323, 3.1989, 0.4166], [0.1237, 0.4166, 2.073]])
DAMPING = np.array([[0.3485, 0.3693, 0.059], [-0.3271, 0.0281, 0.382], [-0.2735, -0.4549, 0.1959]])
STIFFNESS = np.array([[1.578, -0.3065, 0.6138], [-0.3065, 1.5706, -0.4808], [0.6138, -0.4808, 2.6448]])
SYSTEM = Oscillator.of_structure(
    Matrices.create(MASS, STIFFNESS, DAMPING),
    np.array([1.0, -2.5, 0.3]),
    [
        force(1, np.array([1.0, -0.4, 0.2]), np.array([0.3, 0.0, 2.0])),
        force(2, np.array([0.1, 0.2, 0.0]), np.array([0.0, 1.0, 0.0]), unbalance=True),
    ],
    0.7,
    np.array([0.05, -0.02, 0.1]),
    restitution_left=0.45,
)
CLEARANCE = (0.9, 1.3)
ONCE = (1, -1, -1, 1)


def orbit_at(omega, period):
    guess = sequence_of_stops(SYSTEM, omega, CLEARANCE, period, ONCE * period)
    assert guess is not None
    return periodic_orbit(SYSTEM, omega, CLEARANCE, guess)


@functools.cache
def doublings():
    """The period doublings of 1-2r-2l over omega, on its own branch."""
    branch = orbit_branch(SYSTEM, orbit_at(0.93, 1), 0.8, 1.0, "omega")
    return sorted(point.omega for point in branch.special_points if point.type == "PD")


@pytest.mark.parametrize("omega", [0.87, 0.8872727, 0.89, 0.9])
def test_a_doubled_branch_ends_at_the_doublings_of_its_parent_wherever_it_begins(omega):
    branch = orbit_branch(SYSTEM, orbit_at(omega, 2), 0.7, 1.2, "omega")
    ends = sorted(branch.special_points, key=lambda point: point.omega)
    assert [(point.type, point.status) for point in ends] == [("PD", "converged")] * 2
    np.testing.assert_allclose([point.omega for point in ends], doublings(), rtol=1e-12)
    for point in ends:
        assert point.impacts.repeats_after(1e-12) == 1
        assert np.min(np.abs(point.multipliers - 1.0)) < 1e-7


@pytest.mark.parametrize("kind", ["PD", "SB"])
def test_a_branch_from_a_special_point_ends_at_that_point_to_round_off(kind):
    point = special(parent(kind), kind)
    (beyond,) = starts_beyond(DEFAULT, point)
    branch = orbit_branch(DEFAULT, orbit_of(beyond), 0.995 * point.clearance, 1.005 * point.clearance)
    ends = [one for one in branch.special_points if one.type == kind and abs(one.clearance - point.clearance) < 1e-6]
    assert [one.status for one in ends] == ["converged"]
    assert ends[0].clearance == pytest.approx(point.clearance, rel=1e-13)
    count = len(point.impacts.stops)
    np.testing.assert_allclose(ends[0].impacts.velocities[:count], point.impacts.velocities, rtol=1e-9)
