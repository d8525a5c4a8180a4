"""Models and tables of lanes: those that all lanes share, or every lane's own.

Where every lane has its own tables, those of a trajectory are copied into its lane when it starts (`begin_separate`),
and from there into batches of lanes in a cell (`put_in_pass`, `put_in_changes`). Shared tables are not copied.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grazemap_core.arrays import Floats, Integers, aligned
from grazemap_core.maps.kernels.lane_tables import (
    BLOCK_NUMBERS,
    FLOW_DEGREE,
    LANES,
    SCALAR_COUNT,
    TERMS,
    LaneModel,
    LaneTables,
)
from grazemap_core.numerics.jit.compiled import inlined, kernel
from grazemap_core.numerics.jit.lane_values import put_lane_value, record_of, store, table_of
from grazemap_core.records import NamedTuple

OF_GROUP, OF_FIRST_PASS, OF_SECOND_PASS, OF_CHANGES = 0, 1, 2, 3
"""Tables of the lanes of a group, of a batch in the first and in the second pass over a cell, and in a batch of
`tangent_batches`."""


class LaneModels(NamedTuple):
    """The model that all trajectories share, or that each of them has for itself (`lane_values.record_of`)."""

    shared: LaneModel
    """The model of all, or of one of them; all have the same number of cells in a period."""
    addresses: Integers
    """(LANES,) Where the model of every lane is in memory; 0 where it is shared."""
    of_trajectories: Integers
    """(n,) Where the model of every trajectory is in memory; (0,) where it is shared."""


class TablesPerLane(NamedTuple):
    """Tables of lanes that have their own, or none where they are shared."""

    number: int
    """Their number."""
    tables: tuple[LaneTables, ...]
    """OF_GROUP to OF_CHANGES."""


SHARED_TABLES = TablesPerLane(0, ())


def separate_tables(size: int, pitch: int, cells: int) -> LaneTables:
    """Return empty tables of lanes that have their own, for so many blocks and cells; `forcing` is that of one cell."""
    places = {
        "flow": 4 * size,
        "output_row": 4 * size,
        "steady_table": 2 * (cells + 1),
        "bound": 3 * size,
        "series": 2 * size * TERMS,
        "forcing": TERMS,
        "unit_impulse": 2 * size * TERMS,
        "response": TERMS,
        "change_series": 2 * size * FLOW_DEGREE,
        "block": BLOCK_NUMBERS * size,
        "displacement_scale": 2 * size,
        "scalars": SCALAR_COUNT,
    }
    empty = {name: aligned(np.zeros((count, pitch))) for name, count in places.items()}
    return LaneTables(block_response=np.zeros(0), **empty)


class SeparateModels:
    """Models of trajectories, each of which has its own.

    The models are where kernels expect them as long as this object exists.

    Attributes
    ----------
    models : LaneModels
    """

    def __init__(self, models: Sequence[LaneModel]) -> None:
        """Store models with the same number of cells in a period."""
        size = store(models[0], 0)
        self._kept = models, np.zeros(len(models) * size, dtype=np.uint8)
        places = self._kept[1].ctypes.data + size * np.arange(len(models), dtype=np.int64)
        for model, place in zip(models, places.tolist(), strict=True):
            store(model, place)
        self.models = LaneModels(models[0], np.full(LANES, places[0]), places)


@inlined
def _copy(target: Floats, pitch: int, lane: int, source: Floats, first: int, count: int) -> None:
    """Copy numbers that all lanes share to the first places of a lane of its own."""
    for place in range(count):
        put_lane_value(target, place, pitch, lane, source[first + place])


@kernel
def begin_separate(models: LaneModels, separate: TablesPerLane, lane: int, trajectory: int) -> None:
    """Give a lane the model of a trajectory, if each has its own."""
    if separate.number > 0:
        models.addresses[lane] = models.of_trajectories[trajectory]
        tables, group = record_of(models, lane).tables, table_of(separate, OF_GROUP, models)
        _copy(group.flow, LANES, lane, tables.flow, 0, tables.flow.shape[0])
        _copy(group.output_row, LANES, lane, tables.output_row, 0, tables.output_row.shape[0])
        _copy(group.steady_table, LANES, lane, tables.steady_table, 0, tables.steady_table.shape[0])
        _copy(group.bound, LANES, lane, tables.bound, 0, tables.bound.shape[0])
        count = tables.displacement_scale.shape[0]
        _copy(group.displacement_scale, LANES, lane, tables.displacement_scale, 0, count)
        _copy(group.scalars, LANES, lane, tables.scalars, 0, SCALAR_COUNT)


@inlined
def put_in_pass(batch: LaneTables, pitch: int, k: int, tables: LaneTables, cell: int) -> None:
    """Copy a lane's tables for a cell to a batch, where every lane has its own."""
    _copy(batch.flow, pitch, k, tables.flow, 0, tables.flow.shape[0])
    _copy(batch.output_row, pitch, k, tables.output_row, 0, tables.output_row.shape[0])
    _copy(batch.bound, pitch, k, tables.bound, 0, tables.bound.shape[0])
    _copy(batch.series, pitch, k, tables.series, 0, tables.series.shape[0])
    _copy(batch.unit_impulse, pitch, k, tables.unit_impulse, 0, tables.unit_impulse.shape[0])
    _copy(batch.response, pitch, k, tables.response, 0, TERMS)
    _copy(batch.scalars, pitch, k, tables.scalars, 0, SCALAR_COUNT)
    _copy(batch.steady_table, pitch, k, tables.steady_table, 2 * cell, 4)
    _copy(batch.forcing, pitch, k, tables.forcing, cell * TERMS, TERMS)


@inlined
def put_in_changes(batch: LaneTables, pitch: int, k: int, tables: LaneTables) -> None:
    """Copy what `tangent_batches` needs of a lane's tables to a batch, where every lane has its own."""
    _copy(batch.output_row, pitch, k, tables.output_row, 0, tables.output_row.shape[0])
    _copy(batch.bound, pitch, k, tables.bound, 0, tables.bound.shape[0])
    _copy(batch.change_series, pitch, k, tables.change_series, 0, tables.change_series.shape[0])
    _copy(batch.block, pitch, k, tables.block, 0, tables.block.shape[0])
    _copy(batch.scalars, pitch, k, tables.scalars, 0, SCALAR_COUNT)


@kernel
def cell_of_pass(separate: TablesPerLane, cell: int) -> int:
    """Return where a batch has the tables of a cell: where every lane has its own, they are those of one cell."""
    return cell if separate.number == 0 else 0
