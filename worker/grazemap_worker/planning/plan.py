"""A plan: a grid that is cut into rectangular tiles of about equal time, and the estimate of the cost."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from grazemap.wire import Estimate
from grazemap_worker.planning import rates

Lane = Literal["small", "short", "long"]
# A job of one tile with an estimate below SMALL_SECONDS is small: workers for small tiles compute many at a time.
SMALL_SECONDS = 0.05
# A job that is not small and has an estimate below SHORT_SECONDS is short. Workers that do not serve small jobs spend
# most of their time on short jobs.
SHORT_SECONDS = 30.0
# Factors by which the weights of jobs are multiplied. With short and long jobs of one requester and one priority, a
# worker spends 8/9 of its time on the short jobs and 1/9 on the long ones. Small jobs have workers of their own, so
# they are not weighed against others.
LANE_WEIGHTS: dict[Lane, float] = {"small": 1.0, "short": 8.0, "long": 1.0}


class Tile(NamedTuple):
    """A rectangle of the grid [vertical, horizontal]."""

    row_start: int
    """First row."""
    row_stop: int
    """The row after the last row."""
    column_start: int
    """First column."""
    column_stop: int
    """The column after the last column."""

    @property
    def row_slice(self) -> slice:
        """The rows, along the vertical axis."""
        return slice(self.row_start, self.row_stop)

    @property
    def column_slice(self) -> slice:
        """The columns, along the horizontal axis."""
        return slice(self.column_start, self.column_stop)


class Plan(BaseModel):
    """A grid of `rows` (vertical axis) by `columns` (horizontal), cut into rectangles of `tile_rows` by `tile_columns`.

    The progress of a job counts one step for each tile, and `after` steps for joining the tiles. If `after` is 0, it
    counts tiles only.
    """

    model_config = ConfigDict(frozen=True)

    rows: int = 1
    columns: int = 1
    tile_rows: int = 1
    tile_columns: int = 1
    after: int = 0
    estimate: Estimate = Estimate()

    @property
    def lane(self) -> Lane:
        """The lane in which the tiles wait."""
        if self.tile_count == 1 and self.after == 0 and self.estimate.seconds < SMALL_SECONDS:
            return "small"
        return "short" if self.estimate.seconds < SHORT_SECONDS else "long"

    @property
    def tile_seconds(self) -> float:
        """The processor time that a tile is expected to take."""
        return self.estimate.seconds / self.tile_count

    @property
    def tiles_across(self) -> int:
        """Number of tiles along the horizontal axis."""
        return -(-self.columns // self.tile_columns)

    @property
    def tile_count(self) -> int:
        """Number of tiles."""
        return -(-self.rows // self.tile_rows) * self.tiles_across

    def tile(self, index: int) -> Tile:
        """Return a tile.

        Raises
        ------
        IndexError
            There is no such tile.
        """
        if not 0 <= index < self.tile_count:
            raise IndexError(index)
        row = index // self.tiles_across * self.tile_rows
        column = index % self.tiles_across * self.tile_columns
        return Tile(row, min(row + self.tile_rows, self.rows), column, min(column + self.tile_columns, self.columns))

    def place(self, index: int) -> dict[str, Any]:
        """Return number, row range and column range of a tile, in the form of events, results and lists of tiles."""
        row_start, row_stop, column_start, column_stop = self.tile(index)
        return {"index": index, "rows": [row_start, row_stop], "columns": [column_start, column_stop]}

    @property
    def tiles(self) -> list[Tile]:
        """All tiles, row by row; the index in the list is the number of the tile."""
        return [self.tile(index) for index in range(self.tile_count)]


def pixels_per_tile(seconds: float, max_seconds: float) -> int:
    """Return how many pixels a tile may have, from the expected and the maximum seconds of a pixel; at least 1.

    The expected time of a tile is at most TILE_SECONDS, and its maximum time at most WORST_TILE_SECONDS.
    """
    return max(1, round(min(rates.TILE_SECONDS / seconds, rates.WORST_TILE_SECONDS / max_seconds)))


def with_estimate(plan: Plan, pixel_periods: float, pixel_seconds: float, extra_seconds: float) -> Plan:
    """Return a plan with its estimate.

    The estimate is the forcing periods and the seconds of one pixel times the number of pixels, plus `extra_seconds`
    for the whole job.
    """
    pixels = float(plan.rows * plan.columns)
    seconds = pixels * pixel_seconds + extra_seconds
    estimate = Estimate(periods=pixels * pixel_periods, tiles=plan.tile_count, seconds=seconds)
    return plan.model_copy(update={"estimate": estimate})


def even_pieces(length: int, max_length: int) -> int:
    """Return the length of the pieces, at most `max_length`, into which a length is cut; the last may be shorter."""
    return -(-length // -(-length // max_length))
