"""The process unfolding-maps: the motion that every point of a grid settles to, in tiles of the grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.models import UnfoldingMapsRequest, grid_values
from grazemap_worker.processes.core_objects import core_oscillator
from grazemap_worker.store import Plan, Tile

_AXES = ("omega", "clearance")
_NAMES = ("kinds", "reasons")


def compute_tile(request: UnfoldingMapsRequest, tile: Tile) -> Document:
    """Return a rectangle of the map: its omega and clearance, and the arrays [clearance, omega] of the core.

    The values of the grid are those of the whole one, so any cut gives the same bytes (a sweep's tiles are as tall as
    the map). Raises CoreError.
    """
    from grazemap_core.motion import KINDS, REASONS
    from grazemap_core.unfolding import unfolding_map_tile

    row_start, row_stop, column_start, column_stop = tile
    omega = grid_values(request.omega)[column_start:column_stop]
    clearance = grid_values(request.clearance)[row_start:row_stop]
    arrays = unfolding_map_tile(
        core_oscillator(request.oscillator),
        omega,
        clearance,
        request.max_periods,
        request.max_period,
        request.policy,
        request.initial_conditions,
        request.seed,
    )
    reasons = [REASONS.get(code, "") for code in range(1 + max(REASONS))]
    return {
        "omega": omega,
        "clearance": clearance,
        **arrays,
        "kinds": np.array(KINDS),
        "reasons": np.array(reasons),
    }


def assemble(request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document]) -> Document:
    """Return the whole map from the documents of its tiles, in the plan's order."""
    whole: dict[str, NDArray[Any]] = {}
    for rectangle, document in zip(plan.tiles, tiles, strict=True):
        row_start, row_stop, column_start, column_stop = rectangle
        for name, part in document.items():
            if name in _AXES or name in _NAMES:
                continue
            if name not in whole:
                whole[name] = np.empty((plan.rows, plan.columns), dtype=part.dtype)
            whole[name][row_start:row_stop, column_start:column_stop] = part
    return {
        "omega": grid_values(request.omega),
        "clearance": grid_values(request.clearance),
        **whole,
        **{name: tiles[0][name] for name in _NAMES},
    }
