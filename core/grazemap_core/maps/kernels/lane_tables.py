"""Tables of an oscillator at a forcing frequency for the lockstep kernels: polynomials over a cell.

A lane is one of the trajectories that a lockstep kernel computes together; q is the contact coordinate. All lanes share
one table, or every lane has its own. Those of a trajectory are then copied into its lane when it starts
(`begin_separate`), and from there into batches of lanes in a cell (`put_in_pass`, `put_in_changes`).

Within a cell, z runs from -1 to 1. Two quantities are polynomials in z: q, from the state at the start of the cell, and
how much an impulse on the contact at z changes the state at the end of the cell. Both are expanded about the middle of
the cell to the degree LANE_DEGREE, which suffices for round-off.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers, aligned
from grazemap_core.contact.kernels.cells import CellProblem, Forced, rotated_entry
from grazemap_core.contact.kernels.first_contact import HERMITE_DIVISOR
from grazemap_core.maps.tolerances import LANE_DEGREE
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.numerics.jit.compiled import inlined, kernel
from grazemap_core.numerics.jit.lane_values import put_lane_value, record_of, store, table_of
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE
from grazemap_core.orbits.kernels.verification import ImpulseBlocks
from grazemap_core.records import NamedTuple

TERMS = LANE_DEGREE + 1
assert TERMS == 15, "first_pass and second_pass are written out for 15 terms"

LANES = 128
"""Lanes of a group: enough that those with an impact in the same cell fill vectors, few enough for the caches."""

RESPONSE_PARTS = 4
"""Number of parts of a cell; the responses of the blocks are tabulated at the end of each part."""

FLOW_DEGREE = 7
"""Degree of the series of a flow over half a part of a cell, with exponents up to CELL_REACH / (2 RESPONSE_PARTS) =
1/8. The omitted term is 2^-24/8! = 1.5e-12, and growth is not known to more than three digits."""

BLOCK_NUMBERS = 4
"""How many numbers `LaneTables.block` has for each block."""

OF_GROUP, OF_FIRST_PASS, OF_SECOND_PASS, OF_CHANGES = 0, 1, 2, 3
"""Tables of the lanes of a group, of a batch in the first and in the second pass over a cell, and in a batch of
`tangent_batches`."""

# entries of `scalars`
STEP, VISCOUS_TERM, STEADY, STEADY_FOURTH, IMPULSE_REACH, IMPULSE_FOURTH = 0, 1, 2, 3, 4, 5
"""Length h of a cell; the viscous term of `cells.HeldProblem`; bounds of the reference motion, and of h^4/384
times its fourth derivative; contributions of a unit of velocity given to q to the bounds of |q| and of h^4/384
|q''''|."""
SCALAR_COUNT = 6


class LaneTables(NamedTuple):
    """Tables that all lanes of a group share; or, from `lane_values`, one for each lane, lanes last."""

    flow: Floats
    """(N * 4,) As `cells.CellProblem.cell_flow`."""
    output_row: Floats
    """(N * 4,) As in `cells.CellProblem`."""
    steady_table: Floats
    """((cells + 1) * 2,) Position and velocity of the reference motion of q at every boundary of cells."""
    bound: Floats
    """(N * 3,) Frequency of a block, and contributions of a unit of its envelope to the bounds of |q| and of h^4/384
    |q''''|."""
    series: Floats
    """(TERMS * 2 N,) Coefficients in z of q over a cell, per component of the state at the start of the cell."""
    forcing: Floats
    """(cells * TERMS,) Coefficients in z of the reference motion of q over each cell."""
    unit_impulse: Floats
    """(2 N * TERMS,) Coefficients in z of the change of the state at the end of the cell by a unit of velocity given to
    q at z."""
    response: Floats
    """(TERMS,) Coefficients of q in s, the time in half cells since a unit of velocity was given to it."""
    block_response: Floats
    """(RESPONSE_PARTS * cells + 1, 2 N) (u, u') of every block, row by row a part of a cell later, after a start with
    (0, 1); no rows where `CellProblem.flow_table` has not all cells of a period, or every lane has its own."""
    change_series: Floats
    """(2 * N * FLOW_DEGREE,) Each block's response to a unit velocity over a short time: coefficients from the linear
    one on, and those of the derivative, from the constant on."""
    block: Floats
    """(N * BLOCK_NUMBERS,) Of every block decay, frequency_squared, and both numbers of `CellProblem.unit_impulse`."""
    displacement_scale: Floats
    """(N * 2,) As in `cells.CellProblem`."""
    scalars: Floats
    """(SCALAR_COUNT,) Single numbers; STEP to IMPULSE_FOURTH are their positions."""


