"""Periodic orbits of any structure, stops, restitutions and forces, against figures, 50 digits and simulation."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator, Variants
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import at_point, periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits, one_impact_sequences
from grazemap_core.orbits.states import states_at
from grazemap_core.orbits.two_impact_orbits import two_impact_sequences
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import differences, solved
from tests.support.general_figures import FIGURES
from tests.support.general_systems import mismatch, random_oscillator, with_orbit
from tests.support.orbits import one_impact_motions, orbit_with, special_motion, tangent_flow
from tests.support.oscillators import COCO, DEFAULT
from tests.support.refused import refused
from tests.support.thorough import the_first

SEEDS = the_first(8, [0, 1, 2, 5, 6, 7, 8, 9, 14, 15, 17, 18, 20, 22, 23])
"""Their trajectories settle to orbits of one to five impacts: of one stop and of two, a preloaded one among them."""


NAMED = [("coco", COCO), ("chain-one-stop", DEFAULT)]


@pytest.mark.parametrize(("name", "oscillator"), NAMED)
def test_recorded_orbits_of_one_stop(name: str, oscillator: Oscillator) -> None:
    for known in FIGURES[f"{name}/orbits"]:
        omega, clearance = float(known["omega"]), (float(known["right_stop"]), None)
        family, stops = at_point(oscillator, omega, clearance, ImpactSequence.create(known["n"], [1], [0.0], [1.0]))
        orbits = [
            periodic_orbit(oscillator, omega, clearance, guess) for guess in one_impact_sequences(family, stops, 1)
        ]
        (orbit,) = [
            candidate
            for candidate in orbits
            if candidate.impacts.velocities[0] == pytest.approx(float(known["v"]), rel=1e-11)
        ]
        assert math.remainder(orbit.phase - float(known["impact_phase_wt"]), 2.0 * math.pi) == pytest.approx(
            0.0, abs=1e-12
        )
        assert mismatch(orbit.multipliers, [complex(float(a), float(b)) for a, b in known["multipliers"]]) < 1e-11
        assert orbit.admissible == known["admissible_one_stop"]


@pytest.mark.parametrize(("name", "oscillator"), NAMED)
def test_recorded_curve_points_of_one_stop(name: str, oscillator: Oscillator) -> None:
    for known in FIGURES[f"{name}/curve_points"]:
        omega, gap = float(known["omega"]), float(known["effective_gap"])
        wanted = [pytest.approx(gap, rel=1e-11), pytest.approx(float(known["v"]), rel=1e-11)]
        orbits = OneImpactOrbits([OrbitFamily.of(oscillator, known["n"], False).at(omega)], 1, 1.8)
        phases, _ = orbits.saddle_nodes() if known["kind"] == "SN" else orbits.period_doublings()
        assert [[orbits.gap(phase), orbits.speed(phase)] for phase in phases] == [wanted]
        branch = one_impact_branch(oscillator, omega, known["n"], stop=1, alone=True)
        points = [[p.clearance, p.impact_velocity] for p in branch.special_points if p.type == known["kind"]]
        assert points == ([wanted] if gap > 0.0 else [])


def test_recorded_curve_points_over_the_force() -> None:
    for known in FIGURES["coco/curve_points_force_plane"]:
        motions = one_impact_motions(COCO, float(known["omega"]), known["n"], alone=True)
        point = special_motion(motions, known["kind"])
        assert 1.0 / point.gap == pytest.approx(float(known["force"]), rel=1e-11)
        assert point.speed / point.gap == pytest.approx(float(known["v_at_d_1"]), rel=1e-11)


def test_the_orbit_of_the_book() -> None:
    known = FIGURES["coco/book_orbit"]
    orbit = orbit_with(COCO, 1.0, (1.0, None), 1, [1])
    assert orbit.impacts.velocities[0] == pytest.approx(float(known["v_before"]), rel=1e-11)
    assert orbit.phase == pytest.approx(float(known["impact_time_mod_2pi"]), rel=1e-11)
    assert mismatch(orbit.multipliers, [complex(float(a), float(b)) for a, b in known["multipliers"]]) < 1e-11
    assert orbit.verified


@pytest.mark.parametrize("seed", SEEDS)
def test_random_systems_agree_with_fifty_digits(seed: int) -> None:
    system, orbit = with_orbit(seed)
    assert orbit.verified
    assert not orbit.symmetric
    exact = solved(system.oscillator, system.omega, system.clearance, orbit.impacts)
    phase, speed = differences(exact, orbit.impacts)
    assert phase < 1e-13
    assert speed < 1e-13 * np.max(np.abs(orbit.impacts.velocities))
    with digits():
        theirs = exact.multipliers()
    assert mismatch(orbit.multipliers, theirs) < 1e-13


@pytest.mark.parametrize("seed", SEEDS)
def test_random_systems_agree_with_simulation(seed: int) -> None:
    """The trajectory from the orbit's state returns to it, with the multipliers of the linearised flow."""
    system, orbit = with_orbit(seed)
    start, periods, count = orbit.start, 20 * orbit.impacts.period, len(orbit.impacts.stops)
    state = start.displacement, start.velocity
    run = trajectory(system.oscillator, system.omega, system.clearance, *state, periods=periods, samples_per_period=1)
    assert len(run.impacts.time) == 20 * count
    impacts = np.roll(orbit.impacts.velocities, -int(np.argmin(orbit.impacts.phases % (2.0 * math.pi))))
    assert np.sort(run.impacts.velocity[-count:]) == pytest.approx(np.sort(impacts), rel=1e-9)
    assert run.displacement[:, 0] == pytest.approx(start.displacement, abs=1e-13 * np.max(np.abs(run.displacement)))
    assert mismatch(orbit.multipliers, tangent_flow(system.oscillator, orbit).multipliers) < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_balances_of_momentum_and_energy(seed: int) -> None:
    """Over a period ``K mean(x) = bias + h mean(contact force)``; forces supply what damping and impacts lose."""
    system, orbit = with_orbit(seed)
    oscillator, impacts = system.oscillator, orbit.impacts
    family, _ = at_point(oscillator, system.omega, system.clearance, impacts)
    turn = 2.0 * math.pi * impacts.period
    nodes, weights = np.polynomial.legendre.leggauss(24)
    place, supplied, lost = np.zeros(oscillator.size), 0.0, 0.0
    ends = np.append(impacts.phases, impacts.phases[0] + turn)
    parts = np.unique(np.concatenate([np.linspace(a, b, 5) for a, b in itertools.pairwise(ends)]))
    for begin, end in itertools.pairwise(parts):
        for node, weight in zip(nodes, weights, strict=True):
            phase = 0.5 * (begin + end) + 0.5 * (end - begin) * node
            ((x, v),) = states_at(family, impacts, [float(phase)])
            forces = sum(
                (h.amplitudes(np.array([system.omega]))[0] * np.exp(1j * h.order * phase)).imag
                for h in oscillator.drive
            )
            share = 0.5 * (end - begin) * weight / turn
            place += share * x
            supplied += share * float(forces @ v)
            lost += share * float(v @ oscillator.damping_matrix @ v)
    restitution = np.array([oscillator.restitution_of(stop) for stop in impacts.stops.tolist()])
    period, mass = turn / system.omega, oscillator.effective_mass
    impulses = -(1.0 + restitution) * mass * impacts.velocities
    contact = oscillator.contact * np.sum(impulses) / period
    residual = oscillator.stiffness_matrix @ place - oscillator.bias - contact
    assert residual == pytest.approx(0.0, abs=1e-11 * np.max(np.abs(contact)))
    lost += float(np.sum(0.5 * mass * (1.0 - restitution**2) * impacts.velocities**2)) / period
    assert supplied == pytest.approx(lost, rel=1e-11)


