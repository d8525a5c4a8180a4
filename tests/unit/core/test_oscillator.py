"""The oscillator checks its parameters, and one system gives the same results in any units."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.trajectories import trajectory
from tests.support.orbits import one_impact_motions, special_motion
from tests.support.refused import refused

DEFAULT = {
    "masses": [1.0, 10.0, 10.0],
    "stiffnesses": [1.0, 5.0, 5.0],
    "damping": 0.05,
    "forcing": [1.0, 0.0, 0.0],
    "restitution": 0.8,
}


def test_the_matrices_are_those_of_equation_3():
    oscillator = Oscillator.create(**DEFAULT)
    assert np.array_equal(oscillator.stiffness_matrix, [[1, -1, 0], [-1, 6, -5], [0, -5, 10]])
    assert np.array_equal(oscillator.mass_matrix, np.diag([1, 10, 10]))
    assert np.allclose(oscillator.damping_matrix, 2 * 0.05 * oscillator.stiffness_matrix, rtol=1e-16)


def test_a_list_of_dampings_is_zeta_without_units_and_c_in_si():
    assert np.array_equal(Oscillator.create(**DEFAULT | {"damping": [0.1, 0.2, 0.3]}).link_damping, [0.2, 0.4, 0.6])
    assert np.array_equal(
        Oscillator.create(**DEFAULT | {"damping": [0.1, 0.2, 0.3]}, units="SI").link_damping, [0.1, 0.2, 0.3]
    )


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("masses", {"masses": []}),
        ("masses", {"masses": [1.0, 0.0, 1.0]}),
        ("masses", {"masses": [1.0, math.inf, 1.0]}),
        ("stiffnesses", {"stiffnesses": [1.0, 5.0]}),
        ("stiffnesses", {"stiffnesses": [1.0, -5.0, 5.0]}),
        *(("stiffnesses", {"stiffnesses": [1.0, size, 5.0]}) for size in (1e-70, 1e-250, 1e70, 1e250)),
        ("damping", {"damping": -0.1}),
        ("damping", {"damping": math.nan}),
        ("damping", {"damping": [0.1, 0.1]}),
        ("damping", {"damping": [0.1, -0.1, 0.1]}),
        ("forcing", {"forcing": [1.0, math.nan, 0.0]}),
        ("restitution", {"restitution": 1.5}),
        ("restitution", {"restitution": math.nan}),
        ("units", {"units": "imperial"}),
    ],
)
def test_bad_numbers_are_refused_by_name(name, change):
    with refused(name):
        Oscillator.create(**DEFAULT | change)


@pytest.mark.parametrize("per_link", [False, True])
def test_si_and_nondimensional_descriptions_agree(per_link):
    mass, stiffness, force = 0.37, 812.0, 2.3
    rate = math.sqrt(stiffness / mass)
    zeta = [0.05, 0.08, 0.02]
    plain = Oscillator.create(**DEFAULT | ({"damping": zeta} if per_link else {}))
    si = Oscillator.create(
        [mass * m for m in DEFAULT["masses"]],
        [stiffness * k for k in DEFAULT["stiffnesses"]],
        [2 * z * math.sqrt(stiffness * mass) for z in zeta] if per_link else 0.05 / rate,
        [force, 0.0, 0.0],
        0.8,
        units="SI",
    )
    omega = np.linspace(0.05, 2.5, 200)
    ours, theirs = grazing_curve(plain, omega), grazing_curve(si, omega * rate)
    assert np.max(np.abs(theirs.clearance * stiffness / force / ours.clearance - 1.0)) < 1e-13
    assert np.array_equal(ours.first_recurrence, theirs.first_recurrence)
    length = force / stiffness
    ours, theirs = one_impact_motions(plain, 0.27), one_impact_motions(si, 0.27 * rate)
    for kind in ("SN", "GR"):
        point, other = special_motion(ours, kind), special_motion(theirs, kind)
        assert other.gap == pytest.approx(point.gap * length, rel=1e-12)
        assert other.speed == pytest.approx(point.speed * length * rate, rel=1e-11)
    runs = trajectory(plain, 0.29, 1.6, periods=20), trajectory(si, 0.29 * rate, 1.6 * length, periods=20)
    assert len(runs[0].impacts.time) == len(runs[1].impacts.time)
    np.testing.assert_allclose(runs[1].impacts.time * rate, runs[0].impacts.time, rtol=1e-12)
    np.testing.assert_allclose(runs[1].displacement / length, runs[0].displacement, atol=1e-11)
    multipliers = [np.abs(monodromy(*at).multipliers) for at in ((plain, 0.29, 1.6), (si, 0.29 * rate, 1.6 * length))]
    np.testing.assert_allclose(*multipliers, rtol=0, atol=1e-11)
    here = codimension_two_points(plain, 0.1, 2.0)
    there = codimension_two_points(si, 0.1 * rate, 2.0 * rate)
    assert [(p.kind, p.order, p.multiple, p.bifurcation) for p in here] == [
        (p.kind, p.order, p.multiple, p.bifurcation) for p in there
    ]
    assert max(abs(q.omega / rate / p.omega - 1.0) for p, q in zip(here, there, strict=True)) < 1e-13


def test_a_contact_beyond_a_stop_is_moved_onto_it():
    chain = Oscillator.create(**DEFAULT)
    inside, right, left = ([place, 0.1, 0.2] for place in (0.3, 2.0, -2.0))
    assert chain.between(np.array(inside), (1.5, 1.0)).tolist() == inside
    assert chain.between(np.array(right), (1.5, 1.0)).tolist() == [1.5, 0.1, 0.2]
    assert chain.between(np.array(left), (1.5, 1.0)).tolist() == [-1.0, 0.1, 0.2]
    assert chain.between(np.array(left), (1.5, math.inf)).tolist() == left
    # an impulse along the stop moves it
    several = replace(chain, contact=np.array([1.0, -0.5, 0.0]))
    moved = several.between(np.array(right), (1.5, 1.0)) - right
    assert several.contact @ moved == pytest.approx(1.5 - (2.0 - 0.05), rel=1e-14)
    np.testing.assert_allclose(moved, several.jump * (several.contact @ moved), rtol=0, atol=1e-15)
