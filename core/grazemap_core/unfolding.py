"""The unfolding map: which motion every point of a rectangle of (omega, clearance) settles to, from rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap_core.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.errors import ParameterError
from grazemap_core.kernels import closing
from grazemap_core.kernels.column import CODES, settle_column
from grazemap_core.kernels.lane_tables import lane_tables
from grazemap_core.kernels.lanes import LANES
from grazemap_core.kernels.lockstep import lanes
from grazemap_core.kernels.workspace import workspace
from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import LARGEST_NUMBER, LEAST_NUMBER

Floats = NDArray[np.float64]


def unfolding_map_tile(
    oscillator: Oscillator,
    omega: Floats,
    clearance: Floats,
    max_periods: int = 1000,
    max_period: int = 32,
) -> dict[str, NDArray[Any]]:
    """Settle one trajectory from rest (forcing phase 0) per point of a grid.

    Every point is computed on its own, so a grid cut into tiles gives the same bytes.

    Parameters
    ----------
    oscillator : Oscillator
    omega : (m,), clearance : (n,)
        The grid, in the oscillator's units; both > 0.
    max_periods : int
        Forcing periods after which a trajectory that has not settled is given up as unresolved.
    max_period : int
        Longest period n of a motion that is looked for.

    Returns
    -------
    dict of arrays of shape (n, m), [clearance, omega]
        kind (int8, position in `motion.KINDS`), reason (int8, key of `motion.REASONS`), period, impacts_right,
        impacts_left (int32; -1: not touched, 0: rested on without an impact, -2: infinitely many, in complete chatter;
        all 0 where unresolved), symmetric (bool), sticking (bool: mass 1 rests on a stop some time in the period),
        settled_after (int32 forcing periods; -1 where unresolved), least_impact_velocity (float64; 0 with complete
        chatter, NaN without impacts or unresolved).

    Raises
    ------
    ParameterError
        A grid value is not positive, or a limit is below 1.
    """
    for name, values in (("omega", omega), ("clearance", clearance)):
        if not np.all((values >= LEAST_NUMBER) & (values <= LARGEST_NUMBER)):
            raise ParameterError(name, f"every number must lie between {LEAST_NUMBER:g} and {LARGEST_NUMBER:g}")
    for name, limit in (("max_periods", max_periods), ("max_period", max_period)):
        if limit < 1:
            raise ParameterError(name, "must be 1 or greater")
    codes, least_velocity = settle_grid(oscillator, omega, clearance, max_periods, max_period, early=True)
    reason, period, right, left, symmetric, after, sticking = codes[:7]
    return {
        "kind": (reason == closing.NAMED).astype(np.int8),
        "reason": reason.astype(np.int8),
        "period": period.astype(np.int32),
        "impacts_right": right.astype(np.int32),
        "impacts_left": left.astype(np.int32),
        "symmetric": symmetric.astype(np.bool_),
        "sticking": sticking.astype(np.bool_),
        "settled_after": after.astype(np.int32),
        "least_impact_velocity": least_velocity,
    }


def settle_grid(
    oscillator: Oscillator, omega: Floats, clearance: Floats, max_periods: int, max_period: int, early: bool
) -> tuple[NDArray[np.int64], Floats]:
    """Return the codes of `kernels.column` of every point, and the least impact velocity.

    Parameters as `unfolding_map_tile`, and whether a trajectory stops once its motion can be named. Shapes
    (CODES, n, m) and (n, m).
    """
    models = trajectory_models(oscillator)
    steady = forced_response(oscillator, omega)
    at_rest = np.zeros(oscillator.size)
    ring = closing.orbit(oscillator.size, max_period, LANES)
    group = lanes(oscillator.size)
    masses = (0,) * oscillator.size
    work = workspace(oscillator.size)
    column = np.ascontiguousarray(clearance, dtype=np.float64)
    shape = (len(clearance), len(omega))
    integers = np.empty((len(clearance), CODES), dtype=np.int64)
    least = np.empty(len(clearance))
    codes = np.empty((CODES, *shape), dtype=np.int64)
    least_velocity = np.empty(shape)
    for i, w in enumerate(omega):
        problem, held = cell_problem(models, steady[i], float(w))
        initial = free_state(models.free, steady[i], float(w), at_rest, at_rest, 0.0)
        tables = lane_tables(problem, held.drag)
        settle_column(
            masses,
            problem,
            held,
            tables,
            initial,
            column,
            max_periods,
            max_period,
            early,
            group,
            ring,
            work,
            integers,
            least,
        )
        codes[:, :, i] = integers.T
        least_velocity[:, i] = least
    return codes, least_velocity