@pytest.mark.parametrize("seed", [0, 5, 15, 18, 20])
def test_the_mirror_image_and_other_units_of_the_contact(seed: int) -> None:
    """Exchanged stops with q -> -q, and the row and the clearances doubled, give the same orbit."""
    system, orbit = with_orbit(seed)
    right, left = system.clearance  # type: ignore[misc]
    oscillator, impacts = system.oscillator, system.impacts
    mirror = dataclasses.replace(
        oscillator,
        contact=-oscillator.contact,
        restitution=oscillator.restitution_of(-1),
        restitution_left=oscillator.restitution_of(1),
    )
    guess = ImpactSequence.create(impacts.period, -impacts.stops, impacts.phases, -impacts.velocities)
    mirrored = periodic_orbit(mirror, system.omega, (left, right), guess)
    np.testing.assert_array_equal(mirrored.impacts.phases, orbit.impacts.phases)
    np.testing.assert_array_equal(mirrored.impacts.velocities, -orbit.impacts.velocities)
    np.testing.assert_array_equal(mirrored.start.displacement, orbit.start.displacement)
    larger = dataclasses.replace(oscillator, contact=2.0 * oscillator.contact)
    doubled = [None if gap is None else 2.0 * gap for gap in (right, left)]
    guess = dataclasses.replace(impacts, velocities=2.0 * impacts.velocities)
    scaled = periodic_orbit(larger, system.omega, (doubled[0], doubled[1]), guess)
    np.testing.assert_allclose(scaled.impacts.phases, orbit.impacts.phases, rtol=0.0, atol=1e-14)
    assert mismatch(scaled.multipliers, orbit.multipliers) < 1e-13