class LaneModel(NamedTuple):
    """One oscillator at one forcing frequency."""

    forced: Forced
    """The oscillator for the kernels of a single trajectory."""
    tables: LaneTables
    """Tables for the lockstep kernels."""
    blocks: ImpulseBlocks
    """Blocks for the kernels that verify orbits."""


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


@njit(cache=True, nogil=True, error_model="numpy")
def _steady_tables(problem: CellProblem) -> tuple[Floats, Floats]:
    """Return `LaneTables.forcing` and `LaneTables.steady_table`."""
    cells, half = problem.cells, 0.5 * problem.step
    forcing = np.empty((cells, TERMS))
    for cell in range(problem.reference_series.shape[0]):
        series, power = problem.reference_series[cell].copy(), 1.0
        for lowest in range(TAYLOR_DEGREE):  # expanded about the middle
            for k in range(TAYLOR_DEGREE - 1, lowest - 1, -1):
                series[k] += 0.5 * series[k + 1]
        for n in range(TERMS):
            forcing[cell, n] = power * series[n]
            power *= 0.5
    for cell in range(cells // 2 if problem.reference_series.shape[0] == 0 else 0):
        real, imag = rotated_entry(problem.steady_table, cell, problem.omega * half)
        for n in range(TERMS):
            forcing[cell, n] = imag
            forcing[cell + cells // 2, n] = -imag  # an exact mirror image, as in the table of the steady motion
            scale = problem.omega * half / (n + 1)
            real, imag = -scale * imag, scale * real
    steady_table = np.empty((cells + 1, 2))
    for cell in range(cells + 1):
        steady_table[cell, 0], steady_table[cell, 1] = (
            problem.steady_table[cell, 1],
            problem.omega * problem.steady_table[cell, 0],
        )
    return forcing.reshape(-1), steady_table.reshape(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def _block_response(problem: CellProblem) -> Floats:
    """Return `LaneTables.block_response`."""
    rows = RESPONSE_PARTS * problem.cells + 1 if problem.flow_table.shape[0] > problem.cells else 0
    table = np.empty((rows, 2 * problem.decay.shape[0]))
    for j in range(problem.decay.shape[0]):
        decay, square = problem.decay[j], problem.frequency_squared[j]
        e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, problem.step / RESPONSE_PARTS)
        first, second = 0.0, 1.0
        for row in range(rows):
            table[row, 2 * j], table[row, 2 * j + 1] = first, second
            first, second = e11 * first + e12 * second, e21 * first + e22 * second
    return table


@njit(cache=True, nogil=True, error_model="numpy")
def _change_series(problem: CellProblem) -> Floats:
    """Return `LaneTables.change_series`: y'' = -frequency_squared y - 2 decay y' from y = 0, y' = 1."""
    blocks = problem.decay.shape[0]
    series = np.empty((2, blocks, FLOW_DEGREE))
    for j in range(blocks):
        before, term = 0.0, 1.0
        for power in range(1, FLOW_DEGREE + 1):
            series[0, j, power - 1], series[1, j, power - 1] = term, power * term
            following = -(2.0 * problem.decay[j] * power * term + problem.frequency_squared[j] * before)
            before, term = term, following / (power * (power + 1.0))
    return series.reshape(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def lane_tables(forced: Forced) -> LaneTables:
    """Return the tables of an oscillator at one forcing frequency."""
    problem = forced.free
    blocks = problem.decay.shape[0]
    half = 0.5 * problem.step
    quartic = problem.step**4 / HERMITE_DIVISOR
    series = np.empty((TERMS, 2 * blocks))
    unit_impulse = np.empty((2 * blocks, TERMS))
    response = np.zeros(TERMS)
    bound, block = np.empty((blocks, 3)), np.empty((blocks, BLOCK_NUMBERS))
    impulse_reach, impulse_fourth = 0.0, 0.0
    for j in range(blocks):
        decay, square = problem.decay[j], problem.frequency_squared[j]
        e11, e12, e21, e22 = block_flow(decay, problem.discriminant[j], square, half)
        first, second = problem.output_row[j, 0], problem.output_row[j, 1]
        row_first, row_second = first * e11 + second * e21, first * e12 + second * e22
        first, second = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        at_first, at_second = e11 * first + e12 * second, e21 * first + e22 * second
        for n in range(TERMS):
            series[n, 2 * j], series[n, 2 * j + 1] = row_first, row_second
            unit_impulse[2 * j, n], unit_impulse[2 * j + 1, n] = at_first, at_second
            scale = half / (n + 1)
            row_first, row_second = -scale * square * row_second, scale * (row_first - 2.0 * decay * row_second)
            at_first, at_second = -scale * at_second, scale * (square * at_first + 2.0 * decay * at_second)
        at_first, at_second = unit_impulse[2 * j, 0], unit_impulse[2 * j + 1, 0]
        for n in range(TERMS):
            response[n] += problem.output_row[j, 0] * at_first + problem.output_row[j, 1] * at_second
            scale = half / (n + 1)
            at_first, at_second = scale * at_second, -scale * (square * at_first + 2.0 * decay * at_second)
        envelope = problem.frequency[j] * abs(problem.unit_impulse[j, 0]) + abs(problem.unit_impulse[j, 1])
        bound[j, 0] = problem.frequency[j]
        bound[j, 1] = problem.reach[j]
        bound[j, 2] = problem.fourth[j] * quartic
        block[j, 0], block[j, 1] = decay, square
        block[j, 2], block[j, 3] = problem.unit_impulse[j, 0], problem.unit_impulse[j, 1]
        impulse_reach += bound[j, 1] * envelope
        impulse_fourth += bound[j, 2] * envelope
    # so far about half a cell after the impulse, where TERMS suffice for a whole cell; now about the impulse itself
    for i in range(TERMS - 1):
        for n in range(TERMS - 2, i - 1, -1):
            response[n] -= response[n + 1]
    forcing, steady_table = _steady_tables(problem)
    of_steady = problem.steady_bound, problem.steady_fourth * quartic
    scalars = np.array(
        [problem.step, forced.held.viscous_term, of_steady[0], of_steady[1], impulse_reach, impulse_fourth]
    )
    return LaneTables(
        problem.cell_flow.copy().reshape(-1),
        problem.output_row.copy().reshape(-1),
        steady_table,
        bound.reshape(-1),
        series.reshape(-1),
        forcing,
        unit_impulse.reshape(-1),
        response,
        _block_response(problem),
        _change_series(problem),
        block.reshape(-1),
        problem.displacement_scale.copy().reshape(-1),
        scalars,
    )


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
    """Copy numbers that all lanes share to the first places of a lane of its own.

    A count that is a constant lets the compiler write the loop out, which it does not with a slice.
    """
    for place in range(count):
        put_lane_value(target, place, pitch, lane, source[first + place])


@inlined
def _copy_all(target: Floats, pitch: int, lane: int, source: Floats) -> None:
    _copy(target, pitch, lane, source, 0, source.shape[0])


@kernel
def begin_separate(models: LaneModels, separate: TablesPerLane, lane: int, trajectory: int) -> None:
    """Give a lane the model of a trajectory, if each has its own."""
    if separate.number > 0:
        models.addresses[lane] = models.of_trajectories[trajectory]
        tables, group = record_of(models, lane).tables, table_of(separate, OF_GROUP, models)
        _copy_all(group.flow, LANES, lane, tables.flow)
        _copy_all(group.output_row, LANES, lane, tables.output_row)
        _copy_all(group.steady_table, LANES, lane, tables.steady_table)
        _copy_all(group.bound, LANES, lane, tables.bound)
        _copy_all(group.displacement_scale, LANES, lane, tables.displacement_scale)
        _copy(group.scalars, LANES, lane, tables.scalars, 0, SCALAR_COUNT)


@inlined
def put_in_pass(batch: LaneTables, pitch: int, k: int, tables: LaneTables, cell: int) -> None:
    """Copy a lane's tables for a cell to a batch, where every lane has its own."""
    _copy_all(batch.flow, pitch, k, tables.flow)
    _copy_all(batch.output_row, pitch, k, tables.output_row)
    _copy_all(batch.bound, pitch, k, tables.bound)
    _copy_all(batch.series, pitch, k, tables.series)
    _copy_all(batch.unit_impulse, pitch, k, tables.unit_impulse)
    _copy(batch.response, pitch, k, tables.response, 0, TERMS)
    _copy(batch.scalars, pitch, k, tables.scalars, 0, SCALAR_COUNT)
    _copy(batch.steady_table, pitch, k, tables.steady_table, 2 * cell, 4)
    _copy(batch.forcing, pitch, k, tables.forcing, TERMS * cell, TERMS)


@inlined
def put_in_changes(batch: LaneTables, pitch: int, k: int, tables: LaneTables) -> None:
    """Copy what `tangent_batches` needs of a lane's tables to a batch, where every lane has its own."""
    _copy_all(batch.output_row, pitch, k, tables.output_row)
    _copy_all(batch.bound, pitch, k, tables.bound)
    _copy_all(batch.change_series, pitch, k, tables.change_series)
    _copy_all(batch.block, pitch, k, tables.block)
    _copy(batch.scalars, pitch, k, tables.scalars, 0, SCALAR_COUNT)


@kernel
def cell_of_pass(separate: TablesPerLane, cell: int) -> int:
    """Return where a batch has the tables of a cell: where every lane has its own, they are those of one cell."""
    return cell if separate.number == 0 else 0
