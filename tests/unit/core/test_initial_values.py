"""Trajectories that only their initial state moves: their unit of length, and 50 digits from awkward states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import ParameterError
from grazemap_core.maps.basins import Coordinate, basin_tile
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.monodromy import linearised_run
from grazemap_core.simulation.start import State, forced_oscillator
from grazemap_core.simulation.trajectories import trajectories, trajectory
from tests.oracles.general_oracle import GeneralOracle
from tests.support.refused import refused
from tests.support.thorough import every_fourth

FREE = Oscillator.create([1.0], [4.0], 0.0, [0.0], 0.5)
PAIR = Matrices.create(np.diag([1.0, 2.0]), np.diag([1.0, 8.0]), np.zeros((2, 2)))
TOUCHING = Oscillator.of_structure(PAIR, [1.0, -1.0], [], 0.5)
"""Two masses that touch each other in equilibrium."""


def state(displacement: Any, velocity: Any) -> State:
    return State(np.array(displacement, dtype=float), np.array(velocity, dtype=float))


def unit(oscillator: Oscillator, clearance: Clearance, *start: Any, omega: float = 4.0) -> float:
    return forced_oscillator(oscillator, omega, clearance).stops_from(state(*start)).unit


def test_the_unit_of_length_is_the_first_length_that_is_not_zero() -> None:
    single = (FREE, (0.0, None))
    assert unit(FREE, (0.0, 3.0), [-0.5], [2.0]) == 1.5
    assert unit(*single, [-0.5], [2.0]) == 0.5
    assert unit(*single, [0.0], [-2.0]) == 0.5
    pair = (TOUCHING, (0.0, None))
    assert unit(*pair, [-3.0, 1.0], [1.0, 0.0]) == 4.0
    assert unit(*pair, [5.0, 5.0], [1.0, 3.0]) == 0.5
    # the contact rests, and the masses move together; an impulse that changes q' by 1 changes that of mass 1 by 2/3
    assert unit(*pair, [5.0, 5.0], [1.0, 1.0]) == pytest.approx(7.5, rel=1e-15)
    assert unit(*pair, [0.0, 0.0], [1.0, 1.0]) == pytest.approx(0.375, rel=1e-15)
    # with a stop elsewhere, or forces, the state does not count
    assert unit(FREE, (-0.25, None), [-0.5], [2.0]) == 0.25
    assert unit(FREE, (0.125, 1.0), [-0.5], [2.0]) == 0.125
    forced = Oscillator.create([1.0], [4.0], 0.0, [3.0], 0.5)
    assert unit(forced, (0.0, None), [-0.5], [2.0]) == 0.25  # 3/(4 - 4^2)


def test_round_off_is_no_length() -> None:
    # the weight puts the mass on its stop, but for a rounding of the equilibrium
    hanging = Oscillator.of_structure(Matrices.create([[0.7]], [[3.0]], [[0.0]]), [1.0], [], 0.5, [-0.3])
    assert 0.0 < forced_oscillator(hanging, 1.0, (None, 0.1)).stops.unit < 1e-15
    assert unit(hanging, (None, 0.1), [0.4], [0.0]) == pytest.approx(0.5, rel=1e-15)
    assert unit(hanging, (None, 0.1), [-0.1], [2.0], omega=1.0) == 2.0
    # displacements and velocities that are equal but for a rounding
    pair, sums = (TOUCHING, (0.0, None)), [0.1 + 0.2, 0.3]
    assert unit(*pair, sums, [1.0, 3.0]) == 0.5
    assert unit(*pair, [-0.0, 0.0], sums) == pytest.approx(0.1125, rel=1e-15)
    # a base that moves both masses alike moves no contact between them
    alike = Matrices.create(np.diag([1.0, 1.0]), np.diag([3.0, 3.0]), np.zeros((2, 2)))
    shaken = Oscillator.of_structure(alike, [0.3, -0.3], [force(1, np.array([0.7, 0.7]))], 0.5)
    assert unit(shaken, (0.0, None), [-2.0, 0.0], [0.0, 0.0]) == pytest.approx(0.6, rel=1e-15)


def test_what_nothing_moves_is_refused() -> None:
    for start in (None, np.zeros(1)):
        with refused("clearance"):
            trajectory(FREE, 1.0, (0.0, None), start)
    with pytest.raises(ParameterError, match="clearance"):
        trajectories(FREE, 1.0, (0.0, None), [state([-1.0], [0.0]), state([0.0], [0.0])])
    # states of a map of basins are in a unit of their own
    side = Coordinate("velocity", 1, np.array([-1.0, -0.5]))
    with pytest.raises(ParameterError, match="clearance"):
        basin_tile(FREE, 1.0, (0.0, None), Coordinate("displacement", 1, np.array([-1.0, -0.5])), side)


def test_each_state_of_a_list_has_its_own_unit() -> None:
    states = [state([-1.0], [0.0]), state([0.0], [-3.0]), state([-1e-3], [2.0])]
    many = trajectories(FREE, 1.3, (0.0, None), states, periods=3)
    for run, start in zip(many, states, strict=True):
        alone = trajectory(FREE, 1.3, (0.0, None), start.displacement, start.velocity, periods=3)
        assert run.record.stops == alone.record.stops
        np.testing.assert_array_equal(run.displacement, alone.displacement)
        np.testing.assert_array_equal(run.impacts.time, alone.impacts.time)
        assert len(run.impacts.time) > 5
    assert linearised_run(FREE, 1.3, (0.0, None), np.array([-0.5]), None, 0.0).stops.unit == 0.5


@pytest.mark.parametrize("scale", [2.0**-40, 2.0**30])
def test_a_motion_in_other_units_of_length_is_the_same(scale: float) -> None:
    damped = Oscillator.of_structure(
        Matrices.create(np.diag([1.0, 2.0]), [[3.0, -1.0], [-1.0, 2.0]], 0.1 * np.eye(2)), [1.0, -1.0], [], 0.3
    )
    for x, v in (([-1.0, 0.5], [0.0, 1.0]), ([0.0, 0.0], [0.5, 1.0]), ([0.25, 0.25], [-1.0, -1.0])):
        runs = [trajectory(damped, 0.7, (0.0, None), a * np.array(x), a * np.array(v), periods=4) for a in (1.0, scale)]
        first, second = (run.impacts for run in runs)
        assert len(first.time) > 3
        np.testing.assert_array_equal(second.time, first.time)
        np.testing.assert_array_equal(second.velocity, scale * first.velocity)
        np.testing.assert_array_equal(runs[1].sticking.start, runs[0].sticking.start)
        np.testing.assert_array_equal(runs[1].displacement, scale * runs[0].displacement)
        assert runs[1].motion == runs[0].motion


def test_a_mass_that_rests_without_any_force_is_not_undecided() -> None:
    inelastic = Oscillator.create([1.0], [1.0], 0.0, [0.0], 0.0)
    run = trajectory(inelastic, 1.0, (0.0, None), np.array([-1.0]), periods=4)
    assert run.sticking.start == pytest.approx([0.5 * math.pi], rel=1e-15)
    assert run.sticking.stop_time == pytest.approx([8.0 * math.pi], rel=1e-15)
    assert run.undecided == 0


def test_a_rest_that_ends_where_it_begins_is_not_listed() -> None:
    # after the inelastic impact no force presses mass 1, and the others pull it off the stop
    chain = Oscillator.create([1.0, 1.0], [1.0, 1.0], 0.0, [0.0, 0.0], 0.0)
    run = trajectory(chain, 1.0, (None, 0.0), np.zeros(2), np.array([-1.0, 0.5]), periods=1)
    assert run.impacts.time[0] == 0.0
    assert np.all(run.sticking.start > 0.0)


@pytest.mark.parametrize("elastic", [0.3, 1.0])
def test_masses_that_move_together_but_for_a_rounding_stay_together(elastic: float) -> None:
    stuck = Oscillator.of_structure(PAIR, [1.0, -1.0], [], elastic)
    run = trajectory(stuck, 1.0, (0.0, None), np.zeros(2), np.array([0.1 + 0.2, 0.3]), periods=1)
    assert len(run.time) == 201
    assert run.sticking.start.tolist() == [0.0]
    assert run.sticking.stop_time == pytest.approx([math.pi / math.sqrt(3.0)], rel=1e-14)
    assert np.all(run.impacts.time > 1.0)


# --- awkward states against 50 digits


def dyadic(values: Any) -> Any:
    """Return numbers without roundings in their sums."""
    return np.round(1024.0 * np.asarray(values)) / 1024.0


def awkward(seed: int) -> tuple[Oscillator, float, Clearance, State]:
    """Return a system without forces that touches a stop in equilibrium, a frequency, its stops and a state.

    One to three masses with or without damping, in units of one or in SI units of any size; the contact is a mass, the
    relative displacement of two, or another row; it starts off its stop or on it, moving away, into it or not at all.
    """
    random = np.random.default_rng(seed)
    size = int(random.integers(2 if seed % 6 == 4 else 1, 4))
    # one mass alone that stops on its stop rests for ever, without a force that could be of a sign
    right, left = (
        float(random.choice(part)) for part in ([0.0, 0.3, 0.8, 1.0][size == 1 :], [0.0, 0.5, 1.0][size == 1 :])
    )
    masses, stiffnesses = random.uniform(0.5, 3.0, (2, size))
    length = 1.0
    if random.random() < 0.4:
        masses, stiffnesses = masses * 10.0 ** random.integers(-3, 4), stiffnesses * 10.0 ** random.integers(0, 7)
        length = 2.0 ** random.integers(-13, 10)
    rate = math.sqrt(stiffnesses[0] / masses[0])
    chain = Oscillator.create(masses, stiffnesses, 0.05 / rate if random.random() < 0.6 else 0.0, np.zeros(size), right)
    structure = chain.structure
    row = np.eye(size)[0]
    kind = random.integers(3)
    if kind > 0 and size > 1:
        ground = np.diag(random.uniform(0.2, 1.0, size)) * stiffnesses[0]
        structure = Matrices.create(chain.mass_matrix, chain.stiffness_matrix + ground, chain.damping_matrix)
        row = np.array([1.0, -2.0, 0.5]) if kind == 2 and size == 3 else np.array([1.0, -1.0, 0.0])[:size]
    oscillator = Oscillator.of_structure(structure, row, [], right, restitution_left=left)
    stops = ((0.0, None), (None, 0.0), (0.0, length), (length, 0.0))[random.integers(4)]
    side = 1.0 if stops[0] == 0.0 else -1.0

    def placed(values: Any, place: float) -> Any:
        values = dyadic(values)
        values[0] = dyadic(place) - row[1:] @ values[1:]
        return values

    away, speed = -side * random.uniform(0.1, 0.9), random.uniform(0.1, 1.0)
    others, rates = random.uniform(-1.0, 1.0, (2, size))
    nothing, pushed = np.zeros(size), np.full(size, 0.25)
    x, v = (
        (placed(nothing, away), nothing),
        (nothing, placed(pushed, -side * speed)),
        (nothing, placed(pushed, side * speed)),
        (placed(others, 0.0), dyadic(rates)),
        (placed(others, 0.0), placed(rates, 0.0)),
        (placed(others, away), dyadic(rates)),
    )[seed % 6]
    omega = rate * float(random.choice([0.3123, 1.0456, 2.06789]))
    return oscillator, omega, stops, State(x * length, v * length * 2.0 ** round(math.log2(rate)))


@pytest.mark.parametrize("seed", every_fourth(range(96)))
def test_awkward_states_move_as_in_50_digits(seed: int) -> None:
    oscillator, omega, stops, start = awkward(seed)
    periods = max(1, int(3.0 * omega / math.sqrt(oscillator.stiffness_matrix[0, 0] / oscillator.mass_matrix[0, 0])))
    run = trajectory(oscillator, omega, stops, start.displacement, start.velocity, periods=periods)
    assert run.undecided == 0
    exact = GeneralOracle.of(
        oscillator, omega, *stops, displacement=start.displacement.tolist(), velocity=start.velocity.tolist()
    )
    exact.run(until=periods * 2.0 * math.pi / omega)
    size = np.max(np.abs(start.velocity)) + omega * np.max(np.abs(start.displacement))
    chatters = np.flatnonzero(run.impacts.kind == "chatter")
    count = int(chatters[0]) + 1 if len(chatters) else len(exact.times)
    if not len(chatters):
        assert len(run.impacts.time) == count
    times, speeds = (np.array([float(value) for value in part[:count]]) for part in (exact.times, exact.speeds))
    np.testing.assert_allclose(omega * run.impacts.time[:count], omega * times, rtol=0, atol=1e-11)
    np.testing.assert_allclose(run.impacts.velocity[:count] / size, speeds / size, rtol=0, atol=1e-11)
    assert len(run.sticking.start) == len(exact.rests)
    for name, times in (("start", exact.rests), ("stop_time", exact.releases)):
        kept = getattr(run.sticking, name)[: len(times)]
        np.testing.assert_allclose(omega * kept, [omega * float(t) for t in times], rtol=0, atol=1e-10)
    assert run.final is not None
    x, v = exact.state().floats()
    np.testing.assert_allclose(omega * run.final.displacement / size, omega * x / size, rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.final.velocity / size, v / size, rtol=0, atol=1e-10)
