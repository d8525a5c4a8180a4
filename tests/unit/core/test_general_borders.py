"""Borders of maps of one stop, and of stops that are not alike: every one explained, by curves of the right motions."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest

from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.maps.borders.map_borders import EXPLANATIONS, MapBorders, map_borders
from grazemap_core.maps.borders.motion_grid import MotionGrid, MotionName
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.plane_grazes import grazing_margins
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import contact_response
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.single_impact.window_curves import window_curves
from grazemap_core.simulation.motion import KINDS
from tests.support.borders import count, explained_steps, planted
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import the_first

MAP_IMPACTS = ("impacts_right", "impacts_left", "least_impact_velocity")
MAP_ARRAYS = ("kind", "period", "symmetric", "sticking", "settled_after", *MAP_IMPACTS)
PERIODIC = KINDS.index("periodic")
SIZE = 24
OMEGA, CLEARANCE = np.linspace(0.275, 0.29, SIZE), np.linspace(1.8, 2.0, SIZE)
UNLIKE = dataclasses.replace(DEFAULT, restitution_left=0.6)
BIASED = dataclasses.replace(DEFAULT, bias=np.array([0.02, 0.0, 0.0]))
Found = tuple[Oscillator, np.ndarray, dict[str, Any], MapBorders]


def pairs(right: float | None, left: float | None) -> np.ndarray:
    """The clearances of the rows, of the right and of the left stop; None: they vary."""
    return np.stack([CLEARANCE if side is None else np.full(SIZE, side) for side in (right, left)], axis=1)


CASES: dict[str, tuple[Oscillator, np.ndarray]] = {
    "right stop alone": (DEFAULT, pairs(None, np.inf)),
    "left stop fixed": (DEFAULT, pairs(None, 1.9)),
    "left stop alone": (DEFAULT, pairs(np.inf, None)),
    "two restitutions": (UNLIKE, CLEARANCE),
    "bias": (BIASED, CLEARANCE),
}


@functools.cache
def borders_of(case: str) -> Found:
    oscillator, clearance = CASES[case]
    arrays = unfolding_map_tile(Plane.of(oscillator, OMEGA, clearance))
    return oscillator, clearance, arrays, map_borders(Plane.of(oscillator, OMEGA, clearance), arrays)


@pytest.mark.parametrize("case", the_first(1, CASES))
def test_every_border_is_explained(case: str) -> None:
    _, _, arrays, borders = borders_of(case)
    codes = np.stack([arrays[name] for name in ("period", "impacts_right", "impacts_left")], axis=-1)
    steps = explained_steps(arrays, codes, borders)
    assert steps > 60
    assert count(borders, "unexplained", regular=False) == 0
    assert count(borders, "curve") > 0.6 * steps
    # the motion that ends on a curve is that of one of the two points
    for k in np.flatnonzero(borders.curve >= 0).tolist():
        name = borders.curves[borders.curve[k]].name
        row, column, along = int(borders.row[k]), int(borders.column[k]), int(borders.along[k])
        ends = [(row, column), (row + 1 - along, column + along)]
        assert any(tuple(codes[end]) == (name.period, name.right, name.left) for end in ends)
        assert not name.symmetric


@pytest.mark.parametrize("case", the_first(1, ["right stop alone", "left stop fixed"]))
def test_curves_of_motions_with_one_impact_are_those_that_are_explicit(case: str) -> None:
    """The search follows the trajectories of the map; neither uses the other."""
    oscillator, clearance, _, borders = borders_of(case)
    left = float(clearance[0, 1])
    varied = VariedStop(1, left if np.isfinite(left) else None)
    window = (0.27, 0.295), (1.7, 2.1)
    known = [
        p for p in window_curves(oscillator, *window, 1, 400, varied) if (p.impacts_right, p.impacts_left) == (1, -1)
    ]
    compared = 0
    for curve in borders.curves:
        orbits = curve.orbits
        if curve.name[:3] != (1, 1, -1) or orbits is None or curve.type == "GR":
            continue
        for omega, place, admissible in zip(curve.horizontal, curve.vertical, curve.admissible, strict=True):
            same = [p for p in known if p.type == curve.type and p.omega[0] <= omega <= p.omega[-1]]
            if same and admissible:
                apart = [abs(np.interp(omega, p.omega, p.value) - place) for p in same]
                assert min(apart) < 1e-6  # of the chords of the explicit curve
                compared += 1
    assert compared > 5


def test_grazing_curves_of_unlike_stops_are_curves_of_their_own() -> None:
    _, _, arrays, borders = borders_of("left stop fixed")
    steady = [curve for curve in borders.curves if curve.orbits is None]
    assert all(curve.name.without_impacts for curve in steady)
    (line,) = [curve for curve in steady if np.ptp(curve.horizontal) == 0.0]  # the left stop is grazed at one frequency
    assert np.ptp(line.vertical) > 0.0
    free = (arrays["impacts_right"] == -1) & (arrays["impacts_left"] == -1)
    assert free[:, line.horizontal[0] > OMEGA].any()
    assert not free[:, line.horizontal[0] < OMEGA].any()


@pytest.mark.parametrize("case", CASES)
def test_the_steady_motion_exists_where_it_stays_between_the_stops(case: str) -> None:
    """Against its displacements, sampled; and at every point at which the map found it."""
    oscillator, clearance = CASES[case]
    exists = np.min(grazing_margins(Plane.of(oscillator, OMEGA, clearance)), axis=0) > 0.0
    turns = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 4000))
    place = contact_equilibrium(oscillator)
    both = np.broadcast_to(clearance.reshape(SIZE, -1), (SIZE, 2))
    for column, response in enumerate(contact_response(oscillator, OMEGA)[:, 0]):
        q = place + (response * turns).imag
        inside = (q.max() < both[:, 0]) & (q.min() > -both[:, 1])
        np.testing.assert_array_equal(exists[:, column], inside)
    assert exists.any()
    assert not exists.all()


def test_mirror_images_have_names_of_their_own_between_unlike_stops() -> None:
    impacts = {"impacts_right": 1, "impacts_left": 2, "symmetric": True}
    for oscillator, clearance, expected in (
        (DEFAULT, CLEARANCE[:4], MotionName(1, 2, 1, True, False)),
        (DEFAULT, np.repeat(CLEARANCE[:4, None], 2, axis=1), MotionName(1, 2, 1, True, False)),
        (UNLIKE, CLEARANCE[:4], MotionName(1, 1, 2, False, False)),
        (DEFAULT, pairs(None, 1.81)[:4], MotionName(1, 1, 2, False, False)),
    ):
        arrays = unfolding_map_tile(Plane.of(oscillator, OMEGA[:3], clearance), MapSettings(max_periods=20))
        changed = planted(arrays, (1, 1), kind=PERIODIC, period=1, sticking=False, **impacts)
        grid = MotionGrid.of(Plane.of(oscillator, OMEGA[:3], clearance), changed)
        assert grid.name_at((1, 1)) == expected


def test_clearances_that_vary_both_and_differ_are_refused() -> None:
    clearance = np.stack([CLEARANCE, CLEARANCE + 0.1], axis=1)
    with refused("clearance"):
        Plane.of(DEFAULT, OMEGA[:2], clearance[:2])


def test_explanations_name_what_they_are() -> None:
    _, _, _, borders = borders_of("right stop alone")
    assert set(np.unique(borders.explanation)) <= set(range(len(EXPLANATIONS)))
    assert {curve.type for curve in borders.curves} >= {"SN", "PD", "GR"}
