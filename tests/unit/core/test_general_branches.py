"""Branches over every parameter, between any stops: derivatives, closed forms, and a pitchfork that unfolds."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from grazemap_core.continuation.bifurcation_curves import bifurcation_curve
from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import OrbitBranch, orbit_branch
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.continuation.motion_curves import lies_on, motion_curves
from grazemap_core.continuation.parameters import PARAMETERS, Parameter, ParameterPoint
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from grazemap_core.orbits.single_impact.window_curves import window_curves
from tests.oracles.closed_form import one_impact_branch
from tests.support.general_systems import random_oscillator, with_orbit
from tests.support.orbits import in_window, orbit_with
from tests.support.oscillators import COCO, DEFAULT
from tests.support.refused import refused


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_with_respect_to_every_parameter(seed: int) -> None:
    """Against central differences of the residual, at a point off the orbits."""
    random = np.random.default_rng(seed)
    oscillator = random_oscillator(random, seed)
    right, left = 0.6, 0.6 if seed % 2 else 0.8
    if seed == 1:
        oscillator = dataclasses.replace(oscillator, restitution_left=None)
    values = ParameterPoint.of(oscillator, 0.9, (right, left))
    impacts = ImpactSequence.create(1, [1, -1, 1], [0.3, 1.1, 2.4], random.normal(size=3))
    checked = 0
    for name in PARAMETERS:
        try:
            values.value(name)
        except ParameterError:  # of both stops, which differ
            continue
        checked += 1
        path = ContinuationProblem(oscillator, Pattern(1, False), np.array([1, -1, 1]), (name,), values)
        unknowns = path.unknowns(impacts, values)
        unknowns[-1] += 0.01
        derivatives = path.of_orbit(unknowns)[1]
        for column in range(len(unknowns)):
            step = np.zeros(len(unknowns))
            step[column] = 1e-5
            ends = [path.of_orbit(unknowns + sign * step)[0] for sign in (1.0, -1.0)]
            size = 1.0 + np.max(np.abs(derivatives[:, column]))
            np.testing.assert_allclose((ends[0] - ends[1]) / 2e-5, derivatives[:, column], rtol=0.0, atol=1e-7 * size)
    assert checked == len(PARAMETERS) - (seed != 1) - (seed % 2 == 0)


def of_two() -> tuple[Oscillator, PeriodicOrbit]:
    """A stable orbit of several impacts between unequal stops, under two harmonics and a bias."""
    system, orbit = with_orbit(15)
    return system.oscillator, orbit


@pytest.mark.parametrize(
    "name",
    ["omega", "clearance_right", "clearance_left", "restitution_right", "restitution_left", "bias", "forcing"],
)
def test_every_orbit_of_a_branch_is_one_of_the_changed_oscillator(name: Parameter) -> None:
    oscillator, orbit = of_two()
    here = ParameterPoint.of(oscillator, orbit.omega, orbit.clearance).value(name)
    width = 0.01 * (1.0 if name in ("bias", "forcing") else here)
    branch = orbit_branch(oscillator, orbit, here - width, here + width, name, max_points=6)
    assert len(branch.values) >= 3
    for place in (0, len(branch.values) // 2, -1):
        values = branch.points[place]
        assert values.value(name) == branch.values[place]
        changed = values.applied(oscillator)
        guess = ImpactSequence.create(
            branch.period, branch.stops, branch.phases[place] - 1e-4, 1.001 * branch.velocities[place]
        )
        known = periodic_orbit(changed, values.omega, values.clearance, guess)
        np.testing.assert_allclose(known.impacts.velocities, branch.velocities[place], rtol=1e-9)
        assert np.sort(np.abs(known.multipliers)) == pytest.approx(np.sort(np.abs(branch.multipliers[place])), abs=1e-9)


def of_one(oscillator: Oscillator, omega: float, multiple: int, stop: int, angle: float = 1.3) -> PeriodicOrbit:
    """An orbit of one impact on one stop alone, from its closed form."""
    known = one_impact_branch(oscillator, omega, multiple, stop=stop, alone=True)
    gap, place = known.clearance(angle), contact_equilibrium(oscillator)
    family = OrbitFamily.of(oscillator, multiple, False).at(omega)
    orbits = OneImpactOrbits([family], stop, 1.0 + oscillator.restitution_of(stop))
    phases, _ = orbits.phases(gap)
    phase = min(phases, key=lambda impact_phase: abs(orbits.speed(impact_phase) - known.impact_velocity(angle)))
    clearance = (gap + place, None) if stop > 0 else (None, gap - place)
    return periodic_orbit(oscillator, omega, clearance, orbits.impacts(phase))


@pytest.mark.parametrize(("omega", "multiple", "stop"), [(0.8, 1, 1), (0.8, 1, -1), (1.2, 1, 1), (0.75, 2, 1)])
def test_special_points_over_one_clearance_are_those_of_the_closed_form(omega: float, multiple: int, stop: int) -> None:
    oscillator = dataclasses.replace(COCO, bias=np.array([0.1]))
    known = one_impact_branch(oscillator, omega, multiple, stop=stop, alone=True)
    orbit = of_one(oscillator, omega, multiple, stop)
    place = stop * contact_equilibrium(oscillator)
    name: Parameter = "clearance_right" if stop > 0 else "clearance_left"
    branch = orbit_branch(oscillator, orbit, 0.3 * known.amplitude, 6.0 * known.amplitude, name)
    inside = [p for p in known.special_points if 0.3 * known.amplitude < p.clearance + place < 6.0 * known.amplitude]
    ours = [p for p in branch.special_points if all(p.impacts.velocities * stop >= -1e-12) and p.type != "NS"]
    assert len([p for p in inside if p.type != "GR"]) >= 1
    for point in inside:
        alike = [p for p in ours if p.type == point.type]
        gaps = [p.values.value(name) - place for p in alike]
        assert min(abs(gap - point.clearance) for gap in gaps) < 1e-9 * known.amplitude
    assert {p.type for p in ours} <= {p.type for p in inside}


def test_the_factor_of_the_forces_is_a_change_of_the_clearance() -> None:
    """With no bias, the orbit under the force F and the clearance c is F times that of the force 1 and c/F."""
    orbit = of_one(COCO, 0.8, 1, 1)
    assert isinstance(orbit.clearance, tuple)
    gap = orbit.clearance[0]
    assert gap is not None
    over_force = orbit_branch(COCO, orbit, 0.5, 2.0, "forcing")
    over_gap = orbit_branch(COCO, orbit, gap / 2.0, gap / 0.5, "clearance_right")
    for kind in ("SN", "PD", "GR"):
        forces = sorted(p.values.forcing for p in over_force.special_points if p.type == kind)
        other = sorted(gap / p.values.clearance_right for p in over_gap.special_points if p.type == kind)
        assert forces == pytest.approx(other, rel=1e-9)
    assert "PD" in {p.type for p in over_force.special_points}


@functools.cache
def symmetric_branch() -> tuple[OrbitBranch, PeriodicOrbit]:
    """The symmetric orbits 1-1r-1l at 0.27 with their SB, and the orbit from which they were followed."""
    known = one_impact_branch(DEFAULT, 0.27, 1, symmetric=True)
    clearance = known.clearance(1.3)
    orbit = orbit_with(DEFAULT, 0.27, clearance, 1, [1, -1])
    return orbit_branch(DEFAULT, orbit, 0.8 * known.amplitude, 1.05 * known.amplitude), orbit


@functools.cache
def beyond_the_pitchfork() -> tuple[ImpactSequence, float, float]:
    """Impacts of an orbit on the branch that leaves the SB, its clearance, and that of the SB."""
    branch, _ = symmetric_branch()
    (point,) = [p for p in branch.special_points if p.type == "SB" and p.impacts.velocities[0] > 0.0]
    (start,) = starts_beyond(DEFAULT, point)
    assert not start.impacts.symmetric
    assert isinstance(point.clearance, float)
    assert isinstance(start.clearance, float)
    orbit = periodic_orbit(DEFAULT, 0.27, start.clearance, start.impacts)
    branch = orbit_branch(DEFAULT, orbit, 0.9 * point.clearance, 1.02 * point.clearance)
    assert "SB" in {p.type for p in branch.special_points}
    physical = np.all(branch.velocities * branch.stops > 0.0, axis=1)
    place = int(np.argmin(np.where(physical, np.abs(branch.clearance - 1.002 * point.clearance), np.inf)))
    impacts = ImpactSequence.create(1, branch.stops, branch.phases[place], branch.velocities[place])
    return impacts, float(branch.clearance[place]), point.clearance


def unfolded(offset: float) -> tuple[Oscillator, list[OrbitBranch]]:
    """The branches of the orbit and of its mirror image, with the equilibrium moved by `offset`."""
    impacts, clearance, place = beyond_the_pitchfork()
    push = np.array([offset, 0.0, 0.0]) / np.linalg.inv(DEFAULT.stiffness_matrix)[0, 0]
    oscillator = dataclasses.replace(DEFAULT, bias=push)
    mirror = ImpactSequence.create(1, -impacts.stops, impacts.phases + math.pi, -impacts.velocities)
    branches = []
    for guess in (impacts, mirror):
        orbit = periodic_orbit(oscillator, 0.27, clearance, guess)
        assert orbit.converged
        assert not orbit.symmetric
        # branches that nearly meet need short steps
        branches.append(orbit_branch(oscillator, orbit, 0.98 * place, 1.004 * place, longest_step=0.01))
        assert "SB" not in {p.type for p in branches[-1].special_points}
    return oscillator, branches


def nodes(branch: OrbitBranch) -> list[SpecialPoint]:
    """Its saddle-nodes near the SB."""
    place = beyond_the_pitchfork()[2]
    return [p for p in branch.special_points if p.type == "SN" and abs(p.values.clearance_right - place) < 0.01 * place]


def test_a_pitchfork_unfolds_into_a_saddle_node() -> None:
    """With a small bias the branches no longer meet: one of the two turns, the other one does not, and there is no SB.

    The bias in the other direction exchanges them. The distance of the saddle-node from the SB grows with the power 2/3
    of the bias.
    """
    place = beyond_the_pitchfork()[2]
    away = {}
    for offset in (1e-5, 1e-4, -1e-4):
        _, branches = unfolded(offset)
        turning = [bool(nodes(branch)) for branch in branches]
        assert sorted(turning) == [False, True]
        (point,) = nodes(branches[turning.index(True)])
        assert point.status == "converged"
        assert np.min(np.abs(point.multipliers - 1.0)) < 1e-5
        away[offset] = turning.index(True), abs(point.values.clearance_right - place)
    assert away[1e-4][1] / away[1e-5][1] == pytest.approx(10.0 ** (2.0 / 3.0), rel=0.05)
    assert away[-1e-4][0] != away[1e-4][0]
    assert away[-1e-4][1] == pytest.approx(away[1e-4][1], rel=1e-6)


def test_the_unfolded_saddle_node_is_a_curve_over_one_clearance() -> None:
    """In the plane of the frequency and the right clearance, and in that of both clearances."""
    oscillator, branches = unfolded(1e-4)
    (point,) = [p for branch in branches for p in nodes(branch)]
    place = point.values.clearance_right
    planes: tuple[tuple[tuple[Parameter, Parameter], tuple[float, float]], ...] = (
        (("omega", "clearance_right"), (0.268, 0.272)),
        (("clearance_left", "clearance_right"), (0.99 * place, 1.01 * place)),
        (("bias", "clearance_right"), (0.5, 2.0)),
        (("restitution", "clearance_right"), (0.78, 0.82)),
    )
    for plane, across in planes:
        curve = bifurcation_curve(oscillator, point, across, (0.9 * place, 1.1 * place), plane=plane, max_points=12)
        assert len(curve.horizontal) >= 5
        assert np.max(curve.residual) < 1e-11
        assert np.max(np.min(np.abs(curve.multipliers - 1.0), axis=1)) < 1e-5
        assert lies_on(point, curve)
        # one parameter off the curve there are two orbits, or none: to one side Newton's method finds one of them
        values, sides = curve.points[2], []
        for share in (1e-4, -1e-4):
            moved = values.varied("clearance_right", values.clearance_right * (1.0 + share))
            guess = ImpactSequence.create(1, curve.stops, curve.phases[2] + [0.005, -0.005], curve.velocities[2])
            sides.append(periodic_orbit(moved.applied(oscillator), moved.omega, moved.clearance, guess).converged)
        assert True in sides


def test_a_curve_of_one_stop_in_the_plane_of_frequency_and_clearance() -> None:
    """PD and SN of one stop alone, against the closed forms at the curve's frequencies."""
    orbit = of_one(COCO, 0.8, 1, 1)
    curves = motion_curves(COCO, orbit, (0.78, 0.82), (1.0, 3.0), max_points=30, plane=("omega", "clearance_right"))
    assert {"PD", "GR"} <= {curve.type for curve in curves}
    (curve,) = [curve for curve in curves if curve.type == "PD"]
    for place in range(0, len(curve.horizontal), 5):
        known = one_impact_branch(COCO, float(curve.horizontal[place]), 1, alone=True)
        (point,) = [p for p in known.special_points if p.type == "PD"]
        assert curve.vertical[place] == pytest.approx(point.clearance, rel=1e-10)
    middle = in_window(COCO, (0.8, 0.8), (1.0, 3.0), 1, [1], "clearance_right")
    assert middle is not None
    assert middle.clearance == (2.0, None)


