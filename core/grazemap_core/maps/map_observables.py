"""Observables of the trajectories of a column of a map, once their motions are known.

Of a verified periodic orbit they are computed from its impacts, over its period. Other periodic motions are followed
from the final state of the trajectory until they close to round-off, then over one period. Those of chaotic and
quasi-periodic motions are means over AVERAGED_PERIODS from the final state of the trajectory on. There are none of
unresolved motions.
"""

from __future__ import annotations

import numpy as np

from grazemap_core import codes as reasons
from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.forced import ForcedStructure
from grazemap_core.contact.kernels.cells import Forced
from grazemap_core.contact.kernels.runs import EVENT_COLUMNS, new_run
from grazemap_core.maps.kernels import lane_state, observed_column
from grazemap_core.maps.kernels.lane_state import MAX_ORBIT_IMPACTS, TrajectoryResults
from grazemap_core.maps.kernels.observed_column import ObservedColumn, observe_column
from grazemap_core.simulation.motion import KINDS, kinds_of
from grazemap_core.simulation.observables import Observables, observed_outputs, whole_steady
from grazemap_core.simulation.start import longer_record
from grazemap_core.simulation.tolerances import AVERAGED_PERIODS, EVENTS

_OF_ORBIT = (reasons.RESOLVED, reasons.NOT_CAPTURED, reasons.ROUNDING_DECIDES)


def figures_of_column(
    wanted: Observables, structure: ForcedStructure, forced: Forced, stops: Floats, results: TrajectoryResults
) -> Floats:
    """Return the figures (n, count) of n trajectories.

    Parameters
    ----------
    structure, forced
        The structure at its frequency, and its arrays at phase 0.
    stops : (m, fields of Stops)
        Trajectory i has the row ``i m // n``.
    results : TrajectoryResults
        With the final states.
    """
    models = structure.models
    size, count = models.oscillator.size, len(results.codes)
    partial = observed_outputs(wanted, models, forced, structure.steady[:, :, :-1])
    whole = partial
    if forced.free.resonant_forcing.shape[1] > 0:
        amplitudes = whole_steady(models.oscillator, structure.omega)
        whole = observed_outputs(wanted, models, forced, amplitudes, whole=True)
    kinds, periods = _tasks(results.codes)
    totals, run = wanted.totals(), new_run(size, len(structure.orders), EVENTS)
    column = ObservedColumn(
        kinds=kinds,
        periods=periods,
        stops=stops,
        final=results.final,
        contacts=np.zeros((count, *totals.contacts.shape)),
        outputs=np.zeros((count, *totals.outputs.shape)),
        totals=totals,
        scratch=wanted.scratch(size),
        rows=np.empty((MAX_ORBIT_IMPACTS, EVENT_COLUMNS + 2 * size)),
        before=np.zeros((size, 2)),
    )
    done = observe_column(forced, whole, partial, column, run, 0)
    while done < count:
        run = longer_record(run)
        done = observe_column(forced, whole, partial, column, run, done)
    return wanted.figures(column.contacts, column.outputs, structure.omega, column.periods)


def _tasks(codes: Integers) -> tuple[Integers, Integers]:
    """Return the kinds of `observed_column`, and the forcing periods that are observed, (n,) each."""
    reason, period, right, left, unverified = codes[:, [0, 1, 2, 3, lane_state.UNVERIFIED]].T
    kind, _ = kinds_of(reason, codes[:, lane_state.GROWTH], unverified)
    periodic, known = kind == KINDS.index("periodic"), np.isin(unverified, _OF_ORBIT)
    apart = (right == -1) & (left == -1)
    kinds = np.select(
        [kind == KINDS.index("unresolved"), ~periodic, known & apart, known],
        [
            observed_column.NOT_OBSERVED,
            observed_column.AVERAGED,
            observed_column.STEADY_MOTION,
            observed_column.OF_ORBIT,
        ],
        observed_column.CLOSING,
    )
    periods = np.select([kinds == observed_column.NOT_OBSERVED, periodic], [0, period], AVERAGED_PERIODS)
    return kinds.astype(np.int64), periods.astype(np.int64)
