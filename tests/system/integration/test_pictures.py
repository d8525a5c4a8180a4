"""Pictures of results that a stack has computed: the gallery, their colours, and their curves between the points."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import pyplot

from examples import pictures
from examples.pictures import ALIKE, ALIKE_IF_COLOUR_BLIND, colours_of, least_distances
from grazemap import Oscillator
from grazemap.local_client import LocalClient
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.model.oscillator import Oscillator as CoreOscillator
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from tests.support.random_chains import random_oscillator


def test_the_gallery_has_the_code_and_the_picture_of_every_function() -> None:
    assert pictures.GALLERY.read_text("utf-8") == pictures.page()  # else: make pictures
    names = {make.__name__ for section in pictures.SECTIONS.values() for make in section}
    assert {path.stem for path in pictures.PICTURES.iterdir()} == names
    for path in pictures.PICTURES.iterdir():
        assert path.stat().st_size <= pictures.LARGEST


def test_the_code_of_the_gallery_runs_as_it_is_pasted(stack: LocalClient) -> None:
    figure = pictures.drawn(pictures.entry(pictures.rotor_that_goes_on_hitting), stack)
    image = pictures.saved(figure)
    regions, lines = colours_of(figure.axes[0])
    pyplot.close(figure)
    assert image.startswith(b"\x89PNG")
    assert len(regions | lines) > 1


@pytest.mark.thorough
def test_colours_of_the_maps_of_twenty_random_systems_can_be_distinguished(stack: LocalClient) -> None:
    random = np.random.default_rng(20)
    least_normal, least_blind, most = np.inf, np.inf, 0
    for _ in range(20):
        core = random_oscillator(random, 3, per_link=False)
        chain = Oscillator(
            masses=core.masses.tolist(),
            stiffnesses=core.stiffnesses.tolist(),
            damping=core.gamma,
            forcing=core.forcing.tolist(),
            restitution=core.restitution,
        )
        omega = float(chain.natural_frequencies[0]) * float(random.uniform(0.5, 1.5))
        curve = stack.grazing_curve(chain, omega=(0.9 * omega, 1.1 * omega), points=50, progress=False)
        clearance = float(curve.at(omega))
        window = {"omega": (0.9 * omega, 1.1 * omega), "clearance": (0.3 * clearance, 1.1 * clearance)}
        umap = stack.unfolding_map(chain, **window, shape=(32, 32), preview=True, max_periods=200, progress=False)
        ax = umap.plot(curve=curve)
        regions, lines = colours_of(ax)
        squares = [line.get_color() for line in ax.lines if line.get_marker() == "s" and line.get_markersize() == 8]
        assert len(squares) == len(set(squares))
        normal, blind = least_distances(regions, lines)
        least_normal, least_blind = min(least_normal, normal), min(least_blind, blind)
        most = max(most, len(regions | lines))
        pyplot.close(ax.figure)
    assert most > 20  # the systems have crowded pictures among them
    assert least_normal >= ALIKE
    assert least_blind >= ALIKE_IF_COLOUR_BLIND


def test_a_branch_is_drawn_where_its_orbits_are_and_ends_at_the_graze(stack: LocalClient) -> None:
    motion = (1, [1, 1, -1, -1])
    branch = stack.orbit_branch(omega=0.29, clearance=1.6, motion=motion, range=(1.3, 1.9), progress=False)
    ax = branch.plot()
    drawn = {line.get_label(): np.column_stack(line.get_data()) for line in ax.lines}
    pyplot.close(ax.figure)

    chain = CoreOscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
    guess = sequence_of_stops(chain, 0.29, 1.6, *motion)
    assert guess is not None
    fine = orbit_branch(chain, periodic_orbit(chain, 0.29, 1.6, guess), 1.3, 1.9, longest_step=0.004, max_points=20000)
    assert len(fine.values) > 8 * len(branch.parameter)
    shown = ["stable", "unstable", "not admissible"]
    every = np.concatenate([drawn[name] for name in shown])
    extent = np.ptp(every[np.isfinite(every[:, 0])], axis=0)
    exact = np.column_stack([fine.values, fine.velocities[:, 0] * fine.stops[0]]) / extent
    for name in shown:
        line = drawn[name][np.isfinite(drawn[name][:, 0])] / extent
        assert max(_distance(point, exact) for point in line) < 1e-3  # less than a pixel

    (graze, other) = [point for point in branch.special_points if point.type == "GR"]
    ends = [drawn[name][np.isfinite(drawn[name][:, 0]), 0] for name in ("stable", "unstable")]
    for point in (graze, other):
        assert any(point.parameter in (end.min(), end.max()) or point.parameter in end for end in ends)


def _distance(point: np.ndarray, polyline: np.ndarray) -> float:
    """Return how far a point is from a polyline."""
    here, side = polyline[:-1] - point, np.diff(polyline, axis=0)
    length = np.einsum("ij,ij->i", side, side)
    share = np.clip(-np.einsum("ij,ij->i", here, side) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    return float(np.min(np.linalg.norm(here + share[:, None] * side, axis=1)))
