"""Branches over the restitution, against the closed forms at every restitution and the event-exact simulation."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from grazemap_core.continuation.bifurcation_curves import bifurcation_curve
from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbit_at
from tests.support.orbits import default_orbit, mismatch, orbit_of, start, tangent_flow
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused


def chain(restitution):
    return dataclasses.replace(DEFAULT, restitution=restitution)


def closed_form(omega, restitution, symmetric):
    return one_impact_branch(chain(restitution), omega, 1, symmetric)


def through(kind, omega, symmetric):
    """The branch over the restitution through an orbit next to a special point of the default system, and it."""
    known = closed_form(omega, DEFAULT.restitution, symmetric)
    (point,) = [p for p in known.special_points if p.type == kind and p.impact_velocity > 0.0]
    orbit = start(known, point.angle + 1e-3)
    return orbit_branch(DEFAULT, orbit, 0.0, 1.0, "restitution")


@pytest.mark.parametrize(
    ("kind", "omega", "symmetric"),
    [("SN", 0.27, False), ("PD", 0.285, False), ("SB", 0.27, True), ("GR", 0.27, False), ("GR", 0.27, True)],
)
def test_branches_over_restitution_are_the_closed_form_s_at_every_one(kind, omega, symmetric):
    branch = through(kind, omega, symmetric)
    assert branch.ends == ("range", "range")
    assert branch.parameter == "restitution"
    np.testing.assert_array_equal(branch.values, branch.restitution)
    assert np.max(branch.residual) <= 1e-14
    for restitution, speed, multipliers in zip(
        branch.restitution, branch.velocities[:, 0], branch.multipliers, strict=True
    ):
        known = closed_form(omega, float(restitution), symmetric)
        c, d = known.position_coefficient, known.velocity_coefficient
        gap = branch.clearance[0]
        assert math.hypot(gap + c * speed, d * speed) == pytest.approx(known.amplitude, rel=1e-12)
        if speed > 0.0:
            theirs = orbit_at(known, math.atan2(gap + c * speed, d * speed)).multipliers
            if abs(theirs[0]) < 100.0:
                assert mismatch(multipliers, theirs) < 1e-9
    points = [p for p in branch.special_points if p.type == kind and p.admissible]
    assert points
    for point in points:
        known = closed_form(omega, point.restitution, symmetric)
        (same,) = [p for p in known.special_points if p.type == kind and p.impact_velocity > 0.0]
        assert point.status == "converged"
        assert same.clearance == pytest.approx(point.clearance, rel=1e-10)
        assert same.impact_velocity == pytest.approx(point.impacts.velocities[0], rel=1e-6)


def test_an_orbit_with_four_impacts_is_that_of_the_simulation_at_every_restitution():
    orbit = default_orbit("1-2r-2l")
    branch = orbit_branch(DEFAULT, orbit, 0.6, 0.9, "restitution")
    compared = 0
    for index in range(0, len(branch.values), 4):
        oscillator = chain(float(branch.restitution[index]))
        impacts = dataclasses.replace(orbit.impacts, phases=branch.phases[index], velocities=branch.velocities[index])
        here = periodic_orbit(oscillator, orbit.omega, orbit.clearance, impacts)
        assert here.steps <= 1
        if not here.admissible:
            continue
        run = tangent_flow(oscillator, here)
        assert run.closing < 1e-12
        assert mismatch(branch.multipliers[index], run.multipliers) < 1e-9
        compared += 1
    assert compared >= 3


def test_what_is_beyond_a_special_point_has_its_restitution():
    branch = through("PD", 0.285, False)
    (point,) = [p for p in branch.special_points if p.type == "PD" and p.admissible]
    (beyond,) = starts_beyond(DEFAULT, point, "restitution")
    assert 0.0 < abs(beyond.restitution - point.restitution) < 1e-2
    assert (beyond.clearance, beyond.omega) == (point.clearance, point.omega)
    orbit = orbit_of(beyond)
    assert (orbit.label, orbit.isolated) == ("2-2r-(-1)l", True)
    low, high = beyond.restitution - 0.01, beyond.restitution + 0.01
    doubled = orbit_branch(chain(beyond.restitution), orbit, low, high, "restitution")
    assert doubled.period == 2
    assert any(
        p.type == "PD" and p.restitution == pytest.approx(point.restitution, abs=1e-8) for p in doubled.special_points
    )
    # and curves of the point in the plane of omega and clearance are those of its restitution
    curve = bifurcation_curve(DEFAULT, point, (0.284, 0.286), (1.8, 2.0))
    for omega, clearance in zip(curve.omega, curve.clearance, strict=True):
        known = closed_form(float(omega), point.restitution, False)
        (same,) = [p for p in known.special_points if p.type == "PD"]
        assert same.clearance == pytest.approx(clearance, rel=1e-10)


@pytest.mark.parametrize(("low", "high"), [(-0.1, 0.9), (0.5, 1.1), (0.9, 0.5), (0.1, 0.2), (0.85, 0.9)])
def test_invalid_ranges_of_restitution_are_refused(low, high):
    with refused("start"):
        orbit_branch(DEFAULT, default_orbit("1-2r-2l"), low, high, "restitution")
