"""The borders of a map: every one explained, and the explanations against closed forms and simulation."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest

from grazemap_core.codes import INFINITE
from grazemap_core.continuation.motion_curves import distances_from_line
from grazemap_core.errors import ParameterError
from grazemap_core.maps.borders.map_borders import BORDER_REASONS, EXPLANATIONS, MapBorders, map_borders
from grazemap_core.maps.borders.motion_grid import MotionGrid, MotionName, positions
from grazemap_core.maps.borders.regions import NO_REGION, Regions
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbits_at_clearance
from tests.oracles.steady_displacements import steady_response
from tests.support.borders import count, explained_steps, planted
from tests.support.oscillators import DEFAULT
from tests.support.thorough import the_first

OMEGA, CLEARANCE = np.linspace(0.275, 0.29, 48), np.linspace(1.8, 2.0, 48)
"""Round the codimension-two point of order 2."""
IMPACT_ON_ONE_STOP = MotionName(1, 1, -1, False, False)


@functools.cache
def near_the_point() -> tuple[dict[str, np.ndarray], MapBorders]:
    arrays = unfolding_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE))
    return arrays, map_borders(Plane.of(DEFAULT, OMEGA, CLEARANCE), arrays)


def calm(rows: int = 4, columns: int = 4) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Return a map above the grazing curve, with nothing but the steady motion."""
    omega, clearance = np.linspace(0.27, 0.271, columns), np.linspace(2.2, 2.21, rows)
    return omega, clearance, unfolding_map_tile(Plane.of(DEFAULT, omega, clearance))


def without_orbit() -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Return `calm` with a point whose motion does not exist."""
    omega, clearance, arrays = calm()
    motion = {"period": 2, "impacts_right": 1, "impacts_left": 1, "least_impact_velocity": 0.1, "symmetric": False}
    return omega, clearance, planted(arrays, (1, 2), **motion)


@pytest.mark.thorough
def test_every_border_near_the_codimension_two_point_is_explained():
    arrays, borders = near_the_point()
    many, few = (choose(arrays["impacts_right"], arrays["impacts_left"]) for choose in (np.maximum, np.minimum))
    codes = np.stack([arrays["period"], many, few, arrays["symmetric"]], axis=-1)
    steps = explained_steps(arrays, codes, borders)
    assert steps > 200
    assert count(borders, "curve") > 0.9 * steps
    assert count(borders, "coexistence") > 0
    assert {curve.type for curve in borders.curves} == {"SN", "PD", "SB", "NS", "GR"}
    np.testing.assert_array_equal(borders.curve >= 0, borders.explanation == EXPLANATIONS.index("curve"))


@pytest.mark.thorough
def test_curves_of_motions_with_one_impact_are_the_closed_form_s():
    """The search does not use them; it follows trajectories of the map."""
    compared = {"SN": 0, "PD": 0, "GR": 0}
    for curve in near_the_point()[1].curves:
        if curve.name != IMPACT_ON_ONE_STOP or curve.orbits is None:
            continue
        for omega, clearance in list(zip(curve.horizontal, curve.vertical, strict=True))[::12]:
            special = one_impact_branch(DEFAULT, float(omega), 1).special_points
            known = [point.clearance for point in special if point.type == curve.type]
            if curve.orbits.velocities.shape[1] == 1 and known:
                assert min(abs(clearance - exact) for exact in known) < 1e-9
                compared[curve.type] += 1
            elif curve.type == "GR" and known:  # with the contact that appears
                assert min(abs(clearance - exact) for exact in known) < 1e-9
                compared["GR"] += 1
    assert min(compared.values()) > 0


@pytest.mark.thorough
def test_the_steady_motion_ends_on_the_grazing_curve():
    _, borders = near_the_point()
    grazing = next(curve for curve in borders.curves if curve.orbits is None)
    assert grazing.name.without_impacts
    amplitude = np.abs(steady_response(DEFAULT, grazing.horizontal)[:, 0])
    np.testing.assert_allclose(grazing.vertical, amplitude, rtol=1e-14)
    explained = np.flatnonzero(borders.curve == borders.curves.index(grazing))
    assert len(explained) > 20


@pytest.mark.thorough
def test_where_motions_coexist_a_trajectory_of_each_keeps_it_one_step_further():
    """The one of the pair's other point is started where the one from rest has ended at the first."""
    arrays, borders = near_the_point()
    chosen = np.flatnonzero(borders.explanation == EXPLANATIONS.index("coexistence"))
    stayed = 0
    for k in chosen:
        row, column, along = int(borders.row[k]), int(borders.column[k]), int(borders.along[k])
        points = [(row, column), (row + 1 - along, column + along)]
        for point, other in (points, points[::-1]):
            run = trajectory(DEFAULT, OMEGA[point[1]], CLEARANCE[point[0]], transient_periods=600, samples_per_period=1)
            assert run.final is not None
            displacement = run.final.displacement.copy()
            if abs(displacement[0]) >= CLEARANCE[other[0]]:
                continue
            later = trajectory(
                DEFAULT,
                OMEGA[other[1]],
                CLEARANCE[other[0]],
                displacement,
                run.final.velocity,
                run.final.phase,
                transient_periods=600,
                samples_per_period=1,
            )
            names = [(path.motion.period, path.motion.impacts_right, path.motion.impacts_left) for path in (run, later)]
            stayed += names[0] == names[1] and names[0][0] == arrays["period"][point]
    assert stayed >= 1.5 * len(chosen)  # of two each; a step may lead out of a narrow basin


