"""The discontinuity mapping: the exact one against 60 digits, the expansion against the exact one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.grazing.discontinuity_mapping import (
    beyond_stop,
    exact_mapping,
    largest_overshoot,
    leading_mapping,
    mapping_error,
    overshoot_of,
)
from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop
from grazemap_core.grazing.point import grazing_point
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import digits
from tests.oracles.graze_oracle import PRECISION, GrazeOracle
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import random_grazing_points
from tests.support.random_systems import general_grazing_points

OVERSHOOTS = 10.0 ** np.arange(-10.0, -3.5)


def remainder(point, overshoots=OVERSHOOTS):
    """(error - gamma u^2)/(|gamma| u^2) of the leading-order mapping, sizes as the point measures them."""
    error = mapping_error(point, overshoots * point.amplitude)
    u = np.sqrt(2.0 * error.overshoot / abs(point.acceleration))
    return error.second / (point.size(point.gamma) * u * u)


def slope(overshoots, values):
    return np.polyfit(np.log(overshoots), np.log(values), 1)[0]


def error_beside_oracle(point, deviation, scan=False):
    """Error of the exact mapping in 60 digits, and the displacement, both as sizes."""
    oracle = GrazeOracle.of(point)
    ours = exact_mapping(point, deviation).displacement
    exact = oracle.mapped(deviation.tolist(), scan)
    with digits(PRECISION):
        error = np.array([float(arb(float(mine)) - theirs) for mine, theirs in zip(ours, exact, strict=True)])
    return point.size(error), point.size(ours)


def test_the_second_order_coefficient_is_the_remainder_of_the_leading_order():
    for point in random_grazing_points(1, 20, 2.0):
        left = remainder(point)
        # a wrong coefficient would leave a constant; the third order falls as the square root of the overshoot
        assert slope(OVERSHOOTS, left) == pytest.approx(0.5, abs=0.02)
        assert left[0] < 1e-3
        error = mapping_error(point, OVERSHOOTS * point.amplitude)
        assert error.leading_order == pytest.approx(1.0, abs=0.02)
        assert error.second_order == pytest.approx(1.5, abs=0.02)


def test_the_expansion_holds_for_any_structure_and_any_harmonics():
    """Dense and gyroscopic matrices, any row, a bias, two restitutions; the maximum of several harmonics is skew."""
    points, few = general_grazing_points(6), OVERSHOOTS[1::2]
    assert sum(len(point.orders) > 1 for point in points) > 2
    for point in points:
        assert slope(few, remainder(point, few)) == pytest.approx(0.5, abs=0.05)
        error = mapping_error(point, few * point.amplitude)
        assert error.leading_order == pytest.approx(1.0, abs=0.03)
        assert error.second_order == pytest.approx(1.5, abs=0.03)


@pytest.mark.parametrize("term", ["jerk", "damping"])
def test_a_second_order_term_of_general_systems_that_is_left_out_is_detected(term):
    point = next(point for point in general_grazing_points(12) if len(point.orders) > 1)
    jump, restitution = point.oscillator.jump, point.oscillator.restitution_of(point.stop)
    wrong = point.gamma.copy()
    if term == "jerk":
        jerk = -np.sum((point.orders * point.omega) ** 3 * point.contact_steady.real)
        wrong[1::2] += (1.0 + restitution) * jerk / 3.0 * jump
    else:
        coupling = point.oscillator.structure.solve_mass(point.oscillator.damping_matrix @ jump)
        wrong[1::2] -= restitution * (1.0 + restitution) * point.acceleration * coupling
    off = remainder(replace(point, gamma=wrong))
    assert abs(slope(OVERSHOOTS, off) - 0.5) > 0.1


def test_the_exact_mapping_of_any_structure_is_that_of_sixty_digits():
    for point in general_grazing_points(6):
        assert point.clearance == pytest.approx(
            float(GrazeOracle.of(point).gap) + point.stop * contact_equilibrium(point.oscillator), rel=1e-13
        )
        for overshoot in (1e-3, 1e-6, 1e-9):
            error, size = error_beside_oracle(point, beyond_stop(point, overshoot * point.amplitude))
            # several harmonics cancel at the graze to round-off
            assert error < 1e-13 * size + 1e-15 * (len(point.orders) - 1) * point.size(point.state)


@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_without_any_rebound_and_without_any_loss_the_expansion_holds_too(restitution):
    for point in random_grazing_points(7, 8, 2.0):
        oscillator = replace(point.oscillator, restitution=restitution)
        other = grazing_point(oscillator, point.omega, point.varied)
        assert slope(OVERSHOOTS, remainder(other)) == pytest.approx(0.5, abs=0.02)
        mapping = exact_mapping(other, beyond_stop(other, 1e-6 * other.clearance))
        # nothing of the overshoot is left, or all of it but for higher orders
        left = overshoot_of(other, mapping.deviation) / (1e-6 * other.clearance)
        assert left == pytest.approx(restitution, abs=0.05)


@pytest.mark.parametrize("entry", range(7))
def test_a_coefficient_wrong_by_a_percent_is_detected(entry):
    point = grazing_point(DEFAULT, 0.29)
    wrong = point.gamma.copy()
    wrong[entry] *= 1.01
    off = remainder(replace(point, gamma=wrong))
    # the velocity of mass 1 has no second order: the surface is v_1 = 0
    assert (abs(slope(OVERSHOOTS, off) - 0.5) > 0.02) == (entry != 1)


@pytest.mark.thorough
def test_the_exact_mapping_is_accurate_to_the_round_off_of_its_displacement():
    worst = 0.0
    random = np.random.default_rng(3)
    for point in random_grazing_points(2, 20, 2.0):
        for overshoot in (1e-3, 1e-6, 1e-9, 1e-12, 1e-15):
            for elsewhere in (0.0, 1e-3):
                deviation = beyond_stop(point, overshoot * point.clearance)
                # masses and phase that are not those of the graze: the overshoot is small against them
                deviation[2:] += elsewhere * point.clearance * random.normal(size=len(deviation) - 2)
                error, size = error_beside_oracle(point, deviation)
                worst = max(worst, error / size)
    print(f"worst error of the exact mapping relative to the displacement: {worst:.1e}")
    assert worst < 3e-15


def test_the_impact_of_the_exact_mapping_is_on_the_stop_and_the_result_on_the_surface():
    for point in random_grazing_points(4, 20, 2.0):
        depth = 1e-5 * point.clearance
        mapping = exact_mapping(point, beyond_stop(point, 1e-4 * point.clearance, depth), depth)
        assert mapping.impact[0] == -point.stop * depth
        assert mapping.impact[1] == mapping.velocity
        assert mapping.velocity * point.stop > 0.0
        assert mapping.deviation[1] == 0.0
        # behind the impact it would have gone as far beyond the stop as R^2 of the overshoot, to leading order
        beyond = overshoot_of(point, mapping.deviation, depth) / (1e-4 * point.clearance)
        assert beyond == pytest.approx(point.oscillator.restitution**2, abs=0.05)


def test_a_state_inside_the_stop_is_mapped_to_itself():
    point = grazing_point(DEFAULT, 0.29, replace(ALIKE, stop=-1))
    inside = beyond_stop(point, -1e-6)
    inside[3] = 0.25
    np.testing.assert_array_equal(leading_mapping(point, inside), inside)
    # stops a little inside the steady amplitude: there the graze itself overshoots by the depth
    graze = np.zeros_like(inside)
    depth = 1e-6
    assert overshoot_of(point, graze, depth) == depth
    step = leading_mapping(point, graze, depth)
    np.testing.assert_array_equal(step, point.beta * np.sqrt(2.0 * depth / abs(point.acceleration)))


def test_both_stops_are_mirror_images():
    for point in random_grazing_points(5, 8, 2.0):
        other = point.next()
        np.testing.assert_array_equal(other.next().state[:-1], point.state[:-1])
        direct = grazing_point(point.oscillator, point.omega, other.varied)
        np.testing.assert_allclose(direct.state, other.state, rtol=1e-14, atol=1e-14 * point.clearance)
        here = exact_mapping(point, beyond_stop(point, 1e-4 * point.clearance)).displacement
        there = exact_mapping(other, beyond_stop(other, 1e-4 * point.clearance)).displacement
        np.testing.assert_allclose(there[:-1], -here[:-1], rtol=1e-12, atol=1e-14 * point.clearance)
        assert there[-1] == pytest.approx(here[-1], rel=1e-13)


@pytest.mark.thorough
def test_the_mapping_exists_exactly_up_to_the_stated_end_of_its_domain():
    bounded = 0
    for point in [grazing_point(DEFAULT, 0.29), *random_grazing_points(6, 8, 2.0)]:
        limit = largest_overshoot(point)
        if not np.isfinite(limit):
            exact_mapping(point, beyond_stop(point, 500.0 * point.clearance))
            continue
        bounded += 1
        exact_mapping(point, beyond_stop(point, limit))
        error, size = error_beside_oracle(point, beyond_stop(point, 0.9 * limit), scan=True)
        assert error < 1e-13 * size
        with pytest.raises(ParameterError, match="overshoot: is beyond the mapping's domain"):
            exact_mapping(point, beyond_stop(point, limit * (1.0 + 1e-5)))
    assert bounded >= 3


def test_after_an_impact_pressed_against_the_stop_there_is_no_mapping():
    # one mass, R = 0: the impact takes all speed and with it the damper's pull
    oscillator = Oscillator.create([1.0], [1.0], 0.5, [1.0], 0.0)
    point = grazing_point(oscillator, 2.0)
    limit = largest_overshoot(point)
    mapping = exact_mapping(point, beyond_stop(point, limit))
    # at rest on the stop the forcing and the spring just balance there
    assert np.sin(point.state[-1] + mapping.impact[-1]) == pytest.approx(point.clearance, abs=1e-5)
    with pytest.raises(ParameterError, match="accelerated toward the stop"):
        exact_mapping(point, beyond_stop(point, limit * 1.00001))


def test_states_without_a_mapping_are_refused():
    point = grazing_point(DEFAULT, 0.29)
    with pytest.raises(ParameterError, match="overshoot"):
        exact_mapping(point, beyond_stop(point, 0.0))
    with pytest.raises(ParameterError, match="overshoot"):
        exact_mapping(point, beyond_stop(point, -1e-3))
    for overshoots in ([[1e-3]], [np.nan], [-1e-3]):
        with pytest.raises(ParameterError, match="overshoot"):
            mapping_error(point, overshoots)
    moving = beyond_stop(point, 1e-3)
    moving[1] = 1e-9
    for deviation in (moving, moving[:-1], np.full(7, np.nan)):
        with pytest.raises(ParameterError, match="deviation"):
            exact_mapping(point, deviation)
    with pytest.raises(ParameterError, match="stop"):
        grazing_point(DEFAULT, 0.29, VariedStop(0))
    with pytest.raises(SteadyMotionError):
        grazing_point(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.5)
