"""Borders of maps, and maps with a changed point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap_core.maps.borders.map_borders import EXPLANATIONS, MapBorders
from grazemap_core.maps.tolerances import BORDER_REACH
from grazemap_core.simulation.motion import KINDS


def count(borders: MapBorders, explanation: str, regular: bool = True) -> int:
    """Return how many pairs have an explanation."""
    chosen = (borders.explanation == EXPLANATIONS.index(explanation)) & (borders.regular == regular)
    return int(np.count_nonzero(chosen))


def explained_steps(arrays: dict[str, Any], motions: NDArray[Any], borders: MapBorders) -> int:
    """Return how many neighbours are periodic and differ in motions (rows, columns, names), all with an explanation."""
    periodic, steps = arrays["kind"] == KINDS.index("periodic"), 0
    for both, names in ((periodic, motions), (periodic.T, motions.transpose(1, 0, 2))):
        differ = np.any(names[1:] != names[:-1], axis=-1)
        steps += int(np.count_nonzero(both[1:] & both[:-1] & differ))
    assert np.count_nonzero(borders.regular) >= steps
    assert count(borders, "unexplained") == 0
    assert not borders.without_orbit.any()
    assert np.nanmax(borders.distance[borders.curve >= 0]) <= BORDER_REACH
    return steps


def planted(arrays: dict[str, Any], place: tuple[int, int], **values: Any) -> dict[str, Any]:
    """Return the arrays of a map with other values at a point."""
    changed = {name: array.copy() for name, array in arrays.items()}
    for name, value in values.items():
        changed[name][place] = value
    return changed
