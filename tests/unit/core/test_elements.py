"""Sums of elements of any kind against the matrices of which they are."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.arrays import Floats
from grazemap_core.model.kernels.elements import Elements, invariance_residual
from grazemap_core.model.kernels.steady_response import steady_amplitudes
from grazemap_core.model.matrices import elements_of

SIZE, COUNT = 4, 12


def random_elements(random: np.random.Generator) -> Elements:
    """Return elements between any coordinates, grounded or not; each force may act on others than those it follows."""
    ends = np.array([sorted(random.choice(SIZE + 1, 2, replace=False)) for _ in range(2 * COUNT)]).reshape(2, COUNT, 2)
    ends[:, :SIZE] = [[i, SIZE] for i in range(SIZE)]  # no coordinate is free of forces
    numbers = random.uniform(0.1, 1.0, (3, COUNT)) * (random.random((3, COUNT)) < 0.7)
    numbers[:, :SIZE] = random.uniform(2.0, 3.0, (3, SIZE))
    return Elements(ends[0], ends[1], *numbers, reach=SIZE - 1, elongations=False)


def matrix(elements: Elements, numbers: Floats) -> Floats:
    """Return the matrix that elements have with these numbers."""
    grounded = np.vstack([np.eye(SIZE), np.zeros(SIZE)])
    stretch, action = (grounded[i] - grounded[j] for i, j in (elements.stretched_by.T, elements.acts_on.T))
    return np.asarray(action.T @ (numbers[:, None] * stretch))


@pytest.mark.parametrize("seed", range(5))
def test_elements_are_what_their_matrices_are(seed: int) -> None:
    random = np.random.default_rng(seed)
    elements = random_elements(random)
    mass, damping, stiffness = (matrix(elements, x) for x in (elements.mass, elements.damping, elements.stiffness))
    dense = elements_of(mass, damping, stiffness)
    forces, row = random.normal(size=(3, SIZE)) + 1j, random.normal(size=SIZE)
    omega = np.array([0.0, 0.3, 2.0])
    ours, coordinate, exists = steady_amplitudes(elements, omega, forces, row)
    assert np.all(exists)
    assert ours == pytest.approx(steady_amplitudes(dense, omega, forces, row)[0], rel=1e-12)
    for w, x, q, f in zip(omega, ours, coordinate, forces, strict=True):
        assert x == pytest.approx(np.linalg.solve(stiffness - w * w * mass + 1j * w * damping, f), rel=1e-11)
        assert q == pytest.approx(row @ x, rel=1e-12)

    columns, (square, decay) = random.normal(size=(2 * SIZE, 2 * SIZE)), random.uniform(0.1, 1.0, (2, SIZE))
    blocks = np.zeros_like(columns)
    for j in range(SIZE):
        blocks[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [[0.0, 1.0], [-square[j], -2.0 * decay[j]]]
    momentum = -stiffness @ columns[:SIZE] - damping @ columns[SIZE:] - mass @ (columns @ blocks)[SIZE:]
    residual = np.empty_like(columns)
    invariance_residual(elements, columns, square, decay, np.empty((SIZE, 2)), residual)
    assert residual == pytest.approx(np.vstack([columns[SIZE:] - (columns @ blocks)[:SIZE], momentum]), abs=1e-13)
