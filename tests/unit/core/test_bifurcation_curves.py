"""Curves of special orbits over frequency and clearance, against closed forms, their orbits and the tangent flow."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from grazemap_core.continuation.bifurcation_curves import BifurcationProblem, bifurcation_curve
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.oracles.closed_form import one_impact_branch
from tests.support.orbits import in_window, orbit_on, random_chain, sixteen_impacts, start, tangent_flow, two_impacts
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import KERNELS_FIRST


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("damping", ["proportional", "per link"])
def test_curves_of_orbits_with_one_impact_are_the_closed_form_s(symmetric, damping):
    oscillator = DEFAULT if damping == "proportional" else random_chain(np.random.default_rng(2), 2, True, 0.7)
    omega = 0.27 if damping == "proportional" else 0.9
    known = one_impact_branch(oscillator, omega, 1, symmetric)
    begin = start(known, max(known.lowest + 0.2, 1.2))
    branch = orbit_branch(oscillator, begin, 0.5 * known.amplitude, 1.2 * max(begin.clearance, known.amplitude))
    compared = 0
    for point in branch.special_points:
        if point.impacts.velocities[0] < 0.0 and point.impact is None:
            continue
        ranges = (0.95 * omega, 1.05 * omega), (0.5 * point.clearance, 1.5 * point.clearance)
        curve = bifurcation_curve(oscillator, point, *ranges)
        assert set(curve.ends) <= {"range", "closed"}
        assert np.max(curve.residual) <= 1e-13
        for i, frequency in list(enumerate(curve.omega))[:: 3 if damping == "proportional" else 1]:
            if point.impact is not None:
                assert curve.clearance[i] == pytest.approx(
                    grazing_curve(oscillator, [frequency]).clearance[0], rel=1e-11
                )
                compared += 1
            elif curve.velocities[i, 0] > 1e-6:
                theirs = one_impact_branch(oscillator, float(frequency), 1, symmetric)
                same = [p for p in theirs.special_points if p.type == curve.type and p.impact_velocity > 0.0]
                if same:  # of contacts the closed form has the first only
                    near = min(same, key=lambda p: abs(p.clearance - curve.clearance[i]))
                    assert near.clearance == pytest.approx(curve.clearance[i], rel=1e-10)
                    assert near.admissible == curve.admissible[i]
                    compared += 1
    assert compared >= 10


def test_multipliers_along_curves_are_those_of_their_kind():
    seen = set()
    for branch in (two_impacts(), sixteen_impacts()):
        for point in branch.special_points:
            if point.type == "GR" or (point.type, len(branch.stops)) in seen:
                continue
            seen.add((point.type, len(branch.stops)))
            curve = bifurcation_curve(DEFAULT, point, (0.268, 0.272), (1.4, 1.9))
            assert np.max(curve.residual) <= 1e-12
            assert np.ptp(curve.omega) > 1e-3
            for multipliers in curve.multipliers:
                off = {
                    "SN": np.min(np.abs(multipliers - 1.0)),
                    "SB": np.min(np.abs(multipliers + 1.0)),
                    "NS": np.min(np.abs(np.abs(multipliers[multipliers.imag != 0.0]) - 1.0), initial=math.inf),
                }
                assert off[curve.type] < 1e-7, curve.type
    assert {kind for kind, _ in seen} == {"SN", "SB", "NS"}
    assert {count for _, count in seen} == {2, 8}


@KERNELS_FIRST
def test_the_tangent_flow_has_a_pair_on_the_unit_circle_along_a_neimark_sacker_curve():
    (point,) = [p for p in two_impacts().special_points if p.type == "NS" and p.admissible]
    curve = bifurcation_curve(DEFAULT, point, (0.26, 0.275), (1.4, 1.9))
    # below it the pair meets on the real axis: a resonance, at which the curve has its end
    assert set(curve.ends) == {"real", "range"}
    assert np.all(curve.admissible)
    for index in (0, len(curve.omega) // 2, -1):
        run = tangent_flow(DEFAULT, orbit_on(DEFAULT, curve, index))
        assert abs(abs(run.multipliers[0]) - 1.0) < 1e-7


def test_along_a_curve_of_grazes_the_orbit_without_the_graze_touches_a_stop():
    points = [p for p in sixteen_impacts().special_points if p.type == "GR" and p.admissible and p.impact is None]
    for point in points:
        curve = bifurcation_curve(DEFAULT, point, (0.268, 0.272), (1.4, 1.9))
        assert curve.impact is not None
        np.testing.assert_array_equal(curve.velocities[:, curve.impact], 0.0 * curve.omega)
        assert np.any(curve.admissible)
        for index in np.flatnonzero(curve.admissible)[::4]:
            orbit = orbit_on(DEFAULT, curve, index)
            assert orbit.converged
            assert abs(orbit.excess) < 1e-10


def test_a_curve_says_where_the_orbits_beside_it_are_stable():
    verdicts = {kind: set() for kind in ("SB", "NS", "GR")}
    for branch in (two_impacts(), sixteen_impacts()):
        for point in branch.special_points:
            if point.type not in verdicts:
                continue
            curve = bifurcation_curve(DEFAULT, point, (0.268, 0.272), (1.4, 1.9))
            for index in range(1, len(curve.omega) - 1, 3):
                verdict = bool(curve.stable_beside[index])
                if curve.impact is not None:
                    if len(curve.stops) > 1:
                        assert orbit_on(DEFAULT, curve, index).stable == verdict
                        verdicts["GR"].add(verdict)
                    continue
                along = [values[index + 1] - values[index - 1] for values in (curve.omega, curve.clearance)]
                across = 2e-4 * np.array([-along[1], along[0] * 1e-2]) / np.hypot(along[1], 10.0 * along[0])
                sides = [_beside(curve, index, sign * across) for sign in (1.0, -1.0)]
                assert all(orbit.converged for orbit in sides)
                assert [orbit.stable for orbit in sides].count(True) == int(verdict)
                verdicts[curve.type].add(verdict)
    assert verdicts["GR"] == {True, False}
    assert True in verdicts["SB"] | verdicts["NS"]
    assert False in verdicts["SB"] | verdicts["NS"]


def _beside(curve, index, move):
    impacts = orbit_on(DEFAULT, curve, index).impacts
    return periodic_orbit(
        DEFAULT, float(curve.omega[index] + move[0]), float(curve.clearance[index] + move[1]), impacts
    )


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("omega", {"horizontal": (0.28, 0.29)}),
        ("omega", {"horizontal": (0.0, 0.29)}),
        ("clearance", {"vertical": (1.9, 1.4)}),
        ("longest_step", {"longest_step": 2.0}),
        ("max_points", {"max_points": 0}),
        ("point", {}),
    ],
)
def test_invalid_curve_requests_are_refused(name, change):
    point = two_impacts().special_points[0]
    if name == "point":
        point = dataclasses.replace(point, reason="not solved for")
    with refused(name):
        bifurcation_curve(DEFAULT, point, **({"horizontal": (0.26, 0.28), "vertical": (1.2, 1.9)} | change))


@pytest.mark.parametrize(("stops", "kind"), [((1,), "SN"), ((1,), "PD"), ((1, -1), "SB"), ((1, 1, -1, -1), "SB")])
def test_the_gradient_of_a_condition_is_that_of_the_smallest_singular_value(stops, kind):
    """Beside a special point, where neither the condition nor the orbit's equations vanish."""
    orbit = in_window(DEFAULT, (0.27, 0.29), (1.5, 1.9), 1, list(stops))
    branch = orbit_branch(DEFAULT, orbit, 1.3, 1.95, "clearance")
    point = next(special for special in branch.special_points if special.type == kind and special.status == "converged")
    impacts = point.impacts
    path = BifurcationProblem(DEFAULT, point, impacts, None)
    place = path.unknowns(impacts, path.fixed)
    place = place + 1e-4 * np.sin(1.0 + np.arange(len(place)))

    def least(unknowns):
        matrix = path.of_orbit(unknowns)[1][:, : 2 * path.count] if kind == "SN" else path.doubling_matrix(unknowns)
        return np.linalg.svd(matrix)[1][-1]

    differences = np.array([(least(place + step) - least(place - step)) / 2e-6 for step in 1e-6 * np.eye(len(place))])
    residual, derivatives, _ = path.equations(place)
    length = np.linalg.norm(differences)
    assert abs(abs(derivatives[-1] @ differences) / length - 1.0) < 1e-12
    np.testing.assert_allclose(np.abs(derivatives[-1]), np.abs(differences) / length, atol=1e-7)
    assert abs(residual[-1]) == pytest.approx(least(place) / length, rel=1e-7)
