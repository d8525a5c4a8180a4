"""Tiles of about the same time: how many pixels one has, and the estimate of all."""

from __future__ import annotations

from grazemap.wire import Estimate
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.rates import TILE_SECONDS, WORST_TILE_SECONDS


def pixels_per_tile(seconds: float, at_worst: float) -> int:
    """Return the pixels of a tile, from the seconds of one: those expected, and those at worst."""
    return max(1, round(min(TILE_SECONDS / seconds, WORST_TILE_SECONDS / at_worst)))


def estimated(shape: Plan, periods: float, seconds: float) -> Plan:
    """Return a plan with its estimate, from the forcing periods and seconds of a pixel."""
    pixels = float(shape.rows * shape.columns)
    estimate = Estimate(periods=pixels * periods, tiles=shape.count, seconds=pixels * seconds)
    return shape.model_copy(update={"estimate": estimate})


def even(length: int, longest: int) -> int:
    """Return the length of equal pieces, none longer than `longest`, that a length is cut into."""
    return -(-length // -(-length // min(length, longest)))
