"""A plan: a grid cut into rectangular tiles that take about the same time, with its estimate."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from grazemap.wire import Estimate
from grazemap_worker.planning import rates

Lane = Literal["small", "short", "long"]
# Estimated seconds up to which a job of one tile is small, which workers of its own compute many at a time, and up to
# which a job is short, which gets most of the time of the other workers.
SMALL_SECONDS = 0.05
SHORT_SECONDS = 30.0
LANE_WEIGHTS: dict[Lane, float] = {"small": 1.0, "short": 8.0, "long": 1.0}


class Tile(NamedTuple):
    """A rectangle of the grid [clearance, omega], stops excluded."""

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
        """Its clearances."""
        return slice(self.row_start, self.row_stop)

    @property
    def columns(self) -> slice:
        """Its omegas."""
        return slice(self.column_start, self.column_stop)


class Plan(BaseModel):
    """A grid of `rows` (clearance) by `columns` (omega), cut into rectangles of `tile_rows` by `tile_columns`.

    `after` is the number of steps in a job's progress for joining the tiles, in addition to 1 for each tile; 0: only
    tiles are counted.
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
        """The lane in which its tiles wait."""
        if self.count == 1 and self.after == 0 and self.estimate.seconds < SMALL_SECONDS:
            return "small"
        return "short" if self.estimate.seconds < SHORT_SECONDS else "long"

    @property
    def seconds_of_tile(self) -> float:
        """The processor time that a tile is expected to take."""
        return self.estimate.seconds / self.count

    @property
    def across(self) -> int:
        """Number of tiles along omega."""
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
        """Return the number of a tile, its rows and its columns, as in events, results and lists of tiles."""
        row_start, row_stop, column_start, column_stop = self.tile(index)
        return {"index": index, "rows": [row_start, row_stop], "columns": [column_start, column_stop]}

    @property
    def tiles(self) -> list[Tile]:
        """All tiles, row by row; the position in the list is the tile's number."""
        return [self.tile(index) for index in range(self.count)]


def pixels_per_tile(seconds: float, at_worst: float) -> int:
    """Return the number of pixels of a tile, from the expected and the maximum seconds of a pixel."""
    return max(1, round(min(rates.TILE_SECONDS / seconds, rates.WORST_TILE_SECONDS / at_worst)))


def estimated(shape: Plan, periods: float, seconds: float, more_seconds: float) -> Plan:
    """Return a plan with its estimate, from the forcing periods and seconds of a pixel and the seconds of all else."""
    pixels = float(shape.rows * shape.columns)
    estimate = Estimate(periods=pixels * periods, tiles=shape.count, seconds=pixels * seconds + more_seconds)
    return shape.model_copy(update={"estimate": estimate})


def even(length: int, longest: int) -> int:
    """Return the length of the equal pieces, at most `longest`, into which a length is cut."""
    return -(-length // -(-length // min(length, longest)))
