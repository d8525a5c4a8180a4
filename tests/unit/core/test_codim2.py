"""Codimension-two points: complete, separated and correct to 1e-12, compared with a scan in ball arithmetic."""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import replace

import numpy as np
import pytest

from grazemap_core.errors import ConditioningError, ParameterError, SteadyMotionError
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.grazing.kernels.root_isolation import COMPLETE, NEAR_DOUBLE, isolate
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.kernels.response_sums import IMPULSE
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import steady_amplitude, zeros_of
from tests.oracles.impact_orbit_oracle import chain_of
from tests.support.thorough import the_first

MASSES, STIFFNESSES, FORCING = [1.0, 10.0, 10.0], [1.0, 5.0, 5.0], [1.0, 0.0, 0.0]
DEFAULT = Oscillator.create(MASSES, STIFFNESSES, 0.05, FORCING, 0.8)
PER_LINK = Oscillator.create(MASSES, STIFFNESSES, [0.05, 0.05, 0.05], FORCING, 0.8)


def expected_points(chain, start, stop, max_order, max_multiple):
    """Every point as (kind, order or multiple, symmetric, bifurcation, omega), by increasing omega."""
    points = []

    def zeros(kind, factors):
        low, high = min(factors) / stop, max(factors) / start
        return [float(zero.mid()) for zero in zeros_of(chain, kind, low * (1 - 1e-9), high * (1 + 1e-9))]

    orders = {m: m * math.pi for m in range(1, max_order + 1)}
    for zero in zeros("impulse", orders.values()):
        points += [("recurrence", m, None, None, factor / zero) for m, factor in orders.items()]
    one_sided = {n: 2 * n * math.pi for n in range(1, max_multiple + 1)}
    symmetric = {n: n * math.pi for n in range(1, max_multiple + 1, 2)}
    for kind, names in (("same", ("SN", "SB")), ("alternating", ("PD", "SN"))):
        for zero in zeros(kind, [*one_sided.values(), *symmetric.values()]):
            points += [("resonant", n, False, names[0], factor / zero) for n, factor in one_sided.items()]
            points += [("resonant", n, True, names[1], factor / zero) for n, factor in symmetric.items()]
    return sorted((p for p in points if start <= p[-1] <= stop), key=lambda p: (*map(str, p[:4]), p[-1]))


def check_complete(points, expected, tolerance=1e-13):
    records = sorted(
        ((p.kind, p.order or p.multiple, p.symmetric, p.bifurcation, p.omega) for p in points),
        key=lambda p: (*map(str, p[:4]), p[-1]),
    )
    assert [p[:-1] for p in records] == [p[:-1] for p in expected]
    errors = [abs(ours[-1] - exact[-1]) / exact[-1] for ours, exact in zip(records, expected, strict=True)]
    assert max(errors, default=0.0) < tolerance
    return errors


@pytest.fixture(scope="module")
def default_points():
    return codimension_two_points(DEFAULT, 0.05, 2.5, max_order=8)


@pytest.fixture(scope="module")
def default_expected():
    return expected_points(chain_of(DEFAULT), 0.05, 2.5, 8, 4)


def only(points, **fields):
    chosen = [p for p in points if all(getattr(p, name) == value for name, value in fields.items())]
    assert len(chosen) == 1, chosen
    return chosen[0]


def test_zeros_that_round_off_hides_are_an_error_and_none_is_made_up():
    oscillator = Oscillator.create([1e60, 6e-22], [1e-60, 1.0], 1.0, [1.0, 0.0], 0.8)
    with pytest.raises(ConditioningError, match="round-off hides"):
        codimension_two_points(oscillator, 19.4, 23.3, 2, 1)


def test_the_points_of_the_default_system_are_complete_and_correct(default_points, default_expected):
    assert len(default_expected) > 800
    check_complete(default_points, default_expected)
    assert all(p.residual < 1e-12 and p.status == "simple" for p in default_points)


def test_a_dropped_or_shifted_point_is_detected(default_points, default_expected):
    with pytest.raises(AssertionError):
        check_complete(default_points[:100] + default_points[101:], default_expected)
    for factor in (1 + 1e-12, 1 - 1e-12):
        shifted = [replace(p, omega=p.omega * factor) if i == 400 else p for i, p in enumerate(default_points)]
        with pytest.raises(AssertionError):
            check_complete(shifted, default_expected)


def test_frequencies_changed_by_1e_12_are_detected(default_expected, monkeypatch):
    true_model = modal_model(DEFAULT)
    skewed = replace(true_model, discriminant=true_model.discriminant * (1 + 2e-12))
    monkeypatch.setattr("grazemap_core.grazing.codimension_two.modal_model", lambda oscillator: skewed)
    with pytest.raises(AssertionError):
        check_complete(codimension_two_points(DEFAULT, 0.05, 2.5, max_order=8), default_expected)


