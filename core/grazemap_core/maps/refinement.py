"""Refinement of a grid of labels where neighbours differ: the work grows with the length of the borders.

Labels are numbers. There are four sorts. A *motion* persists under small changes, so points between neighbours with
one label have it too, as a rule. An *irregular* label (chaos) need not persist, because its region contains points of
many others. SENSITIVE_LABEL is irregular, and never inferred. UNRESOLVED asserts nothing.

A lattice of points is computed, then halved until it is the grid. A new point between points of one label gets that
label; a new point among several irregular or unresolved ones is left unresolved; all others are computed, and so are
those between points of one motion that have different transients. Then, on each lattice, every inferred point whose
label differs from a neighbour's is computed too, and so on for its neighbours (`close`). After the last lattice, the
grid itself, no inferred motion is next to another label. Hence:

    Take a part of the grid that is connected (by the eight neighbours of a point), has one true label, and has a
    computed point. Then no motion with another label is inferred at any point of the part.

Otherwise the first such point on a path from the computed one would be next to a point without that motion. Wrong
motions are inferred only for whole connected parts that lie between the computed points. How many inferred points are
wrong is measured on a random sample of them (`check_sample`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.maps.samples import interval
from grazemap_core.maps.tolerances import INFERRED_SAMPLE, SAME_APPROACH
from grazemap_core.records import dataclass

Indices = Integers
Labels = NDArray[np.int32]

UNRESOLVED: Final = 0
SENSITIVE_LABEL: Final = 1
UNKNOWN_LABEL: Final = -1
_AROUND: Final = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))

Compute = Callable[[Indices, Indices], tuple[Labels, Floats]]
"""Function from rows and columns (k,) to labels (k,), UNRESOLVED or greater, and logarithms of the contractions of
transients (k,), NaN where they are not known."""


class Refinement:
    """A grid of labels, computed or inferred.

    Attributes
    ----------
    label : int32, (n, m)
        UNKNOWN_LABEL before `refine`.
    computed : bool, (n, m)
    """

    def __init__(self, label: Labels, computed: Booleans, irregular: Callable[[Labels], Any], compute: Compute):
        """Take a grid, whose arrays are changed in place; `irregular` returns which labels are, SENSITIVE_LABEL too."""
        self.label, self.computed = label, computed
        self._irregular, self._compute = irregular, compute
        self._approach = np.empty((0, 0))

    def refine(self, spacing: int) -> None:
        """Compute a lattice, and the points between its points as far as necessary.

        Parameters
        ----------
        spacing : int
            Spacing of the first lattice, a power of 2.
        """
        self._approach = np.full(self.label.shape, np.nan)
        rows, columns = (_lattice(length, spacing) for length in self.label.shape)
        self._at(*(places.ravel() for places in np.meshgrid(rows, columns, indexing="ij")))
        while True:
            self._follow(rows, columns, *np.nonzero(~self.computed[np.ix_(rows, columns)]))
            if spacing == 1:
                return
            spacing //= 2
            finer = [_lattice(length, spacing) for length in self.label.shape]
            self._halve(rows, columns, *finer)
            rows, columns = finer

    def close(self, rows: Indices, columns: Indices) -> None:
        """Compute those of the given points whose label differs from a neighbour's, and so on for their neighbours."""
        self._follow(np.arange(self.label.shape[0]), np.arange(self.label.shape[1]), rows, columns)

    def check(self, rows: Indices, columns: Indices) -> int:
        """Compute inferred points of a closed grid, and close it around wrong ones. Return the number of wrong ones."""
        inferred = self.label[rows, columns]
        self._at(rows, columns)
        wrong = self.label[rows, columns] != inferred
        self.close(*_neighbours(rows[wrong], columns[wrong], (self.label.shape[0], self.label.shape[1])))
        return int(np.count_nonzero(wrong))

    def _at(self, rows: Indices, columns: Indices) -> None:
        """Compute points."""
        if not rows.size:
            return
        label, approach = self._compute(rows, columns)
        self.label[rows, columns], self.computed[rows, columns] = label, True
        if self._approach.size:
            self._approach[rows, columns] = approach

    def _halve(self, rows: Indices, columns: Indices, finer_rows: Indices, finer_columns: Indices) -> None:
        """Infer the points of the next lattice from the points of this one around them, or compute them."""
        before, after = _around(rows, finer_rows)
        left, right = _around(columns, finer_columns)
        corners = [(i, j) for i in (before, after) for j in (left, right)]
        coarse = self.label[np.ix_(rows, columns)]
        around = np.stack([coarse[np.ix_(i, j)] for i, j in corners])
        irregular = self._irregular(around)
        same = np.all(around == around[0], axis=0)
        # an irregular label persists only where all its neighbours have it too
        isolated = self._differs_from_neighbour(coarse) & self._irregular(coarse)
        isolated_around = np.any([isolated[np.ix_(i, j)] for i, j in corners], axis=0)
        inferred = np.where(same & ~isolated_around & (around[0] != SENSITIVE_LABEL), around[0], UNKNOWN_LABEL)
        inferred[np.all(irregular | (around == UNRESOLVED), axis=0) & (inferred == UNKNOWN_LABEL)] = UNRESOLVED
        transients = self._approach[np.ix_(rows, columns)]
        known = [transients[np.ix_(i, j)] for i, j in corners]
        apart = np.fmax.reduce(known) - np.fmin.reduce(known) > SAME_APPROACH
        inferred[apart & same & ~irregular[0] & (around[0] != UNRESOLVED)] = UNKNOWN_LABEL
        whole = np.ix_(finer_rows, finer_columns)
        present = self.label[whole]
        self.label[whole] = np.where(present == UNKNOWN_LABEL, inferred, present)
        i, j = np.nonzero((present == UNKNOWN_LABEL) & (inferred == UNKNOWN_LABEL))
        self._at(finer_rows[i], finer_columns[j])

    def _differs_from_neighbour(self, lattice: Labels) -> Booleans:
        """Return which points of a lattice have a neighbour with another label."""
        padded = np.pad(lattice, 1, mode="edge")
        height, width = lattice.shape
        differ = [padded[1 + i : 1 + i + height, 1 + j : 1 + j + width] != lattice for i, j in _AROUND]
        return np.asarray(np.any(differ, axis=0))

    def _follow(self, rows: Indices, columns: Indices, i: Indices, j: Indices) -> None:
        """Compute the contradicted points among those given of a lattice, then among their neighbours, and so on.

        i and j (k,) are indices in the lattice.
        """
        while i.size:
            contradicted = self._contradicted(rows, columns, i, j)
            i, j = i[contradicted], j[contradicted]
            order = np.lexsort([i, j])  # column by column
            i, j = i[order], j[order]
            self._at(rows[i], columns[j])
            i, j = _neighbours(i, j, (len(rows), len(columns)))
            inferred = ~self.computed[rows[i], columns[j]]
            i, j = i[inferred], j[inferred]

    def _contradicted(self, rows: Indices, columns: Indices, i: Indices, j: Indices) -> Booleans:
        """Return which points of a lattice are inferred with a label that differs from a neighbour's."""
        here = self.label[rows[i], columns[j]]
        irregular = self._irregular(here)
        contradicted = np.zeros(here.shape, dtype=np.bool_)
        for down, across in _AROUND:
            beside_row = rows[np.clip(i + down, 0, len(rows) - 1)]
            beside_column = columns[np.clip(j + across, 0, len(columns) - 1)]
            there = self.label[beside_row, beside_column]
            # an irregular label next to an unresolved one is no contradiction
            contradicted |= (there != here) & ~(irregular & (there == UNRESOLVED))
        return np.asarray(contradicted & (here != UNRESOLVED) & ~self.computed[rows[i], columns[j]])


