"""Refining a grid of labels where neighbours differ, so that the work grows with the length of borders.

The size of a grid, and a function that computes points of it, flow in; out flow a label for every point, and which of
them were computed. What the labels stand for is not known here, but for three sorts of them: a *motion* holds on under
small changes, so between neighbours that have one label others have it too, as a rule; an *irregular* label (chaos)
need not, its region being riddled with others; and UNRESOLVED claims nothing.

A lattice is computed, then halved until it is the grid. A new point between points of one label gets that label, one
among several irregular or unresolved ones is left unresolved, and all others are computed; but so are those between
points of one motion whose trajectories came there by different ways. Then, lattice by lattice, whatever claims another
label than a neighbour is computed too, and its neighbours after it (`close`). Behind the last lattice, the grid itself,
no inferred motion is beside another label, hence:

    A part of the grid that hangs together (by any of the eight neighbours of a point), has one label in truth, and of
    which one point was computed, has no point that claims another motion.

For the first such point on a way there from the computed one would be beside a point that does not claim that motion.
So wrong motions are claimed only where a whole part lies between the points computed, untouched by them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.maps.tolerances import SAME_APPROACH

Places = Integers
Labels = NDArray[np.int32]

UNRESOLVED: Final = 0
UNKNOWN: Final = -1
_AROUND: Final = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))

Compute = Callable[[Places, Places], tuple[Labels, Floats]]
"""From rows and columns (k,) to labels (k,), UNRESOLVED or greater, and logarithms of contractions (k,): NaN where they
are not known."""


class Refinement:
    """A grid of labels that are computed where they must be.

    Attributes
    ----------
    label : int32, (n, m)
        UNKNOWN before `refine`.
    computed : bool, (n, m)
    """

    def __init__(self, label: Labels, computed: Booleans, irregular: Callable[[Labels], Any], compute: Compute):
        """Take a grid, both arrays being changed in place; `irregular` says which labels are."""
        self.label, self.computed = label, computed
        self._irregular, self._compute = irregular, compute
        self._approach = np.empty((0, 0))

    def refine(self, spacing: int) -> None:
        """Compute a lattice, and what lies between as far as it has to be.

        Parameters
        ----------
        spacing : int
            Of the first lattice; a power of 2.
        """
        self._approach = np.full(self.label.shape, np.nan)
        rows, columns = (_lattice(length, spacing) for length in self.label.shape)
        self._at(*(places.ravel() for places in np.meshgrid(rows, columns, indexing="ij")))
        while True:
            self._close(rows, columns)
            if spacing == 1:
                return
            spacing //= 2
            finer = [_lattice(length, spacing) for length in self.label.shape]
            self._halve(rows, columns, *finer)
            rows, columns = finer

    def close(self, rows: Places, columns: Places) -> None:
        """Compute those of some points, all in `label`, that claim another label than a neighbour; and so on there."""
        self._follow(np.arange(self.label.shape[0]), np.arange(self.label.shape[1]), rows, columns)

    def _at(self, rows: Places, columns: Places) -> None:
        """Compute points that have not been."""
        if not rows.size:
            return
        label, approach = self._compute(rows, columns)
        self.label[rows, columns], self.computed[rows, columns] = label, True
        if self._approach.size:
            self._approach[rows, columns] = approach

    def _halve(self, rows: Places, columns: Places, finer_rows: Places, finer_columns: Places) -> None:
        """Infer the points of the next lattice from those of this one around them, or compute them."""
        before, after = _around(rows, finer_rows)
        left, right = _around(columns, finer_columns)
        corners = [(i, j) for i in (before, after) for j in (left, right)]
        coarse = self.label[np.ix_(rows, columns)]
        around = np.stack([coarse[np.ix_(i, j)] for i, j in corners])
        irregular = self._irregular(around)
        same = np.all(around == around[0], axis=0)
        # an irregular label holds on where its neighbours farther off have it too
        lonely = self._next_to_others(coarse) & self._irregular(coarse)
        lonely_around = np.any([lonely[np.ix_(i, j)] for i, j in corners], axis=0)
        inferred = np.where(same & ~lonely_around, around[0], UNKNOWN)
        inferred[np.all(irregular | (around == UNRESOLVED), axis=0) & (inferred == UNKNOWN)] = UNRESOLVED
        ways = self._approach[np.ix_(rows, columns)]
        known = [ways[np.ix_(i, j)] for i, j in corners]
        apart = np.fmax.reduce(known) - np.fmin.reduce(known) > SAME_APPROACH
        inferred[apart & same & ~irregular[0] & (around[0] != UNRESOLVED)] = UNKNOWN
        whole = np.ix_(finer_rows, finer_columns)
        present = self.label[whole]
        self.label[whole] = np.where(present == UNKNOWN, inferred, present)
        found_rows, found_columns = np.nonzero((present == UNKNOWN) & (inferred == UNKNOWN))
        self._at(finer_rows[found_rows], finer_columns[found_columns])

    def _next_to_others(self, lattice: Labels) -> Booleans:
        padded = np.pad(lattice, 1, mode="edge")
        height, width = lattice.shape
        differ = [padded[1 + i : 1 + i + height, 1 + j : 1 + j + width] != lattice for i, j in _AROUND]
        return np.asarray(np.any(differ, axis=0))

    def _close(self, rows: Places, columns: Places) -> None:
        """Do what `close` does on a lattice, beginning with all points of it that are inferred."""
        lattice_rows, lattice_columns = np.nonzero(~self.computed[np.ix_(rows, columns)])
        self._follow(rows, columns, lattice_rows, lattice_columns)

    def _follow(self, rows: Places, columns: Places, i: Places, j: Places) -> None:
        """Compute those of some points of a lattice that are doubtful, look at their neighbours, and so on.

        Places i and j (k,) count in the lattice.
        """
        while i.size:
            doubtful = self._doubtful(rows, columns, i, j)
            i, j = i[doubtful], j[doubtful]
            order = np.lexsort([i, j])  # column by column
            i, j = i[order], j[order]
            self._at(rows[i], columns[j])
            i, j = _neighbours(i, j, (len(rows), len(columns)))
            inferred = ~self.computed[rows[i], columns[j]]
            i, j = i[inferred], j[inferred]

    def _doubtful(self, rows: Places, columns: Places, i: Places, j: Places) -> Booleans:
        """Say which points of a lattice are inferred and claim what a neighbour does not confirm."""
        here = self.label[rows[i], columns[j]]
        irregular = self._irregular(here)
        doubtful = np.zeros(here.shape, dtype=np.bool_)
        for down, across in _AROUND:
            beside_row = rows[np.clip(i + down, 0, len(rows) - 1)]
            beside_column = columns[np.clip(j + across, 0, len(columns) - 1)]
            there = self.label[beside_row, beside_column]
            # chaos beside what has not settled in time is no contradiction
            doubtful |= (there != here) & ~(irregular & (there == UNRESOLVED))
        return np.asarray(doubtful & (here != UNRESOLVED) & ~self.computed[rows[i], columns[j]])


def _lattice(length: int, spacing: int) -> Places:
    """Return every spacing-th place, and the last one."""
    return np.union1d(np.arange(0, length, spacing), [length - 1])


def _around(coarse: Places, fine: Places) -> tuple[Places, Places]:
    """Return where in a lattice the places before and behind those of a finer one are, the same where it has them."""
    return np.searchsorted(coarse, fine, side="right") - 1, np.searchsorted(coarse, fine, side="left")


def _neighbours(i: Places, j: Places, shape: tuple[int, int]) -> tuple[Places, Places]:
    """Return the places around some places, each once."""
    flat = [
        np.clip(i + down, 0, shape[0] - 1) * shape[1] + np.clip(j + across, 0, shape[1] - 1) for down, across in _AROUND
    ]
    found = np.unique(np.concatenate(flat))
    return found // shape[1], found % shape[1]