@pytest.mark.parametrize(
    ("name", "bounds", "wrong"),
    [
        ("clearance", (0.1, 9.0), "parameter"),
        ("clearance_left", (0.1, 9.0), "parameter"),
        ("bias", (0.5, 1.5), "parameter"),
        ("damping", (0.5, 1.5), "parameter"),
        ("forcing", (-1.0, 1.5), "start"),
        ("restitution_right", (0.5, 1.5), "start"),
        ("clearance_right", (9.0, 10.0), "start"),
    ],
)
def test_parameters_that_do_not_exist_are_refused(name: str, bounds: tuple[float, float], wrong: str) -> None:
    orbit = of_one(COCO, 0.8, 1, 1)
    with refused(wrong):
        orbit_branch(COCO, orbit, *bounds, name)  # type: ignore[arg-type]


def test_beyond_a_graze_of_one_stop_there_is_no_motion_on_the_other() -> None:
    orbit = of_one(COCO, 0.8, 1, 1)
    branch = orbit_branch(COCO, orbit, 1.0, 3.0, "clearance_right")
    grazes = [p for p in branch.special_points if p.type == "GR" and p.impact is not None]
    assert grazes
    for point in grazes:
        assert starts_beyond(COCO, point, "clearance_right") == ()
    for point in (p for p in branch.special_points if p.type == "PD" and p.status == "converged"):
        (start,) = starts_beyond(COCO, point, "clearance_right")
        assert start.impacts.period == 2
        assert start.values.clearance_left == math.inf


