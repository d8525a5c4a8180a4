"""Where the core's time goes on the reference work: its two vector parts timed alone, and what is left.

`advance` carries all lanes through a cell; `solve_impacts` finds the impacts of a cell, as many at a time as there are
in the reference work on average, rounded up to whole vectors. What is left of the whole is putting those lanes side by
side and back, the second pass over the lanes that need one, and counting. The vector parts do not branch, so what they
take does not depend on what is in the lanes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.contestants import time_in_turn
from benchmarks.core_peer import Core
from benchmarks.result import Spread, Stage
from benchmarks.work import reference_work
from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.maps.kernels.first_pass import (
    BATCH_ROWS,
    LEFT,
    PITCH,
    RESTITUTION_LEFT,
    RESTITUTION_RIGHT,
    RIGHT,
    START_V,
    START_X,
    UNIT,
    VECTOR,
    LaneBatch,
    advance,
    lane_batch,
    solve_impacts,
)
from grazemap_core.maps.kernels.lane_tables import LANES, LaneTables, lane_tables
from grazemap_core.maps.kernels.lanes import Lanes, lanes
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import reference

_WHOLE, _CELLS, _IMPACTS = "whole", "cells", "impacts"


@kernel
def _advance_often(blocks: int, tables: LaneTables, group: Lanes, times: int) -> None:
    tables, group = reference(tables), reference(group)
    for _ in range(times):
        advance(blocks, tables, 1, group.even, group.odd, group.limit, group.flags, LANES)


@kernel
def _solve_often(blocks: int, tables: LaneTables, batch: LaneBatch, count: int, times: int) -> None:
    tables = reference(tables)
    for _ in range(times):
        solve_impacts(blocks, tables, 0, batch, count)


def stages(lane_count: int, periods: int, impacts: float, rounds: int, progress: Callable[[str], None]) -> list[Stage]:
    """Time the parts and the whole in turn.

    Parameters
    ----------
    impacts : float
        Per forcing period of the reference work.
    """
    core, work = Core(), reference_work(lane_count, periods)
    blocks = work.oscillator.size
    forced = forced_structures(trajectory_models(work.oscillator), np.array([work.omega]))[0].kernels
    problem, tables = forced.free, lane_tables(forced)
    group, batch = lanes(work.oscillator.size), lane_batch(work.oscillator.size)
    rng = np.random.default_rng(0)
    batch.start[:] = 0.1 * rng.normal(size=batch.start.shape)
    rows = batch.rows.reshape(BATCH_ROWS, PITCH)[:, :LANES]
    rows[RIGHT], rows[LEFT], rows[UNIT] = 1.6, 1.6, 1.6
    rows[RESTITUTION_RIGHT], rows[RESTITUTION_LEFT] = work.oscillator.restitution, work.oscillator.restitution
    rows[START_X], rows[START_V] = 1.4 + 0.1 * rng.random(LANES), 1.0 + rng.random(LANES)
    at_once = int(np.ceil(impacts * LANES / problem.cells / VECTOR)) * VECTOR
    cells = work.lane_periods * problem.cells // LANES
    clocked = time_in_turn(
        {
            _WHOLE: core.prepare(work),
            _CELLS: lambda: _advance_often(blocks, tables, group, cells),
            _IMPACTS: lambda: _solve_often(blocks, tables, batch, at_once, cells),
        },
        rounds,
        progress,
    )
    whole, in_cells, in_impacts = (np.array(clocked[name].cpu) for name in (_WHOLE, _CELLS, _IMPACTS))
    return [
        Stage(
            name=name, nanoseconds=Spread.of(list(1e9 * part / work.lane_periods)), share=Spread.of(list(part / whole))
        )
        for name, part in (
            (f"{problem.cells} cells", in_cells),
            (f"impacts, {at_once} at a time", in_impacts),
            ("lanes put side by side and back, second pass, counts", whole - in_cells - in_impacts),
        )
    ]