def test_the_error_estimate_bounds_the_error(default_points, default_expected):
    exact = {}
    for kind, number, symmetric, name, omega in default_expected:
        exact.setdefault((kind, number, symmetric, name), []).append(omega)
    for point in default_points:
        key = (point.kind, point.order or point.multiple, point.symmetric, point.bifurcation)
        distance = min(abs(point.omega - omega) for omega in exact[key])
        assert distance <= point.omega_error + 4 * 2.3e-16 * point.omega


def test_clearances_lie_on_the_grazing_curve(default_points):
    chain = chain_of(DEFAULT)
    for point in default_points[::25]:
        assert point.clearance == pytest.approx(float(abs(steady_amplitude(chain, point.omega)).mid()), rel=1e-15)


def test_reference_points_of_the_default_system(default_points):
    near = [p for p in default_points if 0.2795 < p.omega < 0.283]
    second = only(near, kind="recurrence", order=2)
    assert second.omega == pytest.approx(0.282469586635, abs=1e-12)
    assert 2 * math.pi / second.omega == pytest.approx(22.2437586361734, abs=1e-12)
    assert second.clearance == pytest.approx(1.929160676955, abs=1e-12)
    assert second.active
    assert second.families == ((1, 1), (4, 0))
    saddle = only(near, kind="resonant", multiple=1, symmetric=False, bifurcation="SN")
    doubling = only(near, kind="resonant", multiple=1, symmetric=False, bifurcation="PD")
    assert saddle.omega == pytest.approx(0.281762924, abs=5e-10)
    assert doubling.omega == pytest.approx(0.280008248, abs=5e-10)
    assert doubling.clearance == pytest.approx(1.91348231, abs=5e-9)


def test_reference_point_with_damping_per_link():
    points = codimension_two_points(PER_LINK, 0.28, 0.282, max_order=2, max_multiple=0)
    point = only(points, order=2)
    assert point.omega == pytest.approx(0.280924685612, abs=1e-12)
    assert point.clearance == pytest.approx(1.920361068915, abs=1e-12)


@pytest.mark.parametrize("damping", the_first(3, [[0.4, 0.0, 0.01], [2.0, 0.3, 5.0], 0.5, [0.05, 0.05, 0.05], 1e-4]))
def test_the_points_for_other_dampings_are_complete_too(damping):
    oscillator = Oscillator.create(MASSES, STIFFNESSES, damping, FORCING, 0.8)
    points = codimension_two_points(oscillator, 0.1, 2.5, max_order=6, max_multiple=3)
    check_complete(points, expected_points(chain_of(oscillator), 0.1, 2.5, 6, 3))


@pytest.mark.thorough
def test_the_points_of_random_chains_are_complete():
    random = np.random.default_rng(11)
    total, near_double = 0, 0
    for number in range(50):
        count = 1 + number // 2 % 5
        masses, stiffnesses = 10 ** random.uniform(-1, 1, (2, count))
        damping = 10 ** random.uniform(-3, 0.5, count)
        damping = float(damping[0]) / stiffnesses.max() if number % 2 else damping
        oscillator = Oscillator.create(masses, stiffnesses, damping, [1.0] + [0.0] * (count - 1), 0.8)
        expected = expected_points(chain_of(oscillator), 0.3, 3.0, 4, 2)
        points = codimension_two_points(oscillator, 0.3, 3.0, max_order=4, max_multiple=2)
        near_double += sum(point.status == "near-double" for point in points)
        check_complete(points, expected, tolerance=1e-12)
        total += len(expected)
    # none of these nearly meet; two that do are below
    assert near_double == 0
    assert total > 2500


def test_one_degree_of_freedom_has_its_points_in_closed_form_and_together():
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    damped = math.sqrt(1 - 0.05**2)
    points = codimension_two_points(oscillator, 0.21, 2.5, max_order=8, max_multiple=4)
    for order in range(1, 9):
        expected = sorted(order * damped / k for k in range(1, 100) if 0.21 <= order * damped / k <= 2.5)
        ours = [p.omega for p in points if p.order == order]
        assert ours == pytest.approx(expected, rel=1e-13)
        if order % 2 == 0 and order // 2 <= 4:
            for name in ("SN", "PD"):
                resonant = [
                    p.omega for p in points if p.multiple == order // 2 and not p.symmetric and p.bifurcation == name
                ]
                assert resonant == pytest.approx(expected, rel=1e-13)


def test_overdamped_single_mass_has_none():
    assert codimension_two_points(Oscillator.create([1.0], [1.0], 3.0, [1.0], 0.8), 0.05, 2.5) == []


