"""Recurrence after a graze: xi_m by three methods, and the predicted next contact compared with the simulated one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.grazing.codimension_two import codimension_two_points, families_of_order
from grazemap_core.grazing.grazing_curve import ALIKE, grazing_curve
from grazemap_core.grazing.poincare_map import flow_jacobian, return_jacobian, simulated_returns
from grazemap_core.grazing.point import grazing_point
from grazemap_core.grazing.recurrence import next_contact, recurrence_sequence, xi_along
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.next_contacts import simulated_contact
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import random_oscillator
from tests.support.random_systems import general_grazing_points

DISTANCE = 1e-11
UNDECIDABLE = 1e-3
"""Share of the threshold within which nothing is predicted at that distance. The rounding of the amplitude moves the
distance by 2e-16/1e-11 = 2e-5 of itself, and the next order of the rule is u = sqrt(2e-11)/omega < 3e-5 times a few
derivatives of the impulse response; both together stay well below this."""


def systems(seed, count=5):
    random = np.random.default_rng(seed)
    return [random_oscillator(random, 1 + number % 5, per_link=bool(number % 2)) for number in range(count)]


def term_by_term(point, max_order, jacobian):
    """Return ``h_D J ... J beta`` for 1 .. max_order factors J of successive returns, shape (max_order,)."""
    across, back = jacobian(point), jacobian(point.next())
    vector, result = point.beta, np.empty(max_order)
    for m in range(max_order):
        vector = (across if m % 2 == 0 else back) @ vector
        result[m] = -point.contact_of(vector)[0]  # h_D = (-1, 0, ..., 0) for mass 1
    return result


@pytest.mark.parametrize("seed", [1, 2])
def test_xi_is_the_same_by_jacobians_by_flows_and_by_the_impulse_response(seed):
    random = np.random.default_rng(seed + 10)
    worst = 0.0
    for oscillator in systems(seed, 10):
        for omega in random.uniform(0.2, 2.0, 5):
            points = [grazing_point(oscillator, float(omega), replace(ALIKE, stop=stop)) for stop in (1, -1)]
            sequences = [recurrence_sequence(point, 8) for point in points]
            for point, sequence in zip(points, sequences, strict=True):
                for jacobian in (return_jacobian, flow_jacobian):  # as (42) and (57) are written
                    other = term_by_term(point, 8, jacobian)
                    worst = max(worst, np.max(np.abs(other - sequence.xi)) / np.max(sequence.size))
            # a graze at C is the mirror image of one at A
            np.testing.assert_array_equal(sequences[1].xi, -sequences[0].xi)
    print(f"worst difference of the three ways: {worst:.1e}")
    assert worst < 1e-12


def test_xi_of_one_stop_is_that_of_whole_periods():
    for point in general_grazing_points(8):
        sequence = recurrence_sequence(point, 6)
        for jacobian in (return_jacobian, flow_jacobian):
            other = term_by_term(point, 6, jacobian)
            assert np.max(np.abs(other - sequence.xi)) < 1e-12 * np.max(sequence.size)
        first = next((m for m in range(1, 7) if point.stop * sequence.xi[m - 1] < 0.0), 0)
        assert sequence.first_recurrence == first
        assert sequence.recurrence_stop == (point.stop if first else 0)


def test_xi_follows_the_families_of_the_paper():
    assert [families_of_order(order) for order in range(1, 7)] == [
        ((2, 0), (3, 0)),
        ((1, 1), (4, 0)),
        ((2, 1), (3, 1)),
        ((1, 2), (4, 1)),
        ((2, 2), (3, 2)),
        ((1, 3), (4, 2)),
    ]
    # the order m = 2 vanishes at the paper's codimension-two point, with a change of sign
    point = next(p for p in codimension_two_points(DEFAULT, 0.28, 0.285, 2, 0) if p.order == 2)
    at, before, after = (
        recurrence_sequence(grazing_point(DEFAULT, point.omega * f), 2) for f in (1.0, 1.0 - 1e-9, 1.0 + 1e-9)
    )
    assert abs(at.xi[1]) < 1e-14 * at.size[1]
    composed = term_by_term(grazing_point(DEFAULT, point.omega), 2, return_jacobian)
    assert abs(composed[1]) < 1e-12 * at.size[1]
    assert before.xi[1] * after.xi[1] < 0.0


def test_the_sign_of_xi_decides_what_recurs():
    for oscillator in systems(3):
        for omega in np.random.default_rng(4).uniform(0.2, 1.5, 20):
            sequence = recurrence_sequence(grazing_point(oscillator, float(omega)), 8)
            # mass 1 moves by -xi u: to A at even returns, to C at odd ones
            toward = -sequence.xi * (-1.0) ** sequence.order
            first = next((int(m) for m, value in zip(sequence.order, toward, strict=True) if value > 0.0), 0)
            assert sequence.first_recurrence == first
            assert sequence.recurrence_stop == (0 if first == 0 else (-1) ** first)


@pytest.mark.parametrize("frequencies", [50, pytest.param(200, marks=pytest.mark.thorough)])
def test_the_predicted_next_contact_is_the_simulated_one(frequencies):
    random = np.random.default_rng(5)
    undecided, seen = 0, set()
    for oscillator in systems(6):
        omegas = random.uniform(0.2, 1.5, frequencies)
        predicted = next_contact(oscillator, omegas, DISTANCE, 8)
        for omega, order, stop, margin in zip(omegas, predicted.order, predicted.stop, predicted.margin, strict=True):
            if margin < UNDECIDABLE:
                undecided += 1
                continue
            assert simulated_contact(oscillator, float(omega), DISTANCE, 8) == (order, stop), (oscillator, omega)
            seen.add(int(order))
    print(f"undecidable at this distance: {undecided} of {5 * frequencies}; orders seen: {sorted(seen)}")
    assert undecided <= 2
    assert len(seen) >= 3


def test_the_predicted_next_contact_of_one_stop_is_the_simulated_one():
    orders = set()
    for point in general_grazing_points(4):
        distance = 1e-8
        contact = next_contact(point.oscillator, [point.omega], distance, 4, point.varied)
        assert contact.margin[0] > UNDECIDABLE
        seen = simulated_returns(point, np.zeros(len(point.state)), 4, distance * point.amplitude).overshoot[1:]
        order = int(np.argmax(seen > 0.0)) + 1 if np.any(seen > 0.0) else 0
        assert (contact.order[0], contact.stop[0]) == (order, point.stop if order else 0)
        orders.add(order)
    assert len(orders) > 1


def test_far_from_a_codimension_two_point_it_is_the_first_recurrence():
    for oscillator in systems(7):
        omegas = np.random.default_rng(8).uniform(0.2, 1.5, 200)
        limit = next_contact(oscillator, omegas, 1e-22, 8)
        np.testing.assert_array_equal(limit.order, grazing_curve(oscillator, omegas, 8).first_recurrence)
        np.testing.assert_array_equal(limit.stop, grazing_curve(oscillator, omegas, 8).recurrence_stop)


def test_between_both_thresholds_the_squared_factor_gives_the_correct_answer():
    # close to codimension-two points the motion itself tells sqrt(eps/2)/((1 + R) omega) from that times the square
    distance, decided = 1e-9, 0
    response = impulse_response(modal_model(DEFAULT))
    lost = 1.0 + DEFAULT.restitution
    for point in codimension_two_points(DEFAULT, 0.2, 0.7, 4, 0):
        if not point.active:
            continue
        sign = (-1.0) ** point.order
        (value,), (slope,), _, _ = evaluate(response, [point.order * math.pi / point.omega])
        plain = math.sqrt(distance / 2.0) / (lost * point.omega)
        square = (1.0 - lost * sign * slope) ** 2
        # omega at which the response is halfway between both thresholds
        target = sign * 0.5 * plain * (1.0 + square)
        time = point.order * math.pi / point.omega + (target - value) / slope
        omega = point.order * math.pi / time
        predicted = next_contact(DEFAULT, [omega], distance, point.order)
        recurs = bool(predicted.order[0] == point.order)
        assert predicted.margin[0] > 0.05
        assert recurs == bool(square > 1.0)
        assert simulated_contact(DEFAULT, omega, distance, point.order)[0] == (point.order if recurs else 0)
        decided += 1
    assert decided >= 6


def test_systems_without_a_sequence_are_refused():
    with pytest.raises(SteadyMotionError):
        grazing_point(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.5)
    with pytest.raises(SteadyMotionError):
        next_contact(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), [0.5], 1e-6)
    with pytest.raises(ParameterError, match="forcing"):
        next_contact(Oscillator.create([1.0], [1.0], 0.1, [0.0], 0.8), [0.5], 1e-6)
    with pytest.raises(ParameterError, match="max_order"):
        recurrence_sequence(grazing_point(DEFAULT, 0.29), 0)
    with pytest.raises(ParameterError, match="max_order"):
        next_contact(DEFAULT, [0.29], 1e-6, 0)
    for distance in (0.0, 1.0, -1e-3, math.nan, [1e-3, 1e-3]):
        with pytest.raises(ParameterError, match="distance"):
            next_contact(DEFAULT, [0.29], distance)


def test_the_sequence_along_a_curve_is_that_of_its_points_and_gives_its_recurrences() -> None:
    omega = np.linspace(0.2, 1.2, 60)
    xi = xi_along(DEFAULT, omega, 6)
    curve = grazing_curve(DEFAULT, omega, 6)
    for k in (0, 17, 43):
        np.testing.assert_allclose(
            xi[k], recurrence_sequence(grazing_point(DEFAULT, float(omega[k])), 6).xi, rtol=1e-12
        )
    recurs = (-1.0) ** np.arange(1, 7) * xi < 0.0
    first = np.where(recurs.any(axis=1), recurs.argmax(axis=1) + 1, 0)
    np.testing.assert_array_equal(first, curve.first_recurrence)