def test_curves_of_one_stop_alone_in_a_window() -> None:
    """With a bias the window moves with the equilibrium; pieces are those of the stop that is there."""
    push = np.array([0.05, 0.0, 0.0])
    biased = dataclasses.replace(DEFAULT, bias=push)
    place = contact_equilibrium(biased)
    for stop in (1, -1):
        gaps = window_curves(DEFAULT, (0.26, 0.3), (1.5, 2.0), 2, 40, VariedStop(stop))
        window = 1.5 + stop * place, 2.0 + stop * place
        moved = window_curves(biased, (0.26, 0.3), window, 2, 40, VariedStop(stop))
        assert {"SN", "PD", "GR"} == {piece.type for piece in gaps}
        assert {(p.impacts_right, p.impacts_left) for p in gaps} == {(1, -1) if stop > 0 else (-1, 1), (-1, -1)}
        for piece, other in zip(gaps, moved, strict=True):
            np.testing.assert_allclose(other.value - stop * place, piece.value, rtol=0.0, atol=1e-14)
    pieces = window_curves(DEFAULT, (0.265, 0.275), (1.5, 2.0), 1, 3, VariedStop(1))
    (recorded,) = [p for p in pieces if p.type == "SN"]
    known = one_impact_branch(DEFAULT, 0.27, 1, alone=True)
    (point,) = [p for p in known.special_points if p.type == "SN"]
    assert recorded.value[recorded.omega == 0.27] == pytest.approx(point.clearance, rel=1e-13)


