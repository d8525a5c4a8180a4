"""Branches and curves over parameters of the structure: damping, a mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from grazemap_core.continuation.bifurcation_curves import bifurcation_curve
from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import OrbitPoint, orbit_branch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.model.oscillator import Oscillator, Variants
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.support.orbits import orbit_with
from tests.support.refused import refused

VALUES = {"damping": 1.0, "masses[2]": 10.0}
BIAS = np.array([0.02, 0.0, 0.01])


def chain(values):
    masses = [1.0, values["masses[2]"], 10.0]
    made = Oscillator.create(masses, [1.0, 5.0, 5.0], 0.05 * values["damping"], [1.0, 0.0, 0.0], 0.8)
    return replace(made, bias=BIAS)


OSCILLATOR = replace(chain(VALUES), variants=Variants(VALUES, chain))


def orbit_of(oscillator, omega=0.29, clearance=1.6, stops=(1, 1, -1, -1)):
    return orbit_with(oscillator, omega, clearance, 1, list(stops))


@pytest.fixture(scope="module")
def branch():
    return orbit_branch(OSCILLATOR, orbit_of(OSCILLATOR), 8.0, 12.0, "masses[2]")


def test_the_orbits_of_a_branch_over_a_mass_are_those_of_the_oscillators_with_that_mass(branch):
    assert len(branch.special_points) > 2
    for place in range(0, len(branch.values), 9):
        mass, impacts = branch.values[place], (branch.stops, branch.phases[place], branch.velocities[place])
        if not np.all(impacts[2] * impacts[0] > 0.0):
            continue
        alone = periodic_orbit(chain({**VALUES, "masses[2]": mass}), 0.29, 1.6, ImpactSequence.create(1, *impacts))
        assert alone.converged
        np.testing.assert_allclose(alone.impacts.whole.velocities, branch.velocities[place], atol=1e-12)
        np.testing.assert_allclose(abs(alone.multipliers[0]), abs(branch.multipliers[place][0]), rtol=1e-8)
        assert alone.admissible == branch.admissible[place]


def test_a_branch_over_another_parameter_keeps_the_mass_of_its_orbit():
    mass = 9.6
    alone = chain({**VALUES, "masses[2]": mass})
    orbit = orbit_of(alone)
    at = ParameterPoint.of(OSCILLATOR, 0.29, 1.6).varied("masses[2]", mass)
    ours = orbit_branch(OSCILLATOR, OrbitPoint(orbit, at), 1.55, 1.65)
    known = orbit_branch(alone, orbit, 1.55, 1.65)
    np.testing.assert_array_equal(ours.velocities, known.velocities)
    np.testing.assert_array_equal(ours.multipliers, known.multipliers)
    assert [point.clearance for point in ours.special_points] == [point.clearance for point in known.special_points]


def test_special_points_over_a_mass_have_their_multipliers(branch):
    seen = set()
    for point in branch.special_points:
        if point.type in ("SN", "PD"):
            oscillator = point.values.applied(OSCILLATOR)
            assert oscillator.masses[1] == dict(point.values.structure)["masses[2]"]
            orbit = periodic_orbit(oscillator, point.omega, point.clearance, point.impacts.whole)
            value = 1.0 if point.type == "SN" else -1.0
            assert np.min(np.abs(orbit.multipliers - value)) < 1e-4
            seen.add(point.type)
            for start in starts_beyond(OSCILLATOR, point, "masses[2]"):
                other = start.values.applied(OSCILLATOR)
                beyond = periodic_orbit(other, start.omega, start.clearance, start.impacts.whole)
                assert beyond.converged
    assert seen == {"SN", "PD"}


def test_a_curve_over_damping_and_a_mass_keeps_its_multiplier(branch):
    point = next(special for special in branch.special_points if special.type == "PD")
    mass = dict(point.values.structure)["masses[2]"]
    curve = bifurcation_curve(
        OSCILLATOR, point, (mass - 0.3, mass + 0.3), (0.9, 1.1), plane=("masses[2]", "damping"), longest_step=0.1
    )
    assert len(curve.points) > 4
    assert np.ptp(curve.vertical) > 0.01
    nearest = []
    for place in range(0, len(curve.points), 3):
        oscillator = curve.points[place].applied(OSCILLATOR)
        impacts = ImpactSequence.create(curve.period, curve.stops, curve.phases[place], curve.velocities[place])
        orbit = periodic_orbit(oscillator, curve.omega[place], 1.6, impacts.whole)
        if orbit.converged:
            nearest.append(np.min(np.abs(orbit.multipliers + 1.0)))
    assert nearest
    assert max(nearest) < 1e-6


@pytest.mark.parametrize(
    ("parameter", "start", "stop", "name"),
    [("masses[2]", 0.0, 12.0, "start"), ("damping", -0.1, 2.0, "start"), ("masses[3]", 8.0, 12.0, "parameter")],
)
def test_a_range_out_of_the_domain_or_a_parameter_that_does_not_vary_is_refused(parameter, start, stop, name):
    with refused(name):
        orbit_branch(OSCILLATOR, orbit_of(OSCILLATOR), start, stop, parameter)
