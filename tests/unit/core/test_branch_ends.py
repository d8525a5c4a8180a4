"""Where a branch ends on another one: type and place do not depend on where the branch is begun, nor on round-off."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from flint import arb

from grazemap_core.continuation.branch_switching import as_on_curve, starts_beyond
from grazemap_core.continuation.branches import OrbitPoint, orbit_branch
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import solved
from tests.support.general_systems import with_orbit
from tests.support.orbits import orbit_with

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
    return orbit_with(SYSTEM, omega, CLEARANCE, period, ONCE * period)


@functools.cache
def doublings():
    """The period doublings of 1-2r-2l over omega, on its own branch."""
    branch = orbit_branch(SYSTEM, orbit_at(0.93, 1), 0.8, 1.0, "omega")
    return sorted(point.omega for point in branch.special_points if point.type == "PD")


@pytest.mark.thorough
@pytest.mark.parametrize("omega", [0.8872727, 0.87, 0.89, 0.9])
def test_a_doubled_branch_ends_at_the_doublings_of_its_parent_wherever_it_begins(omega):
    branch = orbit_branch(SYSTEM, orbit_at(omega, 2), 0.7, 1.2, "omega")
    ends = sorted(branch.special_points, key=lambda point: point.omega)
    assert [(point.type, point.status) for point in ends] == [("PD", "converged")] * 2
    np.testing.assert_allclose([point.omega for point in ends], doublings(), rtol=1e-12)
    for point in ends:
        assert point.impacts.repeats_after(1e-12) == 1
        assert np.min(np.abs(point.multipliers - 1.0)) < 1e-7


@functools.cache
def meeting_of_impacts():
    """A branch whose second and third impact, both on the left stop, come together; its oscillator."""
    system, orbit = with_orbit(35)
    return system, orbit_branch(system.oscillator, orbit, 0.745, 0.87, "omega")


def test_a_branch_ends_where_impacts_on_one_stop_come_together():
    system, branch = meeting_of_impacts()
    (end,) = (point for point in branch.special_points if point.impact is not None)
    assert branch.ends == ("range", "together")
    assert (end.type, end.status, end.reason, end.impact, end.stop) == ("GR", "converged", "", 1, -1)
    assert end.segment == len(branch.values) - 2
    assert branch.values[-1] == end.omega
    assert end.impacts.phases[1] == end.impacts.phases[2] == end.phase
    np.testing.assert_array_equal(end.impacts.velocities[1:], 0.0)
    # before it the velocities have nearly the ratio of the restitution, and the impacts their order
    before = branch.velocities[-2]
    assert before[2] / before[1] == pytest.approx(system.oscillator.restitution_of(-1), rel=1e-2)
    assert np.all(np.diff(branch.phases, axis=1)[:-1] > 0.0)


def test_impacts_that_come_together_graze_in_the_motion_without_all_but_one():
    """In 50 digits: the velocity of the impact on the left stop vanishes at the end of the branch."""
    system, branch = meeting_of_impacts()
    end = branch.special_points[-1]
    alone, impact = as_on_curve(end)
    np.testing.assert_array_equal(alone.stops, [1, -1])
    places = [end.omega * (1.0 + side * 1e-7) for side in (-1.0, 1.0)]
    first, second = (solved(system.oscillator, omega, system.clearance, alone).velocities[impact] for omega in places)
    with digits():
        zero = (arb(places[0]) * second - arb(places[1]) * first) / (second - first)
        assert abs(float(zero / end.omega - 1)) < 1e-12


@pytest.mark.thorough
def test_a_branch_ends_at_one_meeting_of_impacts_wherever_it_begins():
    system, branch = meeting_of_impacts()
    place = len(branch.values) - 6
    values = branch.points[place]
    impacts = ImpactSequence(1, branch.stops, branch.phases[place], branch.velocities[place])
    there = OrbitPoint(periodic_orbit(system.oscillator, values.omega, values.clearance, impacts), values)
    other = orbit_branch(system.oscillator, there, 0.85, 0.87, "omega")
    ends = [path.special_points[-1] for path in (branch, other)]
    assert [end.impact for end in ends] == [1, 1]
    assert ends[1].omega == pytest.approx(ends[0].omega, rel=1e-13)


def test_the_switch_at_a_meeting_of_impacts_leads_to_the_motion_with_one_of_them():
    system, branch = meeting_of_impacts()
    (start,) = starts_beyond(system.oscillator, branch.special_points[-1], "omega")
    orbit = periodic_orbit(system.oscillator, start.omega, start.clearance, start.impacts)
    assert orbit.converged
    np.testing.assert_array_equal(orbit.impacts.stops, [1, -1])
