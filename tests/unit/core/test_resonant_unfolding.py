"""Curves that leave the resonant points, against polynomials through 50-digit orbits without the closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from flint import arb
from scipy.linalg import eigvalsh

from grazemap_core.grazing import codimension_two
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.single_impact.harmonics import Places
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits, polynomial
from tests.oracles.impact_orbit_oracle import OneImpact
from tests.support.orbits import one_impact_motions, special_motion
from tests.support.oscillators import DEFAULT

PER_LINK = Oscillator.create([1.0, 3.0], [1.0, 2.0], [0.05, 0.2], [1.0, 0.5], 0.6)
ONE_MASS = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
NODES = 5


def resonant(oscillator, start, stop, multiple):
    points = codimension_two_points(oscillator, start, stop, max_order=1, max_multiple=multiple)
    return [point for point in points if point.kind == "resonant"]


def half_periods(point):
    return point.multiple if point.symmetric else 2 * point.multiple


def fitted(oscillator, point):
    """Coefficients of b - A and of v on the curve, as polynomials in the distance from the point, from exact orbits."""
    unfolding = point.unfolding
    fastest = math.sqrt(eigvalsh(oscillator.stiffness_matrix, oscillator.mass_matrix)[-1])
    step = 2e-4 * point.omega**2 / (fastest * half_periods(point) * math.pi)
    # steep curves bend soon: impact speeds stay small against those of the steady motion
    step = min(step, 2e-5 * point.omega * point.clearance / unfolding.velocity_slope)
    multiplier = 1 if point.bifurcation == "SN" else -1
    with digits():
        places, heights, speeds = [], [], []
        for k in range(1, NODES + 1):
            omega = arb(point.omega) + arb(unfolding.curve_omega * k) * arb(step)
            family = OneImpact(oscillator, omega, half_periods(point), -1 if point.symmetric else 1)
            ((_, _, steady),) = family.linear.amplitudes(omega)
            curves = one_impact_branch(oscillator, float(omega), point.multiple, point.symmetric)
            near = [p.angle for p in curves.special_points if p.type == point.bifurcation]
            # the closed form only says where to look: 1 % beside it
            start = 0.5 * math.pi - 1.01 * (0.5 * math.pi - near[0])
            phase = family.special(multiplier, start - curves.phase)
            places.append(omega - arb(point.omega))
            heights.append(family.gap(phase) - abs(steady[0]))
            speeds.append(family.speed(phase))
            assert speeds[-1] > 0
        return [float(a) for a in polynomial(places, heights)], [float(a) for a in polynomial(places, speeds)]


def check(oscillator, point):
    """Return the relative errors of the leading coefficient and of the velocity's, and the linear coefficient."""
    unfolding = point.unfolding
    height, speed = fitted(oscillator, point)
    if unfolding.contact == "tangent":
        assert unfolding.slope == 0.0
        error = abs(height[2] / unfolding.quadratic - 1.0)
        assert (height[2] > 0.0) == (unfolding.curve_clearance > 0)
    else:
        assert unfolding.quadratic is None
        error = abs(height[1] / unfolding.slope - 1.0)
        assert (height[1] * unfolding.curve_omega > 0.0) == (unfolding.curve_clearance > 0)
    return error, abs(abs(speed[1]) / unfolding.velocity_slope - 1.0), height


@pytest.fixture(scope="module")
def default_points():
    return resonant(DEFAULT, 0.2, 1.2, 4)


@pytest.mark.thorough
def test_the_curves_of_every_point_leave_as_exact_orbits_do(default_points):
    assert len(default_points) > 150
    assert {(p.bifurcation, p.symmetric) for p in default_points} == {
        ("SN", False),
        ("PD", False),
        ("SN", True),
        ("SB", True),
    }
    errors, speeds, tangency = [], [], []
    for point in default_points:
        error, speed, height = check(DEFAULT, point)
        errors.append(error)
        speeds.append(speed)
        if point.bifurcation == "SN":
            tangency.append(abs(height[1]))
            assert point.unfolding.contact == "tangent"
        else:
            assert point.unfolding.contact == "transversal"
            assert abs(point.unfolding.slope) > 1e-6
    assert max(errors) < 1e-7
    assert max(speeds) < 1e-9
    assert max(tangency) < 1e-9


def test_a_wrong_coefficient_is_detected(default_points):
    saddle = next(p for p in default_points if p.bifurcation == "SN")
    wrong = replace(saddle, unfolding=replace(saddle.unfolding, quadratic=saddle.unfolding.quadratic * 1.0001))
    assert check(DEFAULT, wrong)[0] > 0.9e-4
    # the derivative of H alone, without (1 + R): what a slip in the formula would give
    slipped = replace(saddle, unfolding=replace(saddle.unfolding, quadratic=saddle.unfolding.quadratic / 1.8**2))
    assert check(DEFAULT, slipped)[0] > 1.0


