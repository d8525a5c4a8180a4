"""Orbits found from their stops alone: closed forms, settled trajectories, mirror images, and what is not found."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.orbits.search import sequence_of_stops
from tests.support.orbits import orbit_with
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused


@pytest.mark.parametrize(
    ("omega", "clearance", "period", "stops", "label"),
    [
        (0.27, 1.85, 1, [1], "1-1r-(-1)l"),
        (0.27, 1.85, 1, [-1], "1-(-1)r-1l"),
        (0.28, 1.7, 1, [1, -1], "1-1r-1l"),
        (0.28, 1.7, 1, [-1, 1], "1-1r-1l"),
        (0.29, 1.6, 1, [1, 1, -1, -1], "1-2r-2l"),
        (0.29, 1.6, 1, [1, -1, -1, 1], "1-2r-2l"),
        (0.29, 1.9927, 3, [1, -1], "3-1r-1l"),
    ],
)
def test_an_orbit_is_found_from_its_stops(omega, clearance, period, stops, label):
    orbit = orbit_with(DEFAULT, omega, clearance, period, stops)
    assert orbit.impacts.whole.stops.tolist() == stops
    assert orbit.isolated
    assert orbit.admissible
    assert orbit.label == label
    assert np.all(orbit.impacts.whole.stops == stops)


def test_stops_without_a_motion_are_reported_as_without_one():
    assert sequence_of_stops(DEFAULT, 0.29, 1.6, 1, [1, 1, 1]) is None
    # above the saddle-node there is no motion with an impact
    assert sequence_of_stops(DEFAULT, 0.27, 1.9, 1, [1]) is None


@pytest.mark.parametrize(("period", "stops", "name"), [(0, [1], "period"), (1, [], "stops"), (1, [2], "stops")])
def test_an_invalid_sequence_of_stops_is_refused(period, stops, name):
    with refused(name):
        sequence_of_stops(DEFAULT, 0.29, 1.6, period, stops)
