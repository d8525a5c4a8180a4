"""Refining a grid of labels, on planted maps; no kernel runs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from grazemap_core.arrays import Floats
from grazemap_core.maps.refinement import (
    SENSITIVE_LABEL,
    UNKNOWN_LABEL,
    UNRESOLVED,
    Indices,
    Labels,
    Refinement,
    check_sample,
)
from grazemap_core.maps.tolerances import SAME_APPROACH

IRREGULAR, MOTION = 2, 3  # the labels from MOTION on are motions


class Picture:
    """A truth to be found, with a count of what was asked."""

    def __init__(self, truth: NDArray[np.int32], approach: Floats | None = None) -> None:
        self.truth = truth.astype(np.int32)
        self.approach = np.zeros(truth.shape) if approach is None else approach
        self.asked = np.zeros(truth.shape, dtype=int)

    def compute(self, rows: Indices, columns: Indices) -> tuple[Labels, Floats]:
        self.asked[rows, columns] += 1
        return self.truth[rows, columns], self.approach[rows, columns]

    def refined(self, spacing: int = 8) -> Refinement:
        grid = self.blank()
        grid.refine(spacing)
        return grid

    def blank(self) -> Refinement:
        shape = self.truth.shape
        label, computed = np.full(shape, UNKNOWN_LABEL, dtype=np.int32), np.zeros(shape, dtype=np.bool_)
        return Refinement(label, computed, lambda labels: np.isin(labels, [SENSITIVE_LABEL, IRREGULAR]), self.compute)


def blobs(seed: int, shape: tuple[int, int], labels: int, roughness: float) -> NDArray[np.int32]:
    """Regions with crooked borders and islands."""
    rng = np.random.default_rng(seed)
    fields = [ndimage.gaussian_filter(rng.normal(size=shape), roughness) for _ in range(labels)]
    return np.argmax(fields, axis=0).astype(np.int32)


def wrong_motions(grid: Refinement, truth: NDArray[np.int32]) -> NDArray[np.bool_]:
    return np.asarray((grid.label >= MOTION) & (grid.label != truth))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10**6), st.integers(1, 70), st.integers(1, 70), st.integers(2, 6), st.sampled_from([0.5, 1.5, 4.0])
)
def test_no_point_of_a_part_with_a_computed_point_is_inferred_to_have_another_motion(
    seed: int, rows: int, columns: int, labels: int, roughness: float
) -> None:
    picture = Picture(blobs(seed, (rows, columns), labels, roughness))
    grid = picture.refined()
    assert (grid.label != UNKNOWN_LABEL).all()
    assert (picture.asked == grid.computed).all()  # nothing twice
    assert (grid.label == picture.truth)[grid.computed].all()
    wrong = wrong_motions(grid, picture.truth)
    for label in np.unique(picture.truth):
        parts, count = ndimage.label(picture.truth == label, structure=np.ones((3, 3)))
        touched = np.isin(np.arange(count + 1), np.unique(parts[grid.computed]))
        touched[0] = False
        assert not wrong[touched[parts]].any()


def test_a_tongue_is_followed_to_its_tip() -> None:
    truth = np.full((65, 257), MOTION)
    for column in range(257):  # 24 points wide at the left, and then less than a lattice
        width = max(1, 24 - column // 8)
        truth[33 - width // 2 : 33 - width // 2 + width, column] = MOTION + 1
    grid = Picture(truth).refined()
    assert (grid.label == truth).all()
    assert grid.computed.mean() < 0.2


@pytest.mark.parametrize(("side", "least"), [(128, 1.7), (256, 1.7)])
def test_the_work_grows_with_the_border_and_not_with_the_area(side: int, least: float) -> None:
    def work(points: int) -> float:
        at = (np.arange(points) + 0.5) / points - 0.5
        disc = at[:, None] ** 2 + at**2 < 0.35**2
        grid = Picture(MOTION + disc).refined(spacing=points // 16)  # as many points of the first lattice
        assert (grid.label == MOTION + disc).all()
        return float(grid.computed.sum() - 17**2)

    assert least < work(2 * side) / work(side) < 2.3


def test_points_among_irregular_and_unresolved_points_are_left_unresolved() -> None:
    rng = np.random.default_rng(2)
    truth = np.full((81, 81), MOTION)
    truth[8:, :] = rng.choice([UNRESOLVED, IRREGULAR], size=(73, 81))
    grid = Picture(truth).refined()
    inside = ~grid.computed[16:]
    assert inside.mean() > 0.9
    assert (grid.label[16:][inside] == UNRESOLVED).all()
    assert not wrong_motions(grid, truth).any()


def test_no_label_is_inferred_among_sensitive_points() -> None:
    truth = np.full((65, 65), MOTION)
    truth[16:49, 16:49] = SENSITIVE_LABEL
    grid = Picture(truth).refined()
    inside = grid.label[17:48, 17:48][~grid.computed[17:48, 17:48]]
    assert inside.size
    assert (inside == UNRESOLVED).all()
    assert not wrong_motions(grid, truth).any()


def test_a_sample_is_compared_with_its_labels_and_the_grid_is_closed_around_wrong_points() -> None:
    truth = np.full((33, 33), MOTION)
    truth[10:14, 10:15] = MOTION + 1  # an island between the lines of the first lattice
    picture = Picture(truth)
    grid = picture.refined()
    assert wrong_motions(grid, truth).sum() == 20
    rows, columns = np.array([20, 11, 28, 12]), np.array([20, 11, 3, 13])
    assert grid.check(rows, columns) == 2
    assert (grid.label == truth).all()
    assert (picture.asked == grid.computed).all()
    assert not grid.computed[20, 21]


def test_the_interval_contains_the_share_of_wrong_points_in_19_of_20_maps() -> None:
    contained, wrong = 0, 0
    for k in range(60):
        picture = Picture(np.where(blobs(k, (90, 80 + k), 5, 1.6) == 0, MOTION + 1, MOTION))
        grid = picture.refined()
        named = ~grid.computed & (grid.label != UNRESOLVED)
        share = wrong_motions(grid, picture.truth).sum() / named.sum()
        check = check_sample(grid, 10_000)
        assert check is not None
        assert check.inferred == named.sum()
        contained += check.low <= share <= check.high
        wrong += check.wrong
    assert contained >= 55
    assert wrong > 60


def test_an_irregular_label_is_inferred_only_well_inside_its_region() -> None:
    truth = np.full((65, 65), MOTION)
    truth[:, 24:] = IRREGULAR
    grid = Picture(truth).refined()
    inferred = ~grid.computed & (grid.label == IRREGULAR)
    assert inferred[:, 40:].any()
    assert not inferred[:, 24:26].any()


def test_points_between_different_transients_to_one_motion_are_computed() -> None:
    truth = np.full((17, 17), MOTION)
    truth[3:6, 3:6] = MOTION + 1  # an island between the lines of the first lattice
    same, apart = np.zeros((17, 17)), np.zeros((17, 17))
    apart[:, 8:] = 1.01 * SAME_APPROACH
    unseen, seen = Picture(truth, same).refined(), Picture(truth, apart).refined()
    assert (unseen.label == MOTION).all()
    assert unseen.computed.sum() == 9
    assert (seen.label == truth).all()


def test_contradictions_are_followed_from_the_point_where_they_arise() -> None:
    truth = np.full((20, 60), MOTION)
    truth[10, :] = MOTION + 1
    picture = Picture(truth)
    grid = picture.blank()
    grid.label[:], grid.label[10, 30:], grid.computed[10, 30:] = MOTION, MOTION + 1, True
    nowhere = np.empty(0, dtype=np.int64)
    grid.close(nowhere, nowhere)
    assert not picture.asked.any()
    grid.close(np.arange(20), np.full(20, 29))
    assert (grid.label == truth).all()
    assert picture.asked.sum() < 5 * 60
