"""A plan: a grid that is cut into rectangular tiles of about equal time, and the estimate of the cost."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from grazemap.wire import Estimate
from grazemap_worker.planning import rates

Lane = Literal["small", "short", "long"]
# A job of one tile with an estimate below SMALL_SECONDS is small: workers for small tiles compute many at a time.
SMALL_SECONDS = 0.05
# Another job with an estimate below SHORT_SECONDS is short. Short jobs get most of the time of the other workers.
SHORT_SECONDS = 30.0
# Shares of the lanes.
LANE_WEIGHTS: dict[Lane, float] = {"small": 1.0, "short": 8.0, "long": 1.0}


class Tile(NamedTuple):
    """A rectangle of the grid [vertical, horizontal]."""

    row_start: int
    """First row."""
    row_stop: int
    """The row after the last one."""
    column_start: int
    """First column."""
    column_stop: int
    """The column after the last one."""

    @property
    def rows(self) -> slice:
        """The rows, along the vertical axis."""
        return slice(self.row_start, self.row_stop)

    @property
    def columns(self) -> slice:
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
        if self.count == 1 and self.after == 0 and self.estimate.seconds < SMALL_SECONDS:
            return "small"
        return "short" if self.estimate.seconds < SHORT_SECONDS else "long"

    @property
    def tile_seconds(self) -> float:
        """The processor time that a tile is expected to take."""
        return self.estimate.seconds / self.count

    @property
    def across(self) -> int:
        """Number of tiles along the horizontal axis."""
        return -(-self.columns // self.tile_columns)

    @property
    def count(self) -> int:
        """Number of tiles."""
        return -(-self.rows // self.tile_rows) * self.across

    def tile(self, index: int) -> Tile:
        """Return a tile.

        Raises
        ------
        IndexError
            There is no such tile.
        """
        if not 0 <= index < self.count:
            raise IndexError(index)
        row = index // self.across * self.tile_rows
        column = index % self.across * self.tile_columns
        return Tile(row, min(row + self.tile_rows, self.rows), column, min(column + self.tile_columns, self.columns))

    def place(self, index: int) -> dict[str, Any]:
        """Return number, rows and columns of a tile, as they stand in events, results and lists of tiles."""
        row_start, row_stop, column_start, column_stop = self.tile(index)
        return {"index": index, "rows": [row_start, row_stop], "columns": [column_start, column_stop]}

    @property
    def tiles(self) -> list[Tile]:
        """All tiles, row by row; the index in the list is the number of the tile."""
        return [self.tile(index) for index in range(self.count)]


def pixels_per_tile(seconds: float, max_seconds: float) -> int:
    """Return the number of pixels of a tile, from the expected and the maximum seconds of a pixel."""
    return max(1, round(min(rates.TILE_SECONDS / seconds, rates.WORST_TILE_SECONDS / max_seconds)))


def with_estimate(shape: Plan, periods: float, seconds: float, more_seconds: float) -> Plan:
    """Return a plan with its estimate, from the forcing periods and seconds of a pixel, and further seconds."""
    pixels = float(shape.rows * shape.columns)
    estimate = Estimate(periods=pixels * periods, tiles=shape.count, seconds=pixels * seconds + more_seconds)
    return shape.model_copy(update={"estimate": estimate})


def even_pieces(length: int, max_length: int) -> int:
    """Return the length of the pieces, at most `max_length`, into which a length is cut; the last may be shorter."""
    return -(-length // -(-length // max_length))
