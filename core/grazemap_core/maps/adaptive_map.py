"""Adaptive unfolding maps: points are computed where neighbours differ, and inferred between neighbours that agree.

A computed point has the same bytes as in the full map. An inferred point has the label of the points around it, but no
figures, and it is not verified. `refinement` chooses the points and states what is known of the inferred ones.

Points that share tables (`planes`), as those of one omega, are computed side by side, so tiles should be tall.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.errors import ParameterError
from grazemap_core.maps.map_settings import DEFAULT_SETTINGS, MapSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.refinement import (
    SENSITIVE_LABEL,
    UNKNOWN_LABEL,
    UNRESOLVED,
    Indices,
    InferredWrong,
    Labels,
    Refinement,
    check_sample,
)
from grazemap_core.maps.tolerances import (
    COARSEST_SPACING,
    LARGEST_INFERRED_SAMPLE,
    MOST_CONTRACTION,
    RUN_ON_PERIODS,
)
from grazemap_core.maps.unfolding import NAME, named_arrays
from grazemap_core.simulation.motion import KINDS, REASONS

Arrays = dict[str, NDArray[Any]]


LABEL: Final = (NAME[0], "reason", *NAME[1:])
"""Arrays that are defined for inferred points too; all others are defined for computed points only."""

NOT_COMPUTED: Final = 1 + max(REASONS)
"""Reason why an inferred point is unresolved, or not verified."""

NOT_COMPUTED_REASON: Final = "not computed: inferred from the points around it"

_PERIODIC: Final = KINDS.index("periodic")
_UNDEFINED: Final = {"f": np.nan, "i": -1, "b": False}
"""Values of undefined numbers, by the kind of their type."""


def adaptive_map_tile(plane: Plane, settings: MapSettings = DEFAULT_SETTINGS) -> Arrays:
    """Find the motions of a grid as `unfolding.unfolding_map_tile`, but compute points only where motions differ.

    `complete_map` corrects the borders between tiles, and measures how many inferred points are wrong.

    Parameters
    ----------
    plane, settings
        As in `unfolding.unfolding_map_tile`; not those of a sweep, in which every point depends on its neighbour.

    Returns
    -------
    dict of arrays of shape (n, m), [vertical, horizontal]
        The full map's, and computed (bool). Where this is false, the arrays of LABEL are inferred, numbers are NaN or
        -1, `verified` is false and the reason NOT_COMPUTED. An inferred point is unresolved where the points around it
        are sensitive, or are not periodic and do not agree.

    Raises
    ------
    ParameterError
        As in `unfolding.unfolding_map_tile`, or the policy is a sweep.
    """
    shape = plane.shape
    points = _Points(plane, settings)
    grid = Refinement(
        np.full(shape, UNKNOWN_LABEL, dtype=np.int32), np.zeros(shape, np.bool_), points.irregular, points
    )
    grid.refine(COARSEST_SPACING)
    arrays = points.inferred(grid.label) | {"computed": grid.computed}
    _write(arrays, points)
    return arrays


def complete_map(
    plane: Plane,
    arrays: Arrays,
    row_seams: list[int],
    column_seams: list[int],
    settings: MapSettings = DEFAULT_SETTINGS,
) -> tuple[Indices, Indices, Arrays, InferredWrong | None]:
    """Compute inferred points whose labels differ across a border between tiles, and a sample of the others.

    Where a point differs from its inferred label, its inferred neighbours are computed if their labels differ from it,
    and so on. Errors are those of `adaptive_map_tile`.

    Parameters
    ----------
    plane, settings
        As in `adaptive_map_tile`, of the whole map.
    arrays : dict of arrays of shape (n, m)
        The arrays of LABEL, sensitive and computed, assembled from the tiles; changed in place.
    row_seams, column_seams : list of int
        First row, and first column, of every tile but the first.

    Returns
    -------
    rows, columns : (k,)
        The points that were computed.
    figures : dict of arrays of shape (k,)
        All arrays of the full map there.
    inferred_wrong : InferredWrong or None
        The share of wrong inferred points; None if no point is inferred to have a motion, or to be chaotic.
    """
    points = _Points(plane, settings)
    label = np.empty(plane.shape, dtype=np.int32)
    for column in range(plane.shape[1]):
        label[:, column] = points.numbered({name: array[:, column] for name, array in arrays.items()})
    beside = np.zeros(label.shape, dtype=np.bool_)
    for seam in row_seams:
        beside[seam - 1 : seam + 1] = True
    for seam in column_seams:
        beside[:, seam - 1 : seam + 1] = True
    grid = Refinement(label, arrays["computed"], points.irregular, points)
    grid.close(*np.nonzero(beside & ~arrays["computed"]))
    inferred_wrong = check_sample(grid, points.largest_sample)
    _write(arrays, points)
    return *points.results(), inferred_wrong


class _Points:
    """Points of a grid: their computation, the results, and numbers for their labels."""

    def __init__(self, plane: Plane, settings: MapSettings) -> None:
        """Check the arguments and allocate scratch; nothing is computed."""
        plane.check()
        if settings.is_sweep:
            raise ParameterError("policy", "must be rest or ensemble: a sweep computes every point from its neighbour")
        self._settings, self._runner = settings, PlaneRunner(plane, settings.of_runs(plane.oscillator))
        self._mirrors = plane.mirrors
        periods = settings.max_periods * (settings.initial_conditions if settings.is_ensemble else 1)
        self.largest_sample = min(LARGEST_INFERRED_SAMPLE, max(1, RUN_ON_PERIODS // periods))
        self._numbers: dict[tuple[int, ...], int] = {}
        self._labels: list[tuple[int, ...]] = []
        self._done: list[tuple[Indices, Indices, Arrays]] = []
        # the first numbers are UNRESOLVED and SENSITIVE_LABEL
        unknown = (KINDS.index("unresolved"), NOT_COMPUTED, 0, 0, 0, 0, 0)
        self._number((*unknown, False))
        self._labels.append(unknown)

    def __call__(self, rows: Indices, columns: Indices) -> tuple[Labels, Floats]:
        """Compute points (k,). Return the numbers of their labels, and the logarithms of their contractions."""
        order = np.lexsort([rows, columns])
        rows, columns = rows[order], columns[order]
        results = self._runner.points(rows, columns)
        codes, figures = np.moveaxis(results[0], 2, 0)[:, :, None], np.moveaxis(results[1], 2, 0)[:, :, None]
        named = named_arrays(codes, figures, self._settings, self._mirrors)
        arrays = {name: array[:, 0] for name, array in named.items()}
        self._done.append((rows, columns, arrays))
        label, approach = np.empty(len(rows), np.int32), np.empty(len(rows))
        label[order] = self.numbered(arrays)
        approach[order] = self._approach(arrays)
        return label, approach

    def irregular(self, label: Labels) -> Booleans:
        """Return which numbers stand for labels that are neither periodic nor unresolved."""
        odd = np.array([kind != _PERIODIC for kind, *_ in self._labels])
        return np.asarray((label > UNRESOLVED) & odd[np.maximum(label, 0)])

    def numbered(self, arrays: Arrays) -> Labels:
        """Return numbers of the labels in arrays of shape (k,); mirror images in an ensemble have the same number."""
        table = np.stack([arrays[name] for name in (*LABEL, "sensitive")], axis=1).astype(np.int64)
        fresh = np.flatnonzero(np.any(np.diff(table, axis=0, prepend=-9) != 0, axis=1))
        runs = np.array([self._number(tuple(label)) for label in table[fresh].tolist()], dtype=np.int32)
        return np.repeat(runs, np.diff(fresh, append=len(table)))

    def inferred(self, label: Labels) -> Arrays:
        """Return the arrays of a map from labels, as if every point were inferred."""
        table = np.array(self._labels)[label]
        done = self._done[0][2]
        arrays: Arrays = {name: table[..., k].astype(done[name].dtype) for k, name in enumerate(LABEL)}
        arrays["reason"][:] = NOT_COMPUTED
        for name in done.keys() - set(LABEL):
            arrays[name] = np.full(label.shape, _UNDEFINED[done[name].dtype.kind], dtype=done[name].dtype)
        return arrays

    def results(self) -> tuple[Indices, Indices, Arrays]:
        """Return rows, columns and arrays (k,) of the computed points."""
        if not self._done:
            return np.empty(0, np.int64), np.empty(0, np.int64), {}
        rows, columns, arrays = zip(*self._done, strict=True)
        return (
            np.concatenate(rows),
            np.concatenate(columns),
            {name: np.concatenate([part[name] for part in arrays]) for name in arrays[0]},
        )

    def _number(self, label: tuple[int, ...]) -> int:
        kind, _, period, right, left, symmetric, sticking, sensitive = label
        if sensitive:
            return SENSITIVE_LABEL
        if self._settings.is_ensemble and self._mirrors:
            right, left = min(right, left), max(right, left)
        key = (kind, period, right, left, symmetric, sticking)
        if key not in self._numbers:
            self._numbers[key] = len(self._labels)
            self._labels.append(label[: len(LABEL)])
        return self._numbers[key]

    def _approach(self, arrays: Arrays) -> Floats:
        """Return the logarithms of the contractions of the transients to periodic motions, NaN where they are unknown.

        Contractions are unknown in an ensemble, which has many transients per point, and in a preview.
        """
        if self._settings.is_ensemble or self._settings.preview:
            return np.full(len(arrays["kind"]), np.nan)
        rate = np.minimum(-arrays["lyapunov"], MOST_CONTRACTION)
        return np.where(arrays["kind"] == _PERIODIC, arrays["settled_after"] * rate, np.nan)


def _write(arrays: Arrays, points: _Points) -> None:
    """Write the computed points into the arrays of a map, as far as it has them."""
    rows, columns, computed = points.results()
    for name in computed.keys() & arrays.keys():
        arrays[name][rows, columns] = computed[name]
