"""A chain of masses and links, with its first mass free or linked to a wall.

An oscillator has two chains: the whole one, whose first mass is free, and that of masses 2 .. N while mass 1 rests on a
stop, whose first mass is linked to a wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Floats


@dataclass(frozen=True, eq=False)
class Chain:
    """n masses in a row; link i joins mass i to mass i + 1, or the last mass to ground.

    Attributes
    ----------
    masses, stiffnesses, link_damping : ndarray of shape (n,)
    gamma : float or None
        The coefficient of proportional damping, ``C = 2 gamma K``; None when the links were given one by one.
    wall_stiffness, wall_damping : float
        Coefficients of the link from a wall to the first mass; both 0 if the first mass is free.
    """

    masses: Floats
    stiffnesses: Floats
    link_damping: Floats
    gamma: float | None
    wall_stiffness: float = 0.0
    wall_damping: float = 0.0

    @property
    def size(self) -> int:
        """Number of masses n."""
        return len(self.masses)

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