def test_damping_per_link_and_a_forced_second_mass():
    points = resonant(PER_LINK, 0.3, 1.5, 3)
    assert len(points) > 40
    for point in points:
        error, speed, height = check(PER_LINK, point)
        assert max(error, speed) < 1e-7
        if point.bifurcation == "SN":
            assert abs(height[1]) < 1e-9


def test_one_mass_has_period_doubling_tangent_too():
    points = resonant(ONE_MASS, 0.3, 2.5, 2)
    assert len(points) > 20
    assert {p.bifurcation for p in points} == {"SN", "PD", "SB"}
    for point in points:
        error, speed, height = check(ONE_MASS, point)
        assert max(error, speed) < 1e-7
        assert point.unfolding.contact == "tangent"
        assert abs(height[1]) < 1e-6 * (1.0 + abs(height[2]))


def test_reference_numbers_of_the_default_system(default_points):
    near = {p.bifurcation: p.unfolding for p in default_points if p.multiple == 1 and 0.2795 < p.omega < 0.2825}
    assert near["SN"].quadratic == pytest.approx(122.4553, abs=5e-5)
    assert near["PD"].slope == pytest.approx(0.493, abs=5e-4)
    assert (near["SN"].curve_omega, near["SN"].orbits_before, near["SN"].orbits_after) == (-1, 1, -1)
    assert (near["PD"].curve_omega, near["PD"].curve_clearance) == (1, 1)


def test_the_sides_are_those_of_the_branches_beside_the_points(default_points):
    for point in default_points[::3]:
        for side, orbits in ((-1, point.unfolding.orbits_before), (1, point.unfolding.orbits_after)):
            omega = point.omega + side * 1e-5 * point.omega**2 / point.multiple
            branch = one_impact_branch(DEFAULT, omega, point.multiple, point.symmetric)
            slow = 0.5 * math.pi - 1e-9
            assert (branch.clearance(slow) > branch.amplitude) == (orbits > 0)
            kinds = [p.type for p in branch.special_points if p.angle > 0.5 * math.pi - 0.05]
            assert (point.bifurcation in kinds) == (side == point.unfolding.curve_omega)


def test_admissible_points_have_admissible_orbits_and_the_others_none(default_points):
    decided = [p for p in default_points if p.unfolding.admissible is not None]
    assert len(decided) == len(default_points)
    assert len({p.unfolding.admissible for p in decided}) == 2
    for point in decided:
        motions = one_impact_motions(DEFAULT, point.omega, point.multiple, point.symmetric)
        assert motions.admissible_from[0].any == point.unfolding.admissible


def test_admissibility_is_undecided_for_one_mass_at_a_point_of_a_smaller_order():
    # three whole oscillations in half a forcing period: mass 1 is back at the other stop, to leading order
    points = resonant(ONE_MASS, 0.33, 0.34, 1)
    one_sided = [p for p in points if not p.symmetric]
    assert [p.unfolding.admissible for p in one_sided] == [None, None]
    assert all(p.unfolding.admissible and p.unfolding.margin is None for p in points if p.symmetric)
    motions = one_impact_motions(ONE_MASS, one_sided[0].omega)
    (begin,) = motions.admissible_from
    assert begin.any is None
    assert [orbit.admissible for orbit in motions.special("GR")] == [None]
    # the motions of a speed that can be seen are decided
    fast = begin.phase - np.array([0.1, 1.0])
    assert [orbit.admissible for orbit in motions.orbits_at(Places.of(fast))] == [False, False]


def test_points_of_no_known_direction_have_no_unfolding():
    points = codimension_two_points(DEFAULT, 0.25, 0.35, max_order=2, max_multiple=1)
    assert all(p.unfolding is None for p in points if p.kind == "recurrence")
    assert all(p.unfolding is not None for p in points if p.kind == "resonant")
    assert all(abs(p.unfolding.transversality) > 1.0 for p in points if p.kind == "resonant")


def test_a_near_double_point_has_no_unfolding(monkeypatch):
    isolate = codimension_two.isolate

    def doubled(*args):
        zeros, kinds, status = isolate(*args)
        return zeros, np.ones_like(kinds), status

    monkeypatch.setattr(codimension_two, "isolate", doubled)
    points = codimension_two_points(DEFAULT, 0.28, 0.29, max_order=1, max_multiple=1)
    assert points
    assert all(p.status == "near-double" and p.unfolding is None for p in points)


def test_curves_begin_at_their_points(default_points):
    saddle = next(p for p in default_points if p.bifurcation == "SN" and p.multiple == 1 and not p.symmetric)
    side = saddle.unfolding.curve_omega
    omega = saddle.omega + np.array([side, -side]) * 1e-6
    begins, virtual = (special_motion(one_impact_motions(DEFAULT, float(at)), "SN") for at in omega)
    rise = begins.gap - grazing_curve(DEFAULT, omega[:1]).clearance[0]
    assert rise == pytest.approx(saddle.unfolding.quadratic * 1e-12, rel=1e-3)
    assert virtual is None
