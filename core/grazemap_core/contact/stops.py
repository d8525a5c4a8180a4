"""The stops of a trajectory, from the clearances that users give: their gaps, their unit of length, their chatter."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact import tolerances
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.errors import ParameterError
from grazemap_core.model.equilibrium import effective_gaps
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

STOPS_UNIT = Stops._fields.index("unit")
"""Column of `stops_table`."""

Clearance = float | tuple[float | None, float | None]
"""Distance of both stops, or of the right and of the left one, from q = 0; None: there is no such stop."""


def both_clearances(clearance: Clearance) -> tuple[float, float]:
    """Return the clearances of the right and of the left stop; infinite for an absent one."""
    right, left = clearance if isinstance(clearance, tuple) else (clearance, clearance)
    return math.inf if right is None else right, math.inf if left is None else left


def stops_of(oscillator: Oscillator, clearance: Clearance, cells: int, amplitude: float) -> Stops:
    """Return the stops as the kernels of trajectories take them. Raises as `stops_between`, but the unit may be 0.

    `cells` are in a period, and `amplitude` bounds the steady motion of q.
    """
    gaps, restitutions = _gaps_and_restitutions(oscillator, clearance)
    (row,) = stops_table(oscillator, np.array([gaps]), np.array([restitutions]), cells, amplitude)
    right, left, restitution_right, restitution_left, unit, chatter, settling, symmetric = row.tolist()
    return Stops(right, left, restitution_right, restitution_left, unit, chatter, settling, symmetric != 0.0)


def stops_between(oscillator: Oscillator, clearance: Clearance, amplitude: float) -> Stops:
    """Return the stops without the limits of chatter; `amplitude` is a bound of the steady motion of q.

    Raises
    ------
    ParameterError
        A clearance is out of its range, both stops are absent, or the equilibrium lies beyond both.
    """
    gaps, restitutions = _gaps_and_restitutions(oscillator, clearance)
    unit = float(unit_of_stops(*gaps, amplitude))
    require_length(unit)
    alike = gaps[0] == gaps[1] and restitutions[0] == restitutions[1] and oscillator.is_half_wave_symmetric
    return Stops(*gaps, *restitutions, unit, 0.0, 0.0, alike)


def _gaps_and_restitutions(
    oscillator: Oscillator, clearance: Clearance
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the gaps of both stops from the equilibrium, and their restitutions. Raises as `stops_between`."""
    right, left = clearance if isinstance(clearance, tuple) else (clearance, clearance)
    for gap in (right, left):
        if gap is not None and not (gap == 0.0 or SMALLEST_NUMBER <= abs(gap) <= LARGEST_NUMBER):
            raise ParameterError(
                "clearance", f"every number must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in size"
            )
    if right is None and left is None:
        raise ParameterError("clearance", "has neither a right nor a left stop")
    return effective_gaps(oscillator, right, left), (oscillator.restitution_of(1), oscillator.restitution_of(-1))


def require_length(unit: float, moved_by: str = "the forces do not move") -> None:
    """Raise ParameterError unless the unit of length is positive; `moved_by` says what else has no length."""
    if not unit > 0.0:
        raise ParameterError("clearance", f"has a stop at the equilibrium, and {moved_by} the contact")


def unit_of_stops(right: float | Floats, left: float | Floats, amplitude: float | Floats = 0.0) -> Floats:
    """Return `Stops.unit` for gaps (n,) of both stops; `amplitude` is a bound of the steady motion of q."""
    of_nearer = np.maximum(np.abs(np.minimum(right, left)), amplitude)
    return np.minimum(0.5 * np.add(right, left), of_nearer)


def stops_table(
    oscillator: Oscillator, gaps: Floats, restitution: Floats, cells: int, amplitude: float | Floats
) -> Floats:
    """Return the fields of `Stops`, (n, fields), for stops with gaps from the equilibrium and restitutions.

    `gaps` and `restitution` (n, 2) are those of the right and of the left stop, `cells` are in a period, and
    `amplitude`, or (n,), bounds the steady motion of q.
    """
    numbers = restitution.ravel().tolist()
    known = {number: followed_chatter_impacts(number, cells) for number in set(numbers)}
    chatter = np.array([known[number] for number in numbers]).reshape(-1, 2)
    settling = np.where(chatter < tolerances.MAX_CHATTER_IMPACTS, chatter, 0.0)
    right, left = gaps.T
    alike = (right == left) & (restitution[:, 0] == restitution[:, 1]) & oscillator.is_half_wave_symmetric
    unit = unit_of_stops(right, left, amplitude)
    return np.column_stack([gaps, restitution, unit, chatter.sum(axis=1), settling.sum(axis=1), alike])


@lru_cache(maxsize=16)
def followed_chatter_impacts(restitution: float, cells: int) -> float:
    """Return how many impacts of a complete chatter are computed one by one, at most MAX_CHATTER_IMPACTS.

    The chatter may last half a forcing period; `cells` is the number of cells of a period.
    """
    if restitution == 0.0:
        return 1.0
    if restitution == 1.0:
        return float(tolerances.MAX_CHATTER_IMPACTS)
    return min(
        float(tolerances.MAX_CHATTER_IMPACTS),
        1.0 + (math.log(tolerances.CHATTER_ACCURACY) / 3.0 - math.log(0.5 * cells)) / math.log(restitution),
    )