@pytest.mark.thorough
def test_every_point_of_a_region_has_the_orbit_of_its_closed_form():
    arrays, _ = near_the_point()
    regions = Regions(MotionGrid.of(Plane.of(DEFAULT, OMEGA, CLEARANCE), arrays))
    regions.find()
    (largest, *_) = sorted(
        (region for region in regions.items if region.name == IMPACT_ON_ONE_STOP),
        key=lambda region: -len(region.orbits),
    )
    assert len(largest.orbits) > 400
    for row, column in list(largest.orbits)[::40]:
        branch = one_impact_branch(DEFAULT, float(OMEGA[column]), 1)
        speeds = [orbit.impact_velocity for orbit in orbits_at_clearance(branch, float(CLEARANCE[row]), 1)]
        _, velocities = largest.orbits[row, column]
        assert min(abs(abs(velocities[0]) - speed) for speed in speeds) < 1e-11
        assert abs(velocities[0]) == pytest.approx(arrays["least_impact_velocity"][row, column], abs=1e-9)
    free = arrays["impacts_right"] == arrays["impacts_left"]
    free &= arrays["impacts_right"] == -1
    assert np.all(regions.number[free] == NO_REGION)


def test_a_motion_that_is_not_found_leaves_its_borders_unexplained():
    omega, clearance, wrong = without_orbit()
    borders = map_borders(Plane.of(DEFAULT, omega, clearance), wrong)
    assert len(borders.row) == count(borders, "unexplained") == 4
    assert {BORDER_REASONS[reason] for reason in borders.reason} == {BORDER_REASONS[1]}
    np.testing.assert_array_equal(np.argwhere(borders.without_orbit), [[1, 2]])


@pytest.mark.parametrize("values", [{"sticking": True}, {"impacts_left": INFINITE}])
def test_a_motion_with_rests_gives_the_reason_why_it_is_not_followed(values):
    omega, clearance, arrays = calm()
    wrong = planted(arrays, (1, 2), impacts_right=1, least_impact_velocity=0.0, **values)
    borders = map_borders(Plane.of(DEFAULT, omega, clearance), wrong)
    assert count(borders, "unexplained") == 4
    assert all("rests" in BORDER_REASONS[reason] for reason in borders.reason)


def test_a_map_with_one_motion_has_no_borders_and_a_chaotic_point_in_it_is_counted_separately():
    omega, clearance, arrays = calm()
    assert len(map_borders(Plane.of(DEFAULT, omega, clearance), arrays).row) == 0
    told = []
    strange = planted(arrays, (0, 0), kind=KINDS.index("chaotic"))
    strange["kind"][0, 1] = KINDS.index("unresolved")
    borders = map_borders(Plane.of(DEFAULT, omega, clearance), strange, lambda done, total: told.append((done, total)))
    assert count(borders, "goes on", regular=False) == len(borders.row) == 3
    assert not borders.regular.any()
    assert borders.irregular_pairs == 1
    assert told == []


def small(rows: int = 8, columns: int = 8) -> tuple[Plane, dict[str, Any]]:
    """Return a coarse map across the largest regions of `near_the_point`."""
    omega, clearance = np.linspace(0.276, 0.281, columns), np.linspace(1.83, 1.93, rows)
    plane = Plane.of(DEFAULT, omega, clearance)
    return plane, unfolding_map_tile(plane)


def test_progress_is_reported_in_steps_that_increase_and_end_before_the_total():
    told: list[tuple[int, int]] = []
    map_borders(*small(), lambda done, total: told.append((done, total)))
    done = [step for step, _ in told]
    assert {total for _, total in told} == {1000}
    assert done == sorted(set(done))
    assert done[0] > 0
    assert 990 < done[-1] < 1000
    assert max(np.diff([0, *done])) < 500