@pytest.mark.parametrize("kind", range(8))
def test_all_orbits_of_one_impact_are_found(kind: int) -> None:
    """The gap at a phase of the impact leads back to that phase, for either stop and any harmonics."""
    random = np.random.default_rng(100 + kind)
    oscillator, omega, stop = random_oscillator(random, kind), float(random.uniform(0.4, 1.6)), 1 - 2 * (kind // 4)
    family = OrbitFamily.of(oscillator, 1 + kind % 2, False).at(omega)
    orbits = OneImpactOrbits([family], stop, 1.0 + oscillator.restitution_of(stop))
    place = stop * contact_equilibrium(oscillator)
    checked = 0
    for phase in np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False).tolist():
        if orbits.speed(phase) <= 0.0:
            continue
        checked += 1
        gap = orbits.gap(phase)
        phases, _ = orbits.phases(gap)
        assert min(abs(math.remainder(impact_phase - phase, 2.0 * math.pi)) for impact_phase in phases) < 1e-9
        clearance = (gap + place, None) if stop > 0 else (None, gap + place)
        orbit = periodic_orbit(oscillator, omega, clearance, orbits.impacts(phase))
        assert orbit.converged
        assert orbit.steps <= 3
        assert orbit.impacts.velocities[0] == pytest.approx(stop * orbits.speed(phase), rel=1e-11)
    assert checked >= 4
    for places, multiplier in ((orbits.saddle_nodes(), 1.0), (orbits.period_doublings(), -1.0)):
        for phase in places.phases.tolist():
            gap = orbits.gap(phase)
            clearance = (gap + place, None) if stop > 0 else (None, gap + place)
            orbit = periodic_orbit(oscillator, omega, clearance, orbits.impacts(phase))
            assert np.min(np.abs(orbit.multipliers - multiplier)) < 1e-6


@pytest.mark.parametrize("seed", [0, 8, 18])
def test_orbits_with_an_impact_on_each_stop_are_found(seed: int) -> None:
    system, orbit = with_orbit(seed)
    assert orbit.label == "1-1r-1l"
    family, stops = at_point(system.oscillator, system.omega, system.clearance, orbit.impacts)
    sequences = two_impact_sequences(family, stops, int(orbit.impacts.stops[0]))
    away = [np.max(np.abs(other.velocities - orbit.impacts.velocities)) for other in sequences]
    assert min(away) < 1e-9
    assert orbit_with(system.oscillator, system.omega, system.clearance, 1, orbit.impacts.stops.tolist()).admissible


def test_a_symmetric_guess_stands_for_the_whole_motion_between_unequal_stops() -> None:
    guess = sequence_of_stops(DEFAULT, 0.27, 1.3, 1, [1, -1])
    assert guess is not None
    assert guess.symmetric
    orbit = periodic_orbit(DEFAULT, 0.27, (1.3, 1.31), guess)
    assert orbit.converged
    assert not orbit.symmetric
    assert len(orbit.impacts.stops) == 2
    same = periodic_orbit(DEFAULT, 0.27, (1.3, 1.3), guess)
    assert same.symmetric
    assert same.impacts.phases.tobytes() == periodic_orbit(DEFAULT, 0.27, 1.3, guess).impacts.phases.tobytes()


