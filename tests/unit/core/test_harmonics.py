"""Grazing with several harmonics: curves, corners, double grazes and unfoldings against 50 digits from the matrices."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from flint import arb

from grazemap_core.errors import ParameterError
from grazemap_core.grazing import codimension_two, coincident_grazes
from grazemap_core.grazing.codimension_two import CodimensionTwoPoint, codimension_two_points
from grazemap_core.grazing.coincident_grazes import equal_maxima, vanishing_margins
from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop, grazing_curve, steady_motion, stop_grazes
from grazemap_core.grazing.poincare_map import compare_returns
from grazemap_core.grazing.point import grazing_point
from grazemap_core.grazing.recurrence import next_contact, xi_along
from grazemap_core.model.drive import force
from grazemap_core.model.harmonic_response import steady_curvature_bound
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.trig_maxima import Coefficients, highest_peaks, relative
from tests.oracles.fifty_digits import digits
from tests.oracles.unfolded_curves import errors, random_system, unfolded_points
from tests.support.thorough import the_first


def chain(*parts: tuple[int, float, float], restitution: float = 0.8, gamma: float = 0.05) -> Oscillator:
    """Return the default chain with harmonics (order, amplitude, phase) of the force on mass 1."""
    plain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], gamma, [0.0, 0.0, 0.0], restitution)
    drive = [force(k, np.array([a, 0.0, 0.0]), np.array([p, 0.0, 0.0])) for k, a, p in parts]
    return Oscillator.of_structure(plain.structure, plain.contact, drive, restitution)


@pytest.mark.parametrize("seed", the_first(8, range(60)))
def test_maxima_phases_and_slopes_agree_with_fifty_digits(seed: int) -> None:
    oscillator, oracle = random_system(seed)
    omega = np.random.default_rng(seed).uniform(0.1, 2.5, 4)
    for stop, w in itertools.product((1, -1), omega.tolist()):
        maxima = steady_motion(oscillator, np.array([w]), slopes=True).toward(stop)
        grazes = stop_grazes(oscillator, [w], VariedStop(stop))
        with digits():
            best = oracle.maxima(arb(w), stop)[0]
            slope = oracle.slope(w, stop)
        assert maxima.amplitude[0] == grazes.clearance[0] == pytest.approx(float(best.height), rel=1e-14)
        assert np.exp(1j * maxima.phase[0]) == pytest.approx(np.exp(1j * float(best.phase)), abs=1e-12)
        assert maxima.curvature[0] == pytest.approx(float(best.bend), rel=1e-12)
        assert maxima.slope[0] == pytest.approx(slope, rel=1e-10)


@pytest.mark.parametrize("orders", [(1, 2), (1, 2, 3), (2, 5), (1, 40), (7, 11, 13), (1, 300)])
def test_no_highest_peak_is_missed(orders: tuple[int, ...]) -> None:
    random, k = np.random.default_rng(len(orders)), np.array(orders, dtype=np.float64)
    value = random.normal(size=(200, len(k))) + 1j * random.normal(size=(200, len(k)))
    value *= 10.0 ** random.uniform(-2, 0, size=value.shape)
    still = np.zeros_like(value)
    peaks = highest_peaks(Coefficients(k, value, still, still.real, np.zeros(len(value))))
    theta = np.linspace(-np.pi, np.pi, 64 * orders[-1] + 1)
    sampled = (value @ np.exp(1j * np.outer(k, theta))).imag.max(axis=1)
    heights = np.full(len(value), -np.inf)
    np.maximum.at(heights, peaks.cell, peaks.height)
    assert np.all(heights >= sampled * (1.0 - 1e-14))
    # between samples a maximum rises by no more than its curvature allows
    assert np.all(heights - sampled <= 0.5 * (np.pi / 64 / orders[-1]) ** 2 * (np.abs(value) @ k**2))


@pytest.mark.parametrize("seed", range(6))
def test_bounds_hold_over_intervals_of_omega(seed: int) -> None:
    oscillator, _ = random_system(seed)
    random, tightest = np.random.default_rng(seed), 0.0
    for harmonic, _ in itertools.product(oscillator.drive, range(5)):
        left = random.uniform(0.05, 2.5)
        right = left * (1.0 + 10.0 ** random.uniform(-4, 0))
        omega, step = np.linspace(left, right, 101), 1e-5 * left
        alone = replace(oscillator, drive=(harmonic,))
        slopes = [steady_motion(alone, omega + side * step, slopes=True).slopes[:, 0] for side in (1, -1)]
        bound = steady_curvature_bound(oscillator, harmonic, np.array([left]), np.array([right]))[0]
        share = np.max(np.abs(slopes[0] - slopes[1])) / (2.0 * step) / bound
        assert share < 1.0 + 1e-6
        tightest = max(tightest, share)
    assert tightest > 0.1


@pytest.mark.parametrize("seed", range(6))
def test_relative_coefficients_stay_within_their_bounds(seed: int) -> None:
    oscillator, _ = random_system(seed)
    random = np.random.default_rng(seed)
    middle = random.uniform(0.1, 2.5, 200)
    radius = middle * 10.0 ** random.uniform(-5, -1, 200)
    motion = steady_motion(oscillator, middle, slopes=True)
    ends = middle - radius, middle + radius
    bound = np.stack([steady_curvature_bound(oscillator, harmonic, *ends) for harmonic in oscillator.drive], axis=1)
    ratios = relative(Coefficients(motion.orders, motion.response, motion.slopes, bound, radius))
    assert 50 < np.count_nonzero(ratios.exists) < 200
    cells, tightest = np.arange(200), 0.0
    for share in (-1.0, -0.5, 0.5, 1.0):
        away = (share * radius)[:, None]
        there = steady_motion(oscillator, middle + away[:, 0]).response
        change = np.log(there[cells, ratios.largest] / motion.response[cells, ratios.largest])[:, None]
        turned = np.exp(-change.real - 1j * change.imag * motion.orders / motion.orders[ratios.largest][:, None])
        seen = ratios.coefficients
        rest = np.abs(there * turned - seen.value - seen.slope * away)
        allowed = 0.5 * seen.bound * away**2 + 1e-14 * np.abs(motion.response).sum(axis=1, keepdims=True)
        assert np.all((rest <= allowed)[ratios.exists])
        tightest = max(tightest, np.max((rest / allowed)[ratios.exists]))
        scale = (np.exp(-change[:, 0].real) - 1.0) / away[:, 0]
        least, most = np.sort(ratios.scale_rate, axis=0)
        assert np.all(((scale >= least - 1e-9) & (scale <= most + 1e-9))[ratios.exists])
    assert tightest > 0.1


def phase_jumps(oscillator: Oscillator, stop: int, start: float, end: float) -> np.ndarray:
    """Return the intervals of a dense grid in which the phase of the highest maximum jumps, shape (n, 2)."""
    omega = np.linspace(start, end, 20_001)
    moved = np.abs(np.angle(np.exp(1j * np.diff(steady_motion(oscillator, omega).toward(stop).phase))))
    beside = np.minimum(np.append(moved[1:], 0.0), np.append(0.0, moved[:-1]))
    (jumps,) = np.nonzero((moved > 0.05) & (moved > 8.0 * beside))
    return np.stack([omega[jumps], omega[jumps + 1]], axis=1)


@pytest.mark.parametrize("seed", the_first(1, range(40)))
def test_every_corner_is_found_where_it_is_in_fifty_digits(seed: int) -> None:
    oscillator, oracle = random_system(seed)
    for stop in (1, -1):
        corners = equal_maxima(oscillator, stop, 0.1, 2.5)
        omega = np.array([corner.omega for corner in corners])
        for left, right in phase_jumps(oscillator, stop, 0.1, 2.5):
            assert np.any((omega > left - 1e-12) & (omega < right + 1e-12)), (left, right)
        for corner in corners:
            with digits():
                place, *maxima = oracle.corner(corner.omega, stop)
                assert abs(float(place - arb(corner.omega))) <= corner.error + 1e-15
                highest = oracle.amplitude(place, stop)
                assert all(float(abs(each.height / highest - 1)) < 1e-30 for each in maxima)
                slopes = [oracle.slope(corner.omega * (1.0 + side * 1e-12), stop) for side in (-1, 1)]
            assert corner.slopes == pytest.approx(slopes, rel=1e-7)
            phases = {round(float(each.phase) % (2.0 * np.pi), 9) for each in maxima}
            assert phases == {round(phase % (2.0 * np.pi), 9) for phase in corner.phases}


@pytest.mark.thorough
def test_corners_are_missed_where_bounds_are_too_small(monkeypatch: pytest.MonkeyPatch) -> None:
    def corners() -> int:
        return sum(len(equal_maxima(random_system(seed)[0], 1, 0.1, 2.5)) for seed in range(3))

    complete = corners()
    monkeypatch.setattr(coincident_grazes, "steady_curvature_bound", lambda *_: np.zeros(len(_[-1])))
    assert corners() < complete


@pytest.mark.thorough
def test_two_corners_that_merge_are_near_double_and_not_lost() -> None:
    def corners(phase: float) -> list[coincident_grazes.Coincidence]:
        return equal_maxima(chain((1, 1.0, 0.0), (2, 0.7, phase)), -1, 0.22, 0.24)

    two, none = 1.115315, 1.115316
    assert (len(corners(two)), len(corners(none))) == (2, 0)
    for _ in range(60):
        coincidences = corners(0.5 * (two + none))
        if len(coincidences) == 1:
            break
        two, none = (0.5 * (two + none), none) if coincidences else (two, 0.5 * (two + none))
    (coincidence,) = coincidences
    assert not coincidence.simple
    assert coincidence.error < 1e-6


@pytest.mark.parametrize(
    ("stop", "seed", "orders"), the_first(1, [(1, 0, (1, 2)), (1, 2, (2, 3)), (-1, 0, (1, 2)), (-1, 2, (2, 3))])
)
def test_every_double_graze_is_on_both_curves_in_fifty_digits(stop: int, seed: int, orders: tuple[int, ...]) -> None:
    compared = 0
    oscillator, oracle = random_system(seed, orders)
    omega = np.linspace(0.1, 2.5, 10_001)
    motion = steady_motion(oscillator, omega)
    amplitude, other = motion.toward(stop).amplitude, motion.toward(-stop).amplitude
    for varied in (VariedStop(stop, float(np.quantile(other, 0.6))), VariedStop(stop, together=True)):
        grazes = vanishing_margins(oscillator, varied, 0.1, 2.5)
        places = np.array([graze.omega for graze in grazes])
        for i in np.flatnonzero(np.diff(np.sign(varied.margin(oscillator, amplitude, other)))):
            assert np.any((places > omega[i] - 1e-12) & (places < omega[i + 1] + 1e-12))
        for graze in grazes[:4]:
            with digits():
                right, left = (oracle.amplitude(arb(graze.omega), side) for side in (stop, -stop))
                gap = right if varied.together else arb(varied.other or 0.0)
                assert float(abs(left / gap - 1)) < 1e-12
            compared += 1
    assert compared


def test_points_of_double_grazes_and_corners_are_on_the_curves() -> None:
    oscillator = chain((1, 1.0, 0.0), (2, 0.7, 0.3))
    biased = replace(oscillator, bias=np.array([0.05, 0.0, 0.0]))
    for varied in (VariedStop(1, together=True), VariedStop(-1, 1.2)):
        points = codimension_two_points(biased, 0.2, 1.5, 4, 1, varied)
        assert {point.kind for point in points} == {"recurrence", "resonant", "corner", "double-graze"}
        for point in points:
            here = stop_grazes(biased, [point.omega], varied)
            assert (point.stop, point.status) == (varied.stop, "simple")
            assert point.clearance == pytest.approx(here.clearance[0], rel=1e-14)
            assert (point.corner is not None) == (point.kind == "corner") == (point.amplitude_slope is None)
            if point.kind == "double-graze":
                assert point.margin == pytest.approx(0.0, abs=1e-13)


def test_the_curve_has_the_slopes_of_its_corner_beside_it() -> None:
    oscillator = chain((1, 1.0, 0.0), (2, 0.7, 0.3))
    points = codimension_two_points(oscillator, 0.2, 0.6, 2, 0, VariedStop(-1))
    corners = [point for point in points if point.kind == "corner"]
    assert len(corners) == 4
    for point in corners:
        assert point.corner is not None
        step = np.array([-2e-8, -1e-8, 1e-8, 2e-8])
        beside = stop_grazes(oscillator, point.omega + step, VariedStop(-1))
        slopes = np.diff(beside.clearance)[[0, 2]] / 1e-8
        assert [point.corner.slope_before, point.corner.slope_after] == pytest.approx(slopes, rel=1e-4, abs=1e-4)
        assert beside.phase[[1, 2]] == pytest.approx([point.corner.phase_before, point.corner.phase_after], abs=1e-4)


def first_contact(
    oscillator: Oscillator, point: CodimensionTwoPoint, stops: list[int], graze: float
) -> tuple[float, int]:
    """Return phase and stop of the next contact after an impact just before a graze of stops[0], from samples."""
    depth, motion = 1e-8, steady_motion(oscillator, np.array([point.omega]))
    steady, orders = stops[0] * motion.response[0], motion.orders
    curvature = (steady * orders**2 * np.exp(1j * graze * orders)).imag.sum()
    early = np.sqrt(2.0 * depth * point.clearance / curvature)
    turn = np.linspace(0.0, 8.02 * np.pi, 400_001)[1:]
    q = (steady @ np.exp(1j * np.outer(orders, graze - early + turn))).imag
    lost = 1.0 + oscillator.restitution
    q -= (
        lost
        * point.omega
        * curvature
        * early
        * evaluate(impulse_response(modal_model(oscillator)), turn / point.omega)[0]
    )
    beyond = np.array([side * q > point.clearance * (1.0 - depth) for side in (1, -1)[: len(stops)]])
    (places,) = np.nonzero(np.any(beyond, axis=0) & (turn > 1e-2))
    return (float(turn[places[0]]), 1 if beyond[0, places[0]] else -1) if len(places) else (0.0, 0)


@pytest.mark.parametrize(
    ("order", "phase", "stops", "numbers"),
    the_first(1, [(2, 0.0, [-1], {1, 2, 6}), (4, 2.1, [-1], {0, 1, 2, 3, 4}), (3, 0.3, [1, -1], {1, 2, 3})]),
)
def test_impacts_recur_at_either_maximum_of_a_corner(
    order: int, phase: float, stops: list[int], numbers: set[int]
) -> None:
    oscillator = chain((1, 1.0, 0.0), (order, 0.7, phase))
    varied = VariedStop(stops[0]) if len(stops) == 1 else ALIKE
    points = codimension_two_points(oscillator, 0.1, 1.5, 8, 0, varied)
    seen = set()
    for corner, point in ((point.corner, point) for point in points if point.kind == "corner"):
        assert corner is not None
        phases = [corner.phase_before, corner.phase_after]
        for graze, other, number in ((*phases, corner.recurrence_before), (*phases[::-1], corner.recurrence_after)):
            away = (other - graze) % (2.0 * np.pi)
            contacts = [(2.0 * np.pi, 1), (away, 1)]
            if varied.alike:
                contacts += [(np.pi, -1), ((away + np.pi) % (2.0 * np.pi), -1)]
            contacts = sorted((2.0 * np.pi * turn + delay, side) for turn in range(4) for delay, side in contacts)
            place, side = first_contact(oscillator, point, stops, graze)
            expected, its_side = contacts[number - 1] if number else (0.0, 0)
            assert side == its_side
            assert place == pytest.approx(expected, abs=0.03)
            seen.add(number)
    assert seen >= numbers


@pytest.mark.parametrize("seed", the_first(3, range(30)))
def test_curves_leave_resonant_points_as_exact_motions_do(seed: int) -> None:
    oscillator, oracle = random_system(seed)
    points = unfolded_points(oscillator)
    assert points
    for point in points:
        assert max(errors(oscillator, oracle, point)) < 1e-6, point


def test_a_wrong_curvature_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    oscillator, oracle = random_system(0)
    exact = codimension_two.resonant_unfolding
    monkeypatch.setattr(
        codimension_two, "resonant_unfolding", lambda sums, r, bend, *rest: exact(sums, r, 1.0001 * bend, *rest)
    )
    points = codimension_two_points(oscillator, 0.3, 2.0, 1, 1, VariedStop(1))
    for name in ("SN", "PD"):
        point = next(p for p in points if p.bifurcation == name)
        assert min(errors(oscillator, oracle, point)) > 0.9e-4
        # the amplitude, which takes the curvature's place in one harmonic, is another number
    amplitude = steady_motion(oscillator, np.array([points[0].omega])).toward(1)
    assert abs(amplitude.curvature[0] / amplitude.amplitude[0] - 1.0) > 1e-2


def test_harmonics_with_a_common_divisor_are_those_of_a_multiple_of_omega() -> None:
    # forces of orders 2 and 6 at omega are those of orders 1 and 3 at 2 omega
    slow, fast = chain((2, 1.0, 0.2), (6, 0.6, 0.3)), chain((1, 1.0, 0.2), (3, 0.6, 0.3))
    omega = np.linspace(0.1, 0.6, 40)
    ours, theirs = grazing_curve(slow, omega), grazing_curve(fast, 2.0 * omega)
    assert ours.omega.tolist() == omega.tolist()
    for name in ("clearance", "acceleration", "first_recurrence", "recurrence_stop"):
        assert getattr(ours, name).tolist() == getattr(theirs, name).tolist()
    assert (2.0 * ours.phase).tolist() == theirs.phase.tolist()
    assert xi_along(slow, omega, 4).tolist() == xi_along(fast, 2.0 * omega, 4).tolist()
    mine, other = codimension_two_points(slow, 0.1, 0.3, 4, 2), codimension_two_points(fast, 0.2, 0.6, 4, 2)
    assert {"corner", "recurrence", "resonant"} == {point.kind for point in mine}
    for point, same in zip(mine, other, strict=True):
        for name in ("kind", "order", "multiple", "bifurcation", "active", "clearance"):
            assert getattr(point, name) == getattr(same, name)
        assert point.omega == pytest.approx(0.5 * same.omega, rel=1e-15)
        if point.unfolding is not None:
            assert same.unfolding is not None
            assert point.unfolding.slope == 2.0 * same.unfolding.slope
            assert point.unfolding.velocity_slope == 2.0 * same.unfolding.velocity_slope
            if point.unfolding.quadratic is not None:
                assert same.unfolding.quadratic is not None
                assert point.unfolding.quadratic == 4.0 * same.unfolding.quadratic
        if point.corner is not None:
            assert same.corner is not None
            assert point.corner.slope_before == 2.0 * same.corner.slope_before
            assert point.corner.recurrence_after == same.corner.recurrence_after


@pytest.mark.parametrize("order", [2, 3, 7])
def test_one_harmonic_of_another_order_is_the_first_one_of_a_multiple_of_omega(order: int) -> None:
    slow, omega = chain((order, 1.0, 0.2)), np.linspace(0.05, 0.2, 30)
    fast = chain((1, 1.0, 0.2))
    for stop in (1, -1):
        ours, theirs = (
            stop_grazes(oscillator, w, VariedStop(stop, 1.3))
            for oscillator, w in ((slow, omega), (fast, order * omega))
        )
        for name in ("clearance", "margin", "first_recurrence"):
            assert getattr(ours, name).tolist() == getattr(theirs, name).tolist()
        assert np.exp(1j * order * ours.phase) == pytest.approx(np.exp(1j * theirs.phase), abs=1e-13)
        assert np.all((ours.phase > -np.pi / order) & (ours.phase <= np.pi / order))
    points = codimension_two_points(slow, 0.05, 0.2, 2, 1, VariedStop(1, 1.3))
    equal = codimension_two_points(fast, 0.05 * order, 0.2 * order, 2, 1, VariedStop(1, 1.3))
    assert [point.omega for point in points] == pytest.approx([point.omega / order for point in equal], rel=1e-15)
    assert [p.amplitude_slope for p in points] == [order * (p.amplitude_slope or 0.0) for p in equal]


def test_forces_of_odd_harmonics_graze_both_stops_at_once() -> None:
    oscillator, omega = chain((1, 1.0, 0.0), (3, 0.7, 0.3)), np.linspace(0.1, 1.5, 60)
    curve = grazing_curve(oscillator, omega, 8)
    motion = steady_motion(oscillator, omega)
    theta = np.linspace(-np.pi, np.pi, 20_001)
    sampled = np.abs((motion.response @ np.exp(1j * np.outer(motion.orders, theta))).imag).max(axis=1)
    assert curve.clearance == pytest.approx(sampled, rel=1e-5)
    for stop in (1, -1):
        alone = stop_grazes(oscillator, omega, VariedStop(stop, together=True), 8)
        assert alone.clearance == pytest.approx(curve.clearance, rel=1e-14)
        assert alone.margin == pytest.approx(0.0, abs=1e-13)
    # returns to the same stop, after whole periods, do not depend on the other stop
    response = impulse_response(modal_model(oscillator))
    signs = np.array([(-1) ** m * evaluate(response, m * np.pi / omega)[0] for m in range(1, 9)])
    expected = np.where(np.any(signs < 0.0, axis=0), np.argmax(signs < 0.0, axis=0) + 1, 0)
    assert curve.first_recurrence.tolist() == expected.tolist()
    assert xi_along(oscillator, omega, 1)[:, 0] == pytest.approx(-1.8 * curve.acceleration * signs[0], rel=1e-12)
    kinds = {p.kind for p in codimension_two_points(oscillator, 0.1, 0.6, 2, 1)}
    assert kinds == {"corner", "recurrence", "resonant"}


def test_symmetric_motions_of_odd_harmonics_leave_as_the_acceleration_says() -> None:
    # the coefficients are those of one harmonic with the curvature of the graze in place of the amplitude
    several, single = chain((1, 1.0, 0.0), (3, 0.2, 0.3)), chain((1, 1.0, 0.0))
    for ours, plain in zip(*(resonant(oscillator) for oscillator in (several, single)), strict=True):
        assert ours.omega == plain.omega
        maxima = steady_motion(several, np.array([ours.omega])).toward(1)
        assert ours.unfolding is not None
        assert plain.unfolding is not None
        ratio = maxima.curvature[0] / plain.clearance
        assert ours.unfolding.velocity_slope == pytest.approx(ratio * plain.unfolding.velocity_slope, rel=1e-13)
        assert ours.unfolding.admissible == plain.unfolding.admissible


def resonant(oscillator: Oscillator) -> list[CodimensionTwoPoint]:
    return [p for p in codimension_two_points(oscillator, 0.3, 1.0, 1, 3) if p.kind == "resonant"]


@pytest.mark.parametrize("compute", [grazing_curve, lambda oscillator, _: codimension_two_points(oscillator, 0.2, 0.3)])
def test_even_harmonics_need_one_stop(compute) -> None:
    with pytest.raises(ParameterError, match="even and odd") as refusal:
        compute(chain((1, 1.0, 0.0), (2, 0.7, 0.3)), [0.29])
    assert refusal.value.name == "forcing"


def test_motions_near_a_graze_of_odd_harmonics_return_after_half_a_period_of_the_forces() -> None:
    tripled = chain((1, 1.0, 0.0), (3, 0.7, 0.3)), 0.29
    doubled = chain((2, 1.0, 0.0), (6, 0.7, 0.3)), 0.145
    points = [grazing_point(*case) for case in (tripled, doubled)]
    for point, times in zip(points, (1, 2), strict=True):
        assert point.turn == np.pi / times
        returns = compare_returns(point, np.zeros(len(point.state)), 3, 1e-5 * point.amplitude, "exact")
        assert np.all(returns.error < 1e-11)
    np.testing.assert_allclose(points[1].state[:-1], points[0].state[:-1], rtol=0, atol=1e-13)
    contact, other = (next_contact(*(oscillator, [omega]), 1e-6) for oscillator, omega in (tripled, doubled))
    assert (contact.order, contact.stop) == (other.order, other.stop)
    with pytest.raises(ParameterError, match="even and odd"):
        grazing_point(chain((1, 1.0, 0.0), (2, 0.7, 0.3)), 0.29)


@pytest.mark.parametrize("gamma", [1e-3, 1e-5, 1e-7])
def test_corners_with_light_damping_are_found(gamma: float) -> None:
    # between the second and the third resonance of the chain; the two corners draw together as the damping falls
    corners = equal_maxima(chain((1, 1.0, 0.0), (4, 0.7, 0.3), gamma=gamma), 1, 0.511, 0.5125)
    assert len(corners) == 2
    assert all(corner.simple for corner in corners)
    assert (corners[1].omega - corners[0].omega) / gamma == pytest.approx(0.881, abs=1e-3)
    middle = 0.5 * (corners[0].omega + corners[1].omega)
    ends = middle - 0.55 * gamma, middle + 0.6 * gamma
    assert len(phase_jumps(chain((1, 1.0, 0.0), (4, 0.7, 0.3), gamma=gamma), 1, *ends)) == 2


def test_maxima_that_bounds_cannot_tell_apart_are_an_error_and_none_is_made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coincident_grazes, "MAX_CELLS", 1000)
    with pytest.raises(ParameterError, match="nearly equal") as refusal:
        equal_maxima(chain((1, 1.0, 0.0), (2, 0.7, 0.3), gamma=1e-7), 1, 0.05, 2.5)
    assert refusal.value.name == "omega"


def test_amplitudes_that_underflow_are_refused() -> None:
    long = Oscillator.create([1.0] * 4, [1.0] * 4, 0.05, [0.0] * 4, 0.8)
    tiny = replace(long, drive=tuple(force(k, np.array([0.0, 0.0, 0.0, 1e-60])) for k in (1, 2)))
    with pytest.raises(ParameterError, match="underflows"):
        stop_grazes(tiny, [1e60], VariedStop(1))
