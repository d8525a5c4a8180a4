"""The composed Poincare map: its parts against 60 digits, the whole against the motion followed event by event."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from grazemap_core.errors import ParameterError
from grazemap_core.grazing.discontinuity_mapping import beyond_stop, exact_mapping, leading_mapping
from grazemap_core.grazing.grazing_curve import ALIKE, grazing_curve
from grazemap_core.grazing.poincare_map import (
    compare_returns,
    flow_jacobian,
    mapped_return,
    mapped_returns,
    return_jacobian,
    return_map,
    simulated_returns,
    surface_projection,
)
from grazemap_core.grazing.point import grazing_point
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import digits
from tests.oracles.graze_oracle import PRECISION, GrazeOracle
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import random_grazing_points
from tests.support.random_systems import general_grazing_points


def mirrored(deviation):
    """The mirror image S x: displacements and velocities negated, theta unchanged."""
    return np.append(-deviation[:-1], deviation[-1])


def random_deviation(random, point, size):
    deviation = size * point.amplitude * random.normal(size=len(point.state))
    return point.with_contact(deviation, point.contact_of(deviation)[0], 0.0)


def slope(overshoots, errors):
    return np.polyfit(np.log(overshoots), np.log(errors), 1)[0]


def test_the_return_map_is_right_to_round_off_of_the_deviation():
    random = np.random.default_rng(1)
    for point in [*random_grazing_points(1, 16, 1.5), *general_grazing_points(6)]:
        oracle = GrazeOracle.of(point)
        for size in (1e-3, 1e-9):
            deviation = random_deviation(random, point, size)
            ours = return_map(point, deviation)
            exact = oracle.returned(deviation.tolist(), point.varied.alike)
            with digits(PRECISION):
                error = np.array([float(arb(float(mine)) - theirs) for mine, theirs in zip(ours, exact, strict=True)])
            # dense matrices round more; several harmonics cancel at the graze to round-off
            rounding = 1e-14 if point.varied.alike else 1e-13
            assert point.size(error) < rounding * point.size(deviation) + 1e-15 * (len(point.orders) - 1)


def test_the_jacobian_is_the_derivative_of_the_return_map():
    for point in [*random_grazing_points(2, 8, 1.5), *general_grazing_points(4)]:
        jacobian = return_jacobian(point)
        assert point.size(jacobian @ point.vector_field) < 1e-14 * point.size(point.vector_field)  # (49), (50)
        onward = flow_jacobian(point) @ point.vector_field  # (48)
        assert point.size(onward - point.next().vector_field) < 1e-14 * point.size(point.vector_field)
        row = np.append(np.stack([np.zeros(point.oscillator.size), point.oscillator.contact], axis=1).ravel(), 0.0)
        assert np.max(np.abs(row @ jacobian)) <= 1e-15 * np.abs(jacobian).max() * (not point.varied.alike)
        across = surface_projection(point.next())
        np.testing.assert_allclose(across @ across, across, atol=1e-13)
        for entry in range(len(point.state)):
            step = np.zeros(len(point.state))
            step[entry] = 1e-5
            step = point.with_contact(step, point.contact_of(step)[0], 0.0)
            central = (return_map(point, step) - return_map(point, -step)) / 2e-5
            np.testing.assert_allclose(jacobian @ step * 1e5, central, rtol=0, atol=1e-7 * np.abs(jacobian).max())


def test_the_poincare_map_is_the_square_of_its_symmetric_root():
    random = np.random.default_rng(3)
    for point in random_grazing_points(3, 8, 1.5):
        deviation = random_deviation(random, point, 1e-4)
        for mapping in ("leading", "exact"):
            if deviation[0] * point.stop < 0.0:
                deviation = mirrored(deviation)
            across = mapped_return(point, deviation, mapping=mapping)
            whole = mapped_return(point.next(), across, mapping=mapping)
            twice = mirrored(mapped_return(point, mirrored(across), mapping=mapping))
            np.testing.assert_allclose(twice, whole, rtol=1e-11, atol=1e-15 * point.clearance)


def test_the_linear_form_is_that_of_the_paper():
    point = grazing_point(DEFAULT, 0.29)
    deviation = beyond_stop(point, 1e-10)
    u = np.sqrt(2e-10 / abs(point.acceleration))
    expected = return_jacobian(point) @ (deviation + u * point.beta)
    np.testing.assert_allclose(mapped_return(point, deviation), expected, rtol=0, atol=10.0 * u * u)
    # without an impact it is the smooth map
    np.testing.assert_array_equal(mapped_return(point, -deviation), return_map(point, -deviation))


def test_with_the_exact_mapping_the_composed_map_is_the_motion_itself():
    worst = 0.0
    for point in random_grazing_points(4, 16, 1.5):
        for overshoot in (1e-3, 1e-5, 1e-7):
            deviation = beyond_stop(point, overshoot * point.clearance)
            comparison = compare_returns(point, deviation, 3, mapping="exact")
            worst = max(worst, np.nanmax(comparison.error))
            assert np.all(np.isfinite(comparison.error[:2]))
            # and from the steady motion itself, stops being inside its amplitude
            depth = overshoot * point.clearance
            comparison = compare_returns(point, np.zeros_like(deviation), 3, depth, mapping="exact")
            worst = max(worst, np.nanmax(comparison.error))
            assert comparison.simulated.overshoot[0] == depth
    print(f"worst distance of the exact composed map from the motion: {worst:.1e}")
    assert worst < 1e-11


def test_with_the_exact_mapping_the_composed_map_is_the_motion_of_any_structure():
    """Dense matrices, any row, two harmonics, a bias; and both stops at once, with different restitutions."""
    masses, stiffnesses = [[2.0, 0.3], [0.3, 1.0]], [[3.0, -1.0], [-1.0, 2.0]]
    structure = Matrices.create(masses, stiffnesses, [[0.2, 0.05], [0.05, 0.1]])
    two = Oscillator.of_structure(structure, [1.0, -1.0], [force(1, np.array([1.0, -0.4]))], 0.7, restitution_left=0.4)
    points = [*general_grazing_points(4), grazing_point(two, 0.7), grazing_point(two, 0.7, replace(ALIKE, stop=-1))]
    assert points[-1].next().stop == 1
    for point in points:
        for depth in (1e-4, 1e-6):
            returns = compare_returns(point, np.zeros(len(point.state)), 3, depth * point.amplitude, "exact")
            # a run starts on the stop to the round-off of a difference, over an impact velocity of sqrt(depth)
            assert np.all(returns.error < 1e-14 / depth**0.5)
            assert returns.simulated.overshoot[0] == depth * point.amplitude


def errors_of_second_return(point, overshoots):
    comparisons = [compare_returns(point, beyond_stop(point, x * point.clearance), 2) for x in overshoots]
    return np.array([comparison.error for comparison in comparisons])


@pytest.mark.thorough
def test_the_leading_order_errs_by_the_overshoot_or_by_its_root_where_the_first_return_hits_again():
    # the mapping errs by gamma u^2, so the first return by O(u^2); a return that hits does so with an overshoot of
    # O(u), at which the mapping errs by O(u) itself
    kinds = {True: 0, False: 0}
    for point in random_grazing_points(5, 40, 1.5):
        # one that is neither close to a change of the sign
        sequence = mapped_returns(point, beyond_stop(point, 1e-8 * point.clearance), 1, mapping="exact")
        share = sequence.overshoot[1] / (np.sqrt(1e-8) * point.clearance)
        if abs(share) < 0.1:
            continue
        recurs = bool(grazing_curve(point.oscillator, [point.omega], 1).first_recurrence[0] == 1)
        assert recurs == bool(share > 0.0)
        overshoots = 10.0 ** np.arange(-12.0, -8.0) if recurs else 10.0 ** np.arange(-9.0, -4.0)
        errors = errors_of_second_return(point, overshoots)
        assert slope(overshoots, errors[:, 2]) == pytest.approx(0.5 if recurs else 1.0, abs=0.05)
        smooth = 10.0 ** np.arange(-9.0, -4.0)
        assert slope(smooth, errors_of_second_return(point, smooth)[:, 1]) == pytest.approx(1.0, abs=0.05)
        kinds[recurs] += 1
    print(kinds)
    assert min(kinds.values()) >= 5


def test_a_map_without_its_leading_x_is_detected(monkeypatch):
    # the paper's (27) has x* + beta u for x + beta u: where x is not small against the overshoot it is another map
    point = grazing_point(DEFAULT, 0.6)
    start = return_jacobian(point.next()) @ beyond_stop(point.next(), 1e-3)
    start += beyond_stop(point, 1e-7) - beyond_stop(point, point.stop * start[0])
    good = compare_returns(point, start, 1).error[1]
    monkeypatch.setattr(
        "grazemap_core.grazing.poincare_map.leading_mapping",
        lambda point, values, depth: leading_mapping(point, values, depth) - values,
    )
    assert compare_returns(point, start, 1).error[1] > 20.0 * good


def test_a_motion_that_leaves_the_neighbourhood_ends_in_nan():
    point = grazing_point(DEFAULT, 1.1)
    comparison = compare_returns(point, beyond_stop(point, 1e-2 * point.clearance), 4)
    assert np.all(np.isfinite(comparison.error[:3]))
    assert np.any(np.isnan(comparison.error))


def test_a_motion_inside_the_stops_returns_by_the_smooth_map():
    # stops a little outside the steady amplitude, and a motion that is near it
    point = grazing_point(DEFAULT, 0.29)
    near = random_deviation(np.random.default_rng(6), point, 1e-4)
    comparison = compare_returns(point, near, 6, depth=-1e-2)
    assert np.all(comparison.error < 1e-14)
    assert not np.any(comparison.simulated.overshoot > 0.0)


def test_the_first_impact_of_the_motion_is_that_of_the_mapping():
    point = grazing_point(DEFAULT, 0.29)
    deviation = beyond_stop(point, 1e-4)
    mapping = exact_mapping(point, deviation)
    assert mapping.velocity == pytest.approx(np.sqrt(2e-4 * abs(point.acceleration)), rel=1e-2)
    assert simulated_returns(point, deviation, 1).overshoot[0] == 1e-4


def test_states_that_cannot_be_iterated_are_refused():
    point = grazing_point(DEFAULT, 0.29)
    start = beyond_stop(point, 1e-4)
    with pytest.raises(ParameterError, match="returns"):
        mapped_returns(point, start, 0)
    with pytest.raises(ParameterError, match="returns"):
        simulated_returns(point, start, 0)
    with pytest.raises(ParameterError, match="mapping"):
        mapped_return(point, start, mapping="second")
    with pytest.raises(ParameterError, match="deviation"):
        return_map(point, np.ones(7))
    far = np.zeros(7)
    far[2] = 10.0
    with pytest.raises(ParameterError, match="neighbourhood"):
        return_map(grazing_point(DEFAULT, 1.1), far)
    with pytest.raises(ParameterError, match="overshoot"):
        compare_returns(point, beyond_stop(point, 10.0), 1, mapping="exact")
