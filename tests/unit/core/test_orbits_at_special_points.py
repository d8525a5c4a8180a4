"""Orbits that are solved for at a special point, where the equations may be singular: any round-off gives the same."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.support.orbits import default_orbit, parent
from tests.support.oscillators import DEFAULT

ROUNDINGS = 24
"""Sequences beside each special point: its own, with every number one rounding away to either side at random."""


@functools.cache
def special_points():
    branches = [parent("PD"), parent("SB"), parent("one-sided")]
    branches += [orbit_branch(DEFAULT, default_orbit(label), 1.2, 1.8) for label in ("1-2r-2l", "3-4r-4l")]
    return [point for branch in branches for point in branch.special_points if point.status == "converged"]


def rounded(impacts, random):
    phases, velocities = (
        np.nextafter(values, values + random.integers(-1, 2, len(values)))
        for values in (impacts.phases, impacts.velocities)
    )
    return dataclasses.replace(impacts, phases=phases, velocities=velocities)


@pytest.mark.parametrize("kind", ["SN", "PD", "SB", "GR"])
def test_an_orbit_at_a_special_point_is_found_whatever_the_round_off(kind):
    random = np.random.default_rng(7)
    points = [point for point in special_points() if point.type == kind]
    assert points
    for point in points:
        for number in range(ROUNDINGS):
            guess = rounded(point.impacts, random) if number else point.impacts
            orbit = periodic_orbit(DEFAULT, point.omega, point.clearance, guess)
            assert orbit.converged, orbit.reason
            assert orbit.residual < 1e-14
            # at a saddle-node round-off moves the orbit, and its multipliers, by about its square root
            np.testing.assert_allclose(orbit.impacts.phases, point.impacts.phases, rtol=0, atol=1e-6)
            if kind != "GR":
                ours = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
                assert np.min(np.abs(ours - (1.0 if kind == "SN" else -1.0))) < 1e-4


def test_beside_a_saddle_node_the_reason_is_that_the_equations_are_singular():
    saddle_nodes = [point for point in special_points() if point.type == "SN"]
    assert saddle_nodes
    for point in saddle_nodes:
        orbits = [
            periodic_orbit(DEFAULT, point.omega, point.clearance * (1.0 + side), point.impacts)
            for side in (1e-10, -1e-10)
        ]
        stuck = [orbit for orbit in orbits if not orbit.converged]
        assert stuck  # on one side there is no orbit
        for orbit in stuck:
            assert "singular" in orbit.reason
            assert orbit.residual < 1e-8
