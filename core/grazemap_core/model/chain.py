"""A chain of masses and links, with its first mass free or linked to a wall.

An oscillator has two chains: the whole one, whose first mass is free, and that of masses 2 .. N while mass 1 rests on a
stop, whose first mass is linked to a wall.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from grazemap_core.arrays import Floats, Integers
from grazemap_core.model.kernels.elements import Elements
from grazemap_core.model.structure import Structure
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class Chain(Structure):
    """n masses in a row; link i joins mass i to mass i + 1, or the last mass to ground."""

    masses: Floats
    """(n,) Masses."""
    stiffnesses: Floats
    """(n,) Stiffnesses of the links."""
    link_damping: Floats
    """(n,) Damping coefficients of the links."""
    gamma: float | None
    """The coefficient of proportional damping, ``C = 2 gamma K``; None when the links were given one by one."""
    wall_stiffness: float = 0.0
    """Stiffness of the link from a wall to the first mass; 0 if the first mass is free."""
    wall_damping: float = 0.0
    """Damping coefficient of this link; 0 likewise."""

    @property
    def size(self) -> int:
        """Number of masses n."""
        return len(self.masses)

    @cached_property
    def mass_matrix(self) -> Floats:
        """M, shape (n, n), diagonal."""
        return np.diag(self.masses)

    @cached_property
    def stiffness_matrix(self) -> Floats:
        """K, shape (n, n), symmetric, tridiagonal and positive definite."""
        return matrix_of_links(self.stiffnesses, self.wall_stiffness)

    @cached_property
    def damping_matrix(self) -> Floats:
        """C, shape (n, n), built from the links as K is."""
        return matrix_of_links(self.link_damping, self.wall_damping)

    @cached_property
    def elements(self) -> Elements:
        """The link to the wall, the links between the masses and to ground, and the masses."""
        count, none = self.size, np.zeros(self.size)
        first = 0 if self.wall_stiffness > 0.0 else 1
        ends = _ends_of_elements(count)[first:]
        return Elements(
            stretched_by=ends,
            acts_on=ends,
            mass=np.concatenate(([0.0], none, self.masses))[first:],
            damping=np.concatenate(([self.wall_damping], self.link_damping, none))[first:],
            stiffness=np.concatenate(([self.wall_stiffness], self.stiffnesses, none))[first:],
            reach=min(1, count - 1),
            elongations=True,
        )

    def mass_norms(self, vectors: Floats) -> Floats:
        """Return ``sqrt(x^T M x)`` of every column of vectors (n, m), shape (m,)."""
        return np.sqrt(self.masses @ vectors**2)

    def row_of_coordinates(self, row: Floats) -> Floats | None:
        """Return a row on displacements whose numbers have the sum 0 as one on elongations; None for any other."""
        sums = np.cumsum(row)
        return sums if sums[-1] == 0.0 else None

    def solve_mass(self, vectors: Floats) -> Floats:
        """Return ``M^-1 vectors``, shape (n,) or (n, m)."""
        return np.asarray((vectors.T / self.masses).T)

    def effective_mass(self, row: Floats) -> float:
        """Return ``1/(h^T M^-1 h)``, as `Structure.effective_mass`; the mass itself where h names one."""
        (named,) = np.nonzero(row)
        if len(named) == 1:
            return float(self.masses[named[0]] / row[named[0]] ** 2)
        return super().effective_mass(row)

    def ground_forces(self, influence: Floats) -> tuple[Floats, Floats]:
        """Return ``K r`` and ``C r``, as `Structure.ground_forces`; only the last link is moved by r = (1, ..., 1)."""
        stretched = elongations(influence)
        return _on_masses(self.stiffnesses * stretched), _on_masses(self.link_damping * stretched)

    def undamped(self) -> Chain:
        """Return the chain without damping."""
        return replace(self, link_damping=np.zeros(self.size), wall_damping=0.0)

    def bidiagonal(self) -> Floats:
        """Return B with ``B^T B = M^-1/2 K M^-1/2``, rows by link; shape (n, n), or (n + 1, n) with a wall.

        Every entry is the square root of a quotient of two parameters.
        """
        upper = np.diag(np.sqrt(self.stiffnesses / self.masses))
        upper -= np.diag(np.sqrt(self.stiffnesses[:-1] / self.masses[1:]), 1)
        if self.wall_stiffness == 0.0:
            return upper
        wall = np.zeros((1, self.size))
        wall[0, 0] = -np.sqrt(self.wall_stiffness / self.masses[0])
        return np.concatenate((wall, upper))

    def square_root(self) -> Floats:
        """Return an upper bidiagonal U of shape (n, n) with ``U^T U = M^-1/2 K M^-1/2``.

        With a wall it is obtained from `bidiagonal` by Givens rotations without subtractions: every entry keeps its
        relative accuracy, and so do the singular values.
        """
        if self.wall_stiffness == 0.0:
            return self.bidiagonal()
        tall = self.bidiagonal()
        square = np.zeros((self.size, self.size))
        above = tall[0, 0]
        for j in range(self.size):
            below = tall[j + 1, j]
            square[j, j] = np.hypot(above, below)
            if j + 1 < self.size:
                square[j, j + 1] = below / square[j, j] * tall[j + 1, j + 1]
                above = above / square[j, j] * tall[j + 1, j + 1]
        return square

    def energy_matrix(self) -> Floats:
        """Return A of ``z' = A z``, where z holds ``U M^1/2 x`` and ``M^1/2 v``; shape (2n, 2n).

        U is `square_root`. Without a wall the first half is ``sqrt(k_i) (x_i - x_{i+1})``.
        """
        root, links = self.square_root(), self.bidiagonal()
        ratios = self.link_damping / self.stiffnesses
        if self.wall_stiffness > 0.0:
            ratios = np.concatenate(([self.wall_damping / self.wall_stiffness], ratios))
        return np.block([[np.zeros_like(root), root], [-root.T, -links.T @ (ratios[:, None] * links)]])

    def from_energy(self) -> Floats:
        """Return the matrix that takes z to elongations ``x_i - x_{i+1}`` and velocities; shape (2n, 2n)."""
        count = self.size
        matrix = np.zeros((2 * count, 2 * count))
        matrix[count:, count:] = np.diag(1.0 / np.sqrt(self.masses))
        if self.wall_stiffness == 0.0:
            matrix[:count, :count] = np.diag(1.0 / np.sqrt(self.stiffnesses))
        else:
            displacement = solve_triangular(self.square_root(), np.eye(count)) / np.sqrt(self.masses)[:, None]
            matrix[:count, :count] = elongations(displacement)
        return matrix

    def weighted(self, columns: Floats) -> Floats:
        """Return elongations and velocities (2n, m), times the square roots of stiffness and mass."""
        return self._weights[:, None] * columns

    def unweighted(self, columns: Floats) -> Floats:
        """Return the inverse of `weighted`."""
        return columns / self._weights[:, None]

    def displacements(self, columns: Floats) -> Floats:
        """Return displacements (n, m): each is the sum of the elongations of its own link and of all that follow."""
        return np.cumsum(columns[self.size - 1 :: -1], axis=0)[::-1]

    def rows_of_states(self, rows: Floats) -> Floats:
        """Return rows (m, 2n) that act on weighted coordinates as rows that act on displacements and velocities."""
        count = self.size
        of_elongations = rows * self._weights
        of_states = of_elongations.copy()
        of_states[:, 1:count] -= of_elongations[:, : count - 1]  # elongation i is x_i - x_{i+1}
        return of_states

    @property
    def _weights(self) -> Floats:
        return np.sqrt(np.concatenate((self.stiffnesses, self.masses)))


def elongations(displacement: Floats) -> Floats:
    """Return ``x_i - x_{i+1}`` of every column of displacements, the last mass against ground; shape as given."""
    elongation = displacement.copy()
    elongation[:-1] -= displacement[1:]
    return elongation


@lru_cache(maxsize=64)
def _ends_of_elements(count: int) -> Integers:
    """Return what `Chain.elements` act on, also with a wall: the coordinates of their ends, `count` for the ground."""
    each = np.arange(count)
    links, masses = np.column_stack((each, each + 1)), np.column_stack((each, np.full(count, count)))
    return np.concatenate(([[0, count]], links, masses))


def _on_masses(forces: Floats) -> Floats:
    """Return the forces on the masses by forces in the links, (n,) each."""
    return forces - np.concatenate(([0.0], forces[:-1]))


def matrix_of_links(links: NDArray[Any], wall: Any = 0) -> NDArray[Any]:
    """Return the tridiagonal matrix (n, n) of a chain whose last link goes to ground.

    Exact numbers in an array of objects give the exact matrix.
    """
    diagonal = links + np.concatenate(([wall], links[:-1]))
    return np.diag(diagonal) - np.diag(links[:-1], 1) - np.diag(links[:-1], -1)
