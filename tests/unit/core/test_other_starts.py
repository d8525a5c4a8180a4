"""Other starts: their motions are those of the impact equations, each once, and none where one motion lives."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.maps.basin_fractions import fraction_tile, random_states, ranges_of
from grazemap_core.maps.basins import attractors
from grazemap_core.maps.other_starts import other_motions, other_motions_of_map
from grazemap_core.maps.planes import Plane, Point
from grazemap_core.maps.tolerances import MAP_POINTS_A_SAMPLE
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused

HAMMER = Oscillator.create([1.0], [1.0], 0.04, [1.0], 0.8)
# beyond the resonance the hammer hits its stop once a period from rest, and stays clear of it in the steady motion
OMEGA, STOP = 1.5, (1.1, None)


def steady_state() -> tuple[np.ndarray, np.ndarray]:
    """Return the state of the hammer's steady motion at the phase 0, in closed form: c = 2 gamma k."""
    amplitude = 1.0 / (1.0 - OMEGA**2 + 0.08j * OMEGA)
    return np.array([amplitude.imag]), np.array([OMEGA * amplitude.real])


def test_another_motion_is_an_orbit_of_the_impact_equations_and_its_start_leads_there():
    displacement, velocity = steady_state()
    outcome = other_motions(HAMMER, OMEGA, STOP, 64, displacement=displacement, velocity=velocity)
    assert (outcome.motion.impacts_right, outcome.motion.verified, outcome.starts) == (-1, True, 64)
    (other,) = outcome.motions
    guess = sequence_of_stops(HAMMER, OMEGA, STOP, 1, [1])
    assert guess is not None
    orbit = periodic_orbit(HAMMER, OMEGA, STOP, guess)
    assert orbit.verified
    assert (other.motion.period, other.motion.impacts_right, other.motion.impacts_left) == (1, 1, -1)
    assert other.least_impact_velocity == pytest.approx(abs(orbit.impacts.velocities[0]), rel=1e-9)
    assert other.multiplier == pytest.approx(abs(orbit.multipliers[0]), rel=1e-6)
    assert 0 < other.starts < outcome.settled <= 64
    start = other.start
    run = trajectory(HAMMER, OMEGA, STOP, start.displacement, start.velocity, start.phase, 2, 500)
    np.testing.assert_allclose(run.impacts.velocity, orbit.impacts.velocities[0], rtol=1e-9)


def test_from_rest_it_is_the_steady_motion_that_is_another():
    outcome = other_motions(HAMMER, OMEGA, STOP, 64)
    assert outcome.motion.impacts_right == 1
    assert [(other.motion.impacts_right, other.motion.verified) for other in outcome.motions] == [(-1, True)]
    assert np.isnan(outcome.motions[0].least_impact_velocity)


# of one name and its own mirror image's, and of two
@pytest.mark.parametrize(("omega", "clearance"), [(0.27263157894736845, 1.3368421052631578), (0.26, 1.595)])
def test_a_motion_and_its_mirror_image_are_one(omega, clearance):
    point = Point(DEFAULT, omega, clearance)
    states = random_states([point], ranges_of([point], None, None), 64, 0)
    twins = attractors({name: array[0] for name, array in fraction_tile([point], states).items()})[1]
    assert [(twin.verified, twin.symmetric) for twin in twins] == [(True, False)] * 2
    assert other_motions(DEFAULT, omega, clearance, 64).motions == []


def test_without_a_known_motion_nothing_is_compared():
    outcome = other_motions(HAMMER, OMEGA, STOP, 8, max_periods=2)
    assert (outcome.motion.kind, outcome.starts, outcome.motions) == ("unresolved", 0, [])
    with refused("starts"):
        other_motions(HAMMER, OMEGA, STOP, 0)


def test_a_map_counts_points_at_which_single_trajectories_have_other_motions():
    plane = Plane.of(
        HAMMER, np.linspace(1.45, 1.55, 80), np.stack([np.linspace(1.05, 1.2, 60), np.full(60, np.inf)], 1)
    )
    outcome = other_motions_of_map(plane, 32, seed=1)
    assert outcome is not None
    assert outcome.points == 4800 // MAP_POINTS_A_SAMPLE
    for seen in outcome.seen:
        at_point = other_motions(*plane.at_point(seen.row, seen.column), 32, seed=1)
        assert seen.other.starts in [other.starts for other in at_point.motions]
        assert seen.given.impacts_right != seen.other.motion.impacts_right
    assert outcome.points_with_others > 0
    assert sum(seen.points for seen in outcome.seen) >= outcome.points_with_others
    small = Plane.of(HAMMER, np.linspace(1.3, 1.6, 40), np.linspace(0.9, 1.2, 49))
    assert other_motions_of_map(small, 32) is None
