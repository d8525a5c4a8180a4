"""The time for the grazing curve and its codimension-two points, compared with that of a plain solve."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import grazing_curve
from tests.support.oscillators import DEFAULT


def least_seconds(*works: Callable[[], object], rounds: int = 5) -> list[float]:
    """Return the minimum processor time of each of several works done in turn, after a round that does not count."""
    seconds = [[] for _ in works]
    for _ in range(rounds + 1):
        for taken, work in zip(seconds, works, strict=True):
            began = time.process_time()
            work()
            taken.append(time.process_time() - began)
    return [min(taken[1:]) for taken in seconds]


def test_a_curve_costs_little_more_than_solving_for_its_amplitudes() -> None:
    omega = np.linspace(0.05, 2.5, 100_000)

    def plain() -> object:
        squared = omega[:, None, None] ** 2
        matrix = DEFAULT.stiffness_matrix - squared * DEFAULT.mass_matrix
        matrix = matrix + 1j * omega[:, None, None] * DEFAULT.damping_matrix
        return np.linalg.solve(matrix, np.broadcast_to(DEFAULT.forcing[:, None], (len(omega), 3, 1)))

    curve, solve = least_seconds(lambda: grazing_curve(DEFAULT, omega), plain)
    print(f"grazing curve of 100,000 points: {curve:.3f} s; a plain solve for its amplitudes alone: {solve:.3f} s")
    # 1.4 times, refinement in double-double and eight returns included; about 0.05 s
    assert curve < 4.0 * solve


def test_all_codimension_two_points_take_well_under_half_a_second() -> None:
    points = codimension_two_points(DEFAULT, 0.05, 2.5, max_order=8, max_multiple=4)
    (seconds,) = least_seconds(lambda: codimension_two_points(DEFAULT, 0.05, 2.5, max_order=8, max_multiple=4))
    print(f"{len(points)} codimension-two points: {seconds:.4f} s")
    # about 0.01 s: the margin is for the machine, not for the code
    assert seconds < 0.5