def test_a_bias_is_a_change_of_the_clearances() -> None:
    """The orbit between 1.3 and 1.31 is that between equal stops with a bias that moves the equilibrium by 0.005."""
    push = np.array([0.005, 0.0, 0.0]) / np.linalg.inv(DEFAULT.stiffness_matrix)[0, 0]
    biased = dataclasses.replace(DEFAULT, bias=push)
    orbit = orbit_with(DEFAULT, 0.27, (1.3, 1.31), 1, [1, -1])
    other = periodic_orbit(biased, 0.27, 1.305, orbit.impacts)
    np.testing.assert_allclose(other.impacts.phases, orbit.impacts.phases, rtol=0.0, atol=1e-13)
    assert mismatch(other.multipliers, orbit.multipliers) < 1e-12
    moved = other.start.displacement - orbit.start.displacement
    np.testing.assert_allclose(moved, np.linalg.solve(DEFAULT.stiffness_matrix, push), rtol=0.0, atol=1e-13)


def test_a_motion_that_contact_does_not_see_keeps_its_multipliers() -> None:
    """Two equal masses on equal springs, and contact between them: their sum is not seen."""
    structure = Matrices.create(np.eye(2), 2.0 * np.eye(2), 0.1 * np.eye(2))
    oscillator = Oscillator.of_structure(structure, [1.0, -1.0], [force(1, np.array([1.0, 0.0]))], 0.7)
    orbit = orbit_with(oscillator, 1.2, (0.4, None), 1, [1])
    assert orbit.multipliers.shape == (4,)
    assert mismatch(orbit.multipliers, tangent_flow(oscillator, orbit).multipliers) < 1e-10


def test_a_branch_does_not_depend_on_a_motion_that_contact_does_not_see() -> None:
    """Contact between two equal masses is that of one mass of the modal stiffness with the difference of the forces."""
    structure = Matrices.create(np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [[0.2, -0.1], [-0.1, 0.2]])
    pair = Oscillator.of_structure(structure, [1.0, -1.0], [force(1, np.array([1.0, 0.3]))], 0.7)
    alone = Oscillator.of_structure(Matrices.create([[1.0]], [[3.0]], [[0.3]]), [1.0], [force(1, np.array([0.7]))], 0.7)
    of_both = []
    for oscillator in (pair, alone):
        orbit = orbit_with(oscillator, 1.2, (0.35, None), 1, [1])
        of_both.append(orbit_branch(oscillator, orbit, 0.3, 0.45, "clearance_right").special_points)
    assert len(of_both[0]) == len(of_both[1]) > 0
    for point, other in zip(*of_both, strict=True):
        assert (point.type, point.admissible) == (other.type, other.admissible)
        assert point.values.clearance_right == pytest.approx(other.values.clearance_right, rel=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.05])
def test_a_branch_over_the_damping_of_one_link_reaches_zero(start: float) -> None:
    def chain(damping: float) -> Oscillator:
        return Oscillator.create([1.0, 1.0], [1.0, 1.0], [damping, 0.1], [1.0, 0.0], 0.7)

    variants = Variants({"dampings[1]": start}, lambda values: chain(values["dampings[1]"]))
    oscillator = dataclasses.replace(chain(start), variants=variants)
    orbit = orbit_with(oscillator, 0.9, (0.4, None), 1, [1])
    branch = orbit_branch(oscillator, orbit, 0.0, 0.1, "dampings[1]")
    assert branch.values.min() == pytest.approx(0.0, abs=1e-9)
    assert branch.values.max() == pytest.approx(0.1, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "clearance", "stops"),
    [
        ("stops", (None, 1.0), [1]),
        ("stops", (1.0, None), [1, -1]),
        ("clearance", (None, None), [1]),
        ("clearance", (-1.0, 0.5), [1]),
        ("clearance", -1.0, [1]),
    ],
)
def test_stops_that_do_not_exist_are_refused(name: str, clearance: Any, stops: list[int]) -> None:
    impacts = ImpactSequence.create(1, stops, np.arange(len(stops)) + 1.0, np.array(stops, dtype=float))
    with refused(name):
        periodic_orbit(DEFAULT, 0.27, clearance, impacts)
    with refused(name):
        sequence_of_stops(DEFAULT, 0.27, clearance, 1, stops)
