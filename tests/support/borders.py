"""Borders of maps, and maps with a changed point."""

from __future__ import annotations

from typing import Any

import numpy as np

from grazemap_core.maps.borders.map_borders import EXPLANATIONS, MapBorders


def count(found: MapBorders, explanation: str, regular: bool = True) -> int:
    """Return how many pairs have an explanation."""
    chosen = (found.explanation == EXPLANATIONS.index(explanation)) & (found.regular == regular)
    return int(np.count_nonzero(chosen))


def planted(arrays: dict[str, Any], place: tuple[int, int], **values: Any) -> dict[str, Any]:
    """Return the arrays of a map with other values at a point."""
    changed = {name: array.copy() for name, array in arrays.items()}
    for name, value in values.items():
        changed[name][place] = value
    return changed
