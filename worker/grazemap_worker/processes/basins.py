"""The process basins: the motion that every initial state of a rectangle leads to, in tiles of the rectangle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.wire import BasinCoordinate, BasinsRequest, grid_values, motion_label
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes.conversion import Report, core_oscillator, record
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap_core.maps.basins import Coordinate


def compute_tile(request: BasinsRequest, tile: Tile) -> Document:
    """Return the arrays [vertical, horizontal] of the core for a part of the rectangle. Raises CoreError."""
    from grazemap_core.maps.basins import basin_tile

    row_start, row_stop, column_start, column_stop = tile
    initial = request.initial
    return basin_tile(
        core_oscillator(request.oscillator),
        request.omega,
        request.clearance,
        _coordinate(request.horizontal, column_start, column_stop),
        _coordinate(request.vertical, row_start, row_stop),
        None if initial.displacement is None else np.array(initial.displacement),
        None if initial.velocity is None else np.array(initial.velocity),
        initial.phase,
        request.max_periods,
        request.max_period,
    )


def assemble(request: BasinsRequest, plan: Plan, tiles: list[Document], report: Report | None = None) -> Document:
    """Return the attractors, and the label of every state, from the documents of the tiles in the plan's order."""
    from grazemap_core.maps.basins import attractors
    from grazemap_core.simulation.motion import REASONS

    whole: dict[str, NDArray[Any]] = {}
    for (row_start, row_stop, column_start, column_stop), document in zip(plan.tiles, tiles, strict=True):
        for name, part in document.items():
            if name not in whole:
                whole[name] = np.empty((plan.rows, plan.columns), dtype=part.dtype)
            whole[name][row_start:row_stop, column_start:column_stop] = part
    label, found = attractors(whole)
    return {
        "horizontal": grid_values(request.horizontal.values),
        "vertical": grid_values(request.vertical.values),
        "label": label,
        "attractors": [_named(record(attractor)) for attractor in found],
        "settled_after": whole["settled_after"],
        "lyapunov": whole["lyapunov"],
        "reason": whole["reason"],
        "reasons": np.array([REASONS.get(code, "") for code in range(1 + max(REASONS))]),
    }


def _coordinate(coordinate: BasinCoordinate, start: int, stop: int) -> Coordinate:
    from grazemap_core.maps.basins import Coordinate

    return Coordinate(coordinate.quantity, coordinate.mass, grid_values(coordinate.values)[start:stop])


def _named(attractor: dict[str, Any]) -> dict[str, Any]:
    """Return an attractor's record with the label of its motion, None for figures that are not known."""
    counts: list[Any] = [attractor.get(name) for name in ("period", "impacts_right", "impacts_left")]
    unknown = {name: None for name in ("multiplier", "lyapunov") if np.isnan(attractor[name])}
    return attractor | unknown | {"label": motion_label(*counts) if None not in counts else None}


PROCESS = Process(tile=compute_tile, assembled=assemble)
