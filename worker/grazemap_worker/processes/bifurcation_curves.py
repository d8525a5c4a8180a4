"""The process bifurcation-curves: borders between motions with few impacts, in a window of the plane."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from grazemap.codec import Document
from grazemap.models import BifurcationCurvesRequest, motion_label
from grazemap_worker.processes.core_objects import core_oscillator


def compute(request: BifurcationCurvesRequest, report: Callable[[int, int], object]) -> Document:
    """Return curves, a list of records, each a piece inside the window. Raises CoreError."""
    from grazemap_core.window_curves import window_curves

    pieces = window_curves(
        core_oscillator(request.oscillator),
        (request.omega.start, request.omega.stop),
        (request.clearance.start, request.clearance.stop),
        request.max_multiple,
        request.points,
    )
    curves: list[dict[str, Any]] = [
        {
            "type": piece.type,
            "motion": motion_label(piece.period, piece.impacts_right, piece.impacts_left),
            "period": piece.period,
            "impacts_right": piece.impacts_right,
            "impacts_left": piece.impacts_left,
            "symmetric": piece.symmetric,
            "admissible": piece.admissible,
            "stop": piece.stop,
            "omega": piece.omega,
            "clearance": piece.clearance,
            "impact_velocity": piece.impact_velocity,
            "ends": list(piece.ends),
        }
        for piece in pieces
    ]
    return {"curves": curves}