def test_the_search_finds_orbits_of_any_stops_from_trajectories() -> None:
    """A sequence that is not explicit is that of a trajectory, between stops that are not alike."""
    oscillator, orbit = of_two()
    stops = orbit.impacts.stops.tolist()
    searched_orbit = orbit_with(oscillator, orbit.omega, orbit.clearance, orbit.impacts.period, stops)
    assert np.sort(searched_orbit.impacts.velocities) == pytest.approx(np.sort(orbit.impacts.velocities), rel=1e-9)


def test_pairs_of_multipliers_on_either_side_of_a_graze_do_not_depend_on_the_steps() -> None:
    """A pair leaves the unit circle before the graze, where a multiplier is infinite, and comes back after it."""
    system, orbit = with_orbit(55)

    def places(longest: float) -> list[tuple[str, float]]:
        branch = orbit_branch(system.oscillator, orbit, 0.74, 1.0, "forcing", longest_step=longest)
        return [(point.type, point.values.forcing) for point in branch.special_points]

    known = places(0.02)
    assert [kind for kind, _ in known] == ["NS", "SN", "NS", "GR", "NS", "PD"]
    for longest in (0.06, 0.1):
        assert [kind for kind, _ in places(longest)] == [kind for kind, _ in known]
        np.testing.assert_allclose([at for _, at in places(longest)], [at for _, at in known], rtol=1e-10)


def test_the_direction_of_a_curve_does_not_depend_on_the_signs_of_singular_vectors(monkeypatch) -> None:
    """Along this GR curve a velocity and a phase are constant, so that round-off decides these signs."""
    system, orbit = with_orbit(92)
    branch = orbit_branch(system.oscillator, orbit, 0.87 * orbit.omega, 1.01 * orbit.omega, "omega")
    point = next(special for special in branch.special_points if special.impact is not None)
    (low, high), left = (0.99 * point.omega, 1.01 * point.omega), point.values.clearance_left
    plane: tuple[Parameter, Parameter] = ("omega", "clearance_left")
    decomposed = np.linalg.svd

    def turned(matrix, **options):
        """The same decomposition with all vectors turned around."""
        parts = decomposed(matrix, **options)
        return (-parts[0], parts[1], -parts[2]) if isinstance(parts, tuple) else parts

    for svd in (decomposed, turned):
        monkeypatch.setattr(np.linalg, "svd", svd)
        curve = bifurcation_curve(system.oscillator, point, (low, high), (0.9 * left, 1.1 * left), plane=plane)
        assert curve.horizontal[0] < curve.horizontal[-1]
