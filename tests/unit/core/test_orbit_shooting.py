"""Shooting from impact to impact solves the same equations as the sums over all impacts."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from grazemap_core.arrays import Floats
from grazemap_core.contact.stops import stops_between
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN, block_sum
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, assemble
from grazemap_core.orbits.kernels.shooting import Shooting, norm_of_inverse, shoot, shooting, solve_step
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import random_oscillator
from tests.support.thorough import KERNELS_FIRST

PLACES = 7
pytestmark = KERNELS_FIRST


@functools.cache
def orbits() -> list[tuple[Oscillator, PeriodicOrbit]]:
    """Of the default system 1, 2, 4, 8 and 16 impacts, symmetric or not; of random chains of three masses."""
    places = [(DEFAULT, 0.27, clearance) for clearance in (1.85, 1.55, 1.642, 1.626, 1.4)]
    rng = np.random.default_rng(2)
    while len(places) < 9:
        chain = random_oscillator(rng, 3, len(places) % 2 == 0)
        omega = float(rng.uniform(0.3, 1.5))
        places.append((chain, omega, float(rng.uniform(0.4, 0.95) * grazing_curve(chain, [omega]).clearance[0])))
    pairs = []
    for chain, omega, clearance in places:
        run = trajectory(chain, omega, clearance, periods=32, transient_periods=1500, samples_per_period=1)
        if run.motion.kind == "periodic" and not run.motion.sticking and len(run.impacts.time):
            pairs.append((chain, periodic_orbit(chain, omega, clearance, impacts_of(run))))
    return pairs


def problem_of(chain: Oscillator, orbit: PeriodicOrbit) -> tuple[OrbitProblem, Shooting]:
    impacts = orbit.impacts
    family = OrbitFamily.of(chain, impacts.period, impacts.symmetric).at(orbit.omega)
    problem = family.problem(max(family.steady_size, orbit.clearance))
    room = shooting(len(impacts.stops), chain.size)
    kind = ALTERNATING if impacts.symmetric else SAME_SIGN
    for j in range(chain.size):
        room.closing[j] = block_sum(
            kind, problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], 0.0, family.span
        )[:2]
    return problem, room


def dense(problem: OrbitProblem, impacts: OrbitImpacts) -> tuple[Floats, Floats, Floats]:
    count = len(impacts.phases)
    residual, jacobian, before = np.zeros(2 * count), np.zeros((2 * count, 2 * count + 1)), np.zeros((count, 3))
    assemble(problem, impacts, residual, jacobian, before)
    return residual, jacobian[:, : 2 * count], before


def test_there_are_orbits_of_many_kinds() -> None:
    sizes = {len(orbit.impacts.stops) for _, orbit in orbits()}
    assert len(orbits()) >= PLACES
    assert len(sizes) >= 4
    assert max(sizes) >= 8
    assert {orbit.impacts.symmetric for _, orbit in orbits()} == {True, False}


@pytest.mark.parametrize("place", range(PLACES))
def test_shooting_agrees_with_the_direct_sums(place: int) -> None:
    """Residuals, Newton step and norm of the inverse at a point off the orbit; multipliers on it."""
    chain, orbit = orbits()[place]
    impacts, stops = orbit.impacts, stops_between(chain, orbit.clearance, 0.0)
    sides = impacts.stops.astype(float)
    problem, room = problem_of(chain, orbit)
    count = len(impacts.stops)
    rng = np.random.default_rng(place)
    speeds = impacts.velocities / (problem.omega * problem.length) * (1.0 + 1e-3 * rng.normal(size=count))
    phases = impacts.phases + 1e-3 * rng.normal(size=count)
    near = OrbitImpacts(stops, sides, phases, speeds)
    residual, jacobian, before = dense(problem, near)
    largest, terms = shoot(problem, near, room)
    # both are sums of terms that cancel
    assert np.abs(room.residual.T.ravel() - residual).max() <= 1e-14 * terms
    assert largest == np.abs(room.residual).max()
    assert np.abs(room.before - before).max() <= 1e-13 * terms
    norm = solve_step(problem, near, room)
    step = np.linalg.solve(jacobian, -residual)
    assert norm == pytest.approx(np.abs(step).max(), rel=1e-9)
    np.testing.assert_allclose(room.step.T.ravel(), step, rtol=0.0, atol=1e-9 * np.abs(step).max())
    inverse = np.abs(np.linalg.inv(jacobian)).sum(axis=1).max()
    assert norm_of_inverse(problem, near, room) == pytest.approx(inverse, rel=1e-9)

    exact = OrbitImpacts(stops, sides, impacts.phases, impacts.velocities / (problem.omega * problem.length))
    shoot(problem, exact, room)
    assert solve_step(problem, exact, room) < 1e-11
    told = np.sort(np.abs(np.linalg.eigvals(room.turned[:, :-1])))[::-1]
    expected = orbit.half_multipliers if impacts.symmetric else orbit.multipliers
    np.testing.assert_allclose(told[:2], np.sort(np.abs(expected))[::-1][:2], rtol=1e-8)


def test_a_singular_matrix_has_no_step() -> None:
    """Of an impact of velocity 0 the walk divides by it."""
    chain, orbit = orbits()[0]
    problem, room = problem_of(chain, orbit)
    stops, sides = stops_between(chain, orbit.clearance, 0.0), orbit.impacts.stops.astype(float)
    impacts = OrbitImpacts(stops, sides, orbit.impacts.phases, np.zeros(len(sides)))
    shoot(problem, impacts, room)
    room.before[:, 1] = 0.0
    assert solve_step(problem, impacts, room) == np.inf