def test_active_points_are_where_the_first_recurrence_changes(default_points):
    recurrences = [p for p in default_points if p.kind == "recurrence"]
    omegas = [p.omega for p in recurrences]
    gap = 0.2 * min(b - a for a, b in itertools.pairwise(omegas) if b - a > 1e-9)
    for point in recurrences:
        before, after = grazing_curve(DEFAULT, [point.omega - gap, point.omega + gap], 8).first_recurrence
        # one side of an active point of order m recurs first at m
        assert (point.order in (before, after)) == point.active, point


def test_a_point_at_an_end_of_the_interval_is_in_once(default_points):
    chosen = [p for p in default_points if p.kind == "recurrence" and p.order == 2][5]
    for start, stop in ((chosen.omega, chosen.omega * 1.0001), (chosen.omega * 0.9999, chosen.omega)):
        points = codimension_two_points(DEFAULT, start, stop, max_order=2, max_multiple=0)
        inside = [p for p in points if abs(p.omega - chosen.omega) < 1e-12]
        assert len(inside) == 1
        assert start <= inside[0].omega <= stop


def test_two_merging_zeros_are_reported_as_near_double_and_not_lost():
    def zeros(stiffness):
        response = impulse_response(modal_model(Oscillator.create([1.0, 2.0], [1.0, stiffness], 0.01, [1.0, 0.0], 0.8)))
        places, kinds, status = isolate(IMPULSE, response.blocks, response.conditioning, response.slowest, 0.5, 60.0)
        assert status == COMPLETE
        return places, kinds

    # the number of zeros changes by two where an extremum of g passes through zero
    grid = np.linspace(0.2, 3.0, 200)
    counts = [len(zeros(stiffness)[0]) for stiffness in grid]
    crossing = next(i for i in range(len(grid) - 1) if abs(counts[i + 1] - counts[i]) == 2)
    low, high, low_count, high_count = grid[crossing], grid[crossing + 1], counts[crossing], counts[crossing + 1]
    near_doubles = 0
    while high - low > 4e-16 * high:
        middle = 0.5 * (low + high)
        places, kinds = zeros(middle)
        if np.any(kinds == NEAR_DOUBLE):
            # one entry in the place of the two zeros
            near_doubles += 1
            assert np.sum(kinds == NEAR_DOUBLE) == 1
            assert len(places) == min(low_count, high_count) + 1
            # and the list of points says so too
            omega = math.pi / places[kinds == NEAR_DOUBLE][0, 0]
            oscillator = Oscillator.create([1.0, 2.0], [1.0, middle], 0.01, [1.0, 0.0], 0.8)
            points = codimension_two_points(oscillator, omega * (1 - 1e-6), omega * (1 + 1e-6), 1, 0)
            assert [point.status for point in points] == ["near-double"]
            break
        assert len(places) in (low_count, high_count)
        low, high = (middle, high) if len(places) == low_count else (low, middle)
    assert near_doubles == 1


def test_light_damping_and_long_periods_stay_cheap():
    codimension_two_points(DEFAULT, 0.2, 0.3)
    light = Oscillator.create(MASSES, STIFFNESSES, 1e-7, FORCING, 0.8)
    for oscillator, start in ((DEFAULT, 0.05), (light, 0.05), (DEFAULT, 0.005)):
        begin = time.process_time()
        codimension_two_points(oscillator, start, 2.5)
        assert time.process_time() - begin < 2.0


def test_systems_without_such_points_are_refused():
    with pytest.raises(SteadyMotionError):
        codimension_two_points(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.1, 1.0)
    with pytest.raises(ParameterError, match="forcing"):
        codimension_two_points(Oscillator.create([1.0], [1.0], 0.1, [0.0], 0.8), 0.1, 1.0)
    for start, stop in ((0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (0.1, math.inf), (math.nan, 1.0)):
        with pytest.raises(ParameterError, match="omega"):
            codimension_two_points(DEFAULT, start, stop)
    with pytest.raises(ParameterError, match="too many zeros"):
        codimension_two_points(DEFAULT, 1e-6, 2.5)
    with pytest.raises(ParameterError, match="max_order"):
        codimension_two_points(DEFAULT, 0.1, 1.0, max_order=0)
    with pytest.raises(ParameterError, match="max_multiple"):
        codimension_two_points(DEFAULT, 0.1, 1.0, max_multiple=-1)


@pytest.mark.parametrize(("start", "stop"), [(1e-100, 2.5), (1e-12, 2.5), (0.1, 2e14), (1e15, 1e16), (1e3, 1e11)])
def test_intervals_that_cannot_be_searched_completely_are_refused(start, stop):
    with pytest.raises(ParameterError, match="omega"):
        codimension_two_points(DEFAULT, start, stop)