@dataclass(frozen=True)
class InferredWrong:
    """How many of the inferred points of an adaptive map are wrong, from a random sample of them that was computed.

    A point is wrong if it was inferred to have a motion, or to be chaotic, and the full map has another motion there,
    or is unresolved or sensitive. The share is that before the sample was computed. Afterwards its points are computed
    ones, and so are points next to a wrong one that were inferred to have another label than it.
    """

    inferred: int
    """Number of points that were inferred to have a motion, or to be chaotic, before the sample was computed."""
    sampled: int
    """Number of points in the sample."""
    wrong: int
    """Number of wrong points in the sample."""
    low: float
    """Lower end of the interval of the share of wrong ones (`samples.interval`)."""
    high: float
    """Upper end of this interval."""


def check_sample(grid: Refinement, most: int) -> InferredWrong | None:
    """Compute a random sample of the inferred points, and return how many of them were wrong; None without any."""
    named = np.flatnonzero(~grid.computed & (grid.label != UNRESOLVED))
    sampled = min(len(named), most, math.ceil(INFERRED_SAMPLE * np.count_nonzero(grid.computed)))
    if not sampled:
        return None
    # the same sample whenever the map is assembled
    chosen = np.random.default_rng(grid.label.shape).choice(named, sampled, replace=False)
    rows, columns = np.unravel_index(chosen, grid.label.shape)
    wrong = grid.check(rows, columns)
    low, high = interval(wrong, sampled)
    return InferredWrong(len(named), sampled, wrong, low, high)


def _lattice(length: int, spacing: int) -> Indices:
    """Return every index that is a multiple of the spacing, and the last one."""
    return np.union1d(np.arange(0, length, spacing), [length - 1])


def _around(coarse: Indices, fine: Indices) -> tuple[Indices, Indices]:
    """Return the positions in a lattice before and after each index of a finer one; equal where the lattice has it."""
    return np.searchsorted(coarse, fine, side="right") - 1, np.searchsorted(coarse, fine, side="left")


def _neighbours(i: Indices, j: Indices, shape: tuple[int, int]) -> tuple[Indices, Indices]:
    """Return the neighbours of some points, each once."""
    flat = [
        np.clip(i + down, 0, shape[0] - 1) * shape[1] + np.clip(j + across, 0, shape[1] - 1) for down, across in _AROUND
    ]
    flat_indices = np.unique(np.concatenate(flat))
    return flat_indices // shape[1], flat_indices % shape[1]
