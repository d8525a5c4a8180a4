"""Basin entropy and uncertainty exponent of labels whose boundary is known: straight, curved, and a Cantor set."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest

from grazemap_core.maps.basin_boundary import basin_entropy, evenly_spaced, uncertainty

LEVELS = 6
SIDE = 3**LEVELS


def cantor() -> np.ndarray:
    """Return labels of SIDE states: the middle thirds that are removed at each level, and what remains."""
    label = np.zeros(SIDE, dtype=np.int16)

    def remove(start: int, size: int, level: int) -> None:
        if size == 1:
            label[start] = level
            return
        third = size // 3
        label[start + third : start + 2 * third] = level
        remove(start, third, level + 1)
        remove(start + 2 * third, third, level + 1)

    remove(0, SIDE, 0)
    return label


def test_the_entropy_of_a_straight_boundary_is_that_of_its_boxes() -> None:
    label = np.zeros((20, 30), dtype=np.int16)
    label[:, 12:] = 1  # two columns of the third column of boxes are on the left
    estimate = basin_entropy(label)
    assert estimate is not None
    of_box = -(0.4 * math.log(0.4) + 0.6 * math.log(0.6))
    assert (estimate.box, estimate.boxes, estimate.boundary_boxes) == (5, 24, 4)
    assert estimate.boundary_entropy == pytest.approx(of_box, rel=1e-14)
    assert estimate.entropy == pytest.approx(of_box / 6, rel=1e-14)
    assert (estimate.standard_error, estimate.fractal) == (0.0, False)


def test_the_entropy_is_that_of_its_definition_and_unresolved_states_do_not_count() -> None:
    numbers = random.Random(1)
    label = np.array([[numbers.choice([-1, 0, 0, 1, 2]) for _ in range(23)] for _ in range(17)], dtype=np.int16)
    label[:5, :5] = -1
    every = []
    for row, column in itertools.product(range(0, 15, 5), range(0, 20, 5)):
        known = [label[row + i, column + j] for i in range(5) for j in range(5) if label[row + i, column + j] >= 0]
        shares = [known.count(attractor) / len(known) for attractor in set(known)]
        every.append(math.fsum(-p * math.log(p) for p in shares))
    estimate = basin_entropy(label)
    assert estimate is not None
    mixed = [entropy for entropy in every if entropy > 0.0]
    assert (estimate.boxes, estimate.boundary_boxes) == (11, len(mixed))
    assert estimate.entropy == pytest.approx(sum(every) / 11, rel=1e-13)
    assert estimate.boundary_entropy == pytest.approx(sum(mixed) / len(mixed), rel=1e-13)
    assert estimate.standard_error == pytest.approx(np.std(mixed, ddof=1) / math.sqrt(len(mixed)), rel=1e-12)


def test_three_mixed_motions_are_above_log_2_and_two_never() -> None:
    numbers = np.random.default_rng(2)
    three, two = (basin_entropy(numbers.integers(0, kinds, (60, 60)).astype(np.int16)) for kinds in (3, 2))
    assert three is not None
    assert two is not None
    assert (three.fractal, two.fractal) == (True, False)
    assert math.log(2.0) < three.boundary_entropy < math.log(3.0)
    assert two.boundary_entropy <= math.log(2.0)
    # three smooth sectors meet in one box
    y, x = np.mgrid[-30:30, -30:30]
    sectors = basin_entropy((np.floor((np.arctan2(y, x) + math.pi) * 3.0 / (2.0 * math.pi)) % 3).astype(np.int16))
    assert sectors is not None
    assert sectors.boundary_entropy < math.log(2.0)
    assert not sectors.fractal


def test_one_motion_has_no_boundary_and_small_or_unresolved_rectangles_no_entropy() -> None:
    alone = basin_entropy(np.zeros((5, 9), dtype=np.int16))
    assert alone is not None
    assert (alone.boxes, alone.boundary_boxes, alone.entropy) == (1, 0, 0.0)
    assert np.isnan(alone.boundary_entropy)
    assert basin_entropy(np.zeros((4, 9), dtype=np.int16)) is None
    assert basin_entropy(np.full((9, 9), -1, dtype=np.int16)) is None


def test_a_straight_boundary_has_the_exponent_1() -> None:
    label = np.zeros((64, 200), dtype=np.int16)
    label[:, 77:] = 1
    estimate = uncertainty(label)
    assert estimate is not None
    assert estimate.distance.tolist() == [1, 2, 4]
    np.testing.assert_allclose(estimate.share, 2 * estimate.distance / 200, rtol=1e-15)
    assert estimate.exponent == pytest.approx(1.0, abs=1e-14)
    assert estimate.boundary_dimension == pytest.approx(1.0, abs=1e-14)
    assert estimate.standard_error < 1e-14
    y, x = np.mgrid[-100:100, -100:100]
    circle = uncertainty((x**2 + y**2 < 70**2).astype(np.int16))
    assert circle is not None
    assert circle.exponent == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("side", "least"), [(64, 0.9), (100, 0.95), (200, 0.96)])
def test_smooth_boundaries_have_an_exponent_of_nearly_1(side: int, least: float) -> None:
    numbers = np.random.default_rng(side)
    y, x = np.mgrid[:side, :side] * (2.0 * math.pi / side)
    for _ in range(10):
        waves = itertools.product(range(3), range(-2, 3))
        level = sum(numbers.normal() * np.cos(a * x + b * y + numbers.uniform(0.0, 7.0)) for a, b in waves)
        estimate = uncertainty((level > 0.0).astype(np.int16))
        assert estimate is not None
        assert least < estimate.exponent < 1.0


def test_a_cantor_set_has_the_shares_of_its_gaps_and_its_dimension() -> None:
    estimate = uncertainty(np.tile(cantor(), (SIDE, 1)))
    assert estimate is not None
    # of a gap of width g the states within k of its ends, and all that is not in a gap
    shares = [
        (2**LEVELS + sum(2 ** (LEVELS - 1 - j) * min(3**j, 2 * k) for j in range(LEVELS))) / SIDE
        for k in estimate.distance.tolist()
    ]
    np.testing.assert_allclose(estimate.share, shares, rtol=1e-14)
    exact = 1.0 - math.log(2.0) / math.log(3.0)
    assert estimate.exponent == pytest.approx(exact, abs=0.04)
    assert estimate.boundary_dimension == pytest.approx(2.0 - exact, abs=0.04)
    assert estimate.exponent == pytest.approx(
        np.polyfit(np.log(estimate.distance), np.log(estimate.share), 1)[0], rel=1e-12
    )
    covariance = np.polyfit(np.log(estimate.distance), np.log(estimate.share), 1, cov=True)[1]
    assert estimate.standard_error == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-10)


def test_unresolved_states_are_no_neighbours_and_are_not_counted() -> None:
    label = np.zeros((64, 70), dtype=np.int16)
    label[:, 20:] = 1
    label[:, 10] = -1
    estimate = uncertainty(label)
    assert estimate is not None
    np.testing.assert_allclose(estimate.share, 2 * estimate.distance / 69, rtol=1e-15)


def test_without_a_boundary_or_in_a_small_rectangle_there_is_no_exponent() -> None:
    alone = uncertainty(np.zeros((64, 64), dtype=np.int16))
    assert alone is not None
    assert alone.share.tolist() == [0.0, 0.0, 0.0]
    assert np.isnan([alone.exponent, alone.standard_error, alone.boundary_dimension]).all()
    assert uncertainty(np.zeros((63, 99), dtype=np.int16)) is None
    assert uncertainty(np.full((64, 64), -1, dtype=np.int16)) is None


def test_values_are_evenly_spaced_but_for_rounding() -> None:
    assert evenly_spaced(np.linspace(-1.9, 1.9, 57))
    assert evenly_spaced([0.1, 0.2, 0.3, 0.4])
    assert not evenly_spaced([0.1, 0.2, 0.31])