@pytest.mark.parametrize(
    ("bound", "words"),
    the_first(1, [("BORDER_WORK", "allowed for one border"), ("BORDERS_WORK", "allowed for all borders")]),
)
def test_borders_that_exceed_the_work_limit_give_this_reason(monkeypatch, bound, words):
    free = map_borders(*small())
    assert count(free, "unexplained") == 0
    monkeypatch.setattr(f"grazemap_core.maps.tolerances.{bound}", 1)
    borders = map_borders(*small())
    assert len(borders.row) == len(free.row)
    left = borders.explanation == EXPLANATIONS.index("unexplained")
    assert np.count_nonzero(left) > 10
    assert all(words in BORDER_REASONS[reason] for reason in borders.reason[left])
    assert [curve.type for curve in borders.curves if curve.orbits is not None] == []
    assert count(borders, "curve") > 0  # the grazing curve takes nothing


def test_more_impacts_are_followed_over_fewer_orbits(monkeypatch):
    monkeypatch.setattr("grazemap_core.maps.tolerances.BORDER_WORK", 16**2 * 8)
    borders = map_borders(*small())
    points = {curve.type: len(curve.horizontal) for curve in borders.curves if curve.orbits is not None}
    assert points["GR"] <= 2 * 8 + 1
    assert points["SB"] <= 2 * 4 + 1  # an orbit of its curve takes as much as two of others


def test_searches_among_random_states_are_bounded(monkeypatch):
    omega, clearance, wrong = without_orbit()
    monkeypatch.setattr("grazemap_core.maps.borders.regions.BORDER_SEARCH_PERIODS", 0)
    monkeypatch.setattr(Regions, "_starts", property(lambda self: pytest.fail("looked for")))
    assert count(map_borders(Plane.of(DEFAULT, omega, clearance), wrong), "unexplained") == 4


@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_borders_of_maps_of_two_by_two_points_are_explained_or_have_a_reason(restitution):
    oscillator = dataclasses.replace(DEFAULT, restitution=restitution)
    plane = Plane.of(oscillator, np.array([0.26, 0.3]), np.array([1.5, 2.05]))
    borders = map_borders(plane, unfolding_map_tile(plane))
    explained = borders.explanation != EXPLANATIONS.index("unexplained")
    assert len(borders.row) > 0
    np.testing.assert_array_equal(explained, borders.reason == 0)


def test_an_orbit_with_another_slowest_impact_than_the_map_is_rejected():
    omega, clearance = np.linspace(0.270, 0.2702, 3), np.linspace(1.852, 1.853, 3)
    arrays = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance))
    assert np.all(arrays["impacts_right"] + arrays["impacts_left"] == 0)
    assert len(map_borders(Plane.of(DEFAULT, omega, clearance), arrays).row) == 0
    wrong = planted(arrays, (1, 1), least_impact_velocity=arrays["least_impact_velocity"][1, 1] * (1.0 + 1e-4))
    borders = map_borders(Plane.of(DEFAULT, omega, clearance), wrong)
    np.testing.assert_array_equal(np.argwhere(borders.without_orbit), [[1, 1]])
    assert count(borders, "unexplained") == 4


def test_a_grid_that_is_not_the_map_s_is_refused():
    omega, clearance, arrays = calm()
    for bad in ((omega[:-1], clearance), (omega[::-1], clearance), (omega, clearance[:1])):
        with pytest.raises(ParameterError):
            map_borders(Plane.of(DEFAULT, *bad), arrays)


def test_distances_are_in_steps_of_the_map_and_from_what_is_drawn():
    values = np.array([1.0, 2.0, 4.0])
    np.testing.assert_allclose(positions(values, np.array([0.5, 1.5, 3.0, 6.0])), [-0.5, 0.5, 1.5, 3.0])
    line = np.array([[0.0, 0.0], [0.0, 4.0], [5.0, 4.0]])
    places = np.array([[1.0, 2.0], [2.0, 5.0], [-3.0, 0.0]])
    np.testing.assert_allclose(distances_from_line(places, line, np.array([True, True, True])), [1.0, 1.0, 3.0])
    # the second piece is left out, and the second place is nearest to the end of the first
    np.testing.assert_allclose(
        distances_from_line(places, line, np.array([True, False, False])), [1.0, np.sqrt(5.0), 3.0]
    )
    assert np.all(np.isinf(distances_from_line(places, line, np.zeros(3, dtype=bool))))
    np.testing.assert_allclose(distances_from_line(places[:1], np.ones((1, 2))), [1.0])
