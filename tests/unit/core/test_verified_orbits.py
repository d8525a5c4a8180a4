"""Properties of an orbit: isolated, admissible, stable, and verified, which is all three and the minimum period."""

import numpy as np
import pytest

from grazemap_core.continuation.branches import OrbitBranch, orbit_branch
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from tests.support.orbits import orbit_with
from tests.support.oscillators import DEFAULT

OMEGA, CLEARANCE = 0.27, 1.85
FIELDS = ("isolated", "admissible", "stable", "verified")


def known() -> PeriodicOrbit:
    return orbit_with(DEFAULT, OMEGA, CLEARANCE, 1, [1])


@pytest.fixture(scope="module")
def branch() -> OrbitBranch:
    """Through a saddle-node, a period doubling and a graze."""
    return orbit_branch(DEFAULT, known(), 1.4, 2.2)


def properties(orbit: PeriodicOrbit) -> tuple[bool, ...]:
    return orbit.isolated, orbit.admissible, orbit.stable, orbit.verified


def test_a_stable_orbit_is_verified() -> None:
    orbit = known()
    assert properties(orbit) == (True, True, True, True)
    assert orbit.motion.verified


def test_an_orbit_taken_twice_is_not_verified() -> None:
    """It is isolated, admissible and stable, but its period is not the least."""
    impacts = known().impacts
    twice = ImpactSequence.create(
        2,
        np.tile(impacts.stops, 2),
        np.concatenate([impacts.phases, impacts.phases + 2.0 * np.pi]),
        np.tile(impacts.velocities, 2),
    )
    orbit = periodic_orbit(DEFAULT, OMEGA, CLEARANCE, twice)
    assert orbit.least_period == 1
    assert properties(orbit) == (True, True, True, False)
    assert not orbit.motion.verified


def test_a_branch_gives_its_orbits_the_properties_that_they_have_alone(branch: OrbitBranch) -> None:
    for i in range(0, len(branch.values), 3):
        impacts = ImpactSequence(branch.period, branch.stops, branch.phases[i], branch.velocities[i], branch.symmetric)
        orbit = periodic_orbit(DEFAULT, OMEGA, float(branch.clearance[i]), impacts)
        assert tuple(bool(getattr(branch, name)[i]) for name in FIELDS) == properties(orbit), i
    np.testing.assert_array_equal(branch.verified, branch.isolated & branch.admissible & branch.stable)
    # unstable orbits and virtual impacts are isolated too, and not verified
    assert branch.verified.any()
    assert (branch.isolated & ~branch.stable).any()
    assert (branch.isolated & ~branch.admissible).any()
    assert branch.isolated.mean() > 0.9
