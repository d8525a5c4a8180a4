"""How a parameter that varies changes the gaps of the stops: a clearance, the factor of the forces, or of the bias.

The motions under forces of the factor F are F times those under the factor 1, whose gaps are those of the stops over F
(theory, "Other planes"). The bias moves the equilibrium: one gap grows by what the other one loses.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.kernels.one_impact_contacts import StopGap
from grazemap_core.orbits.single_impact.special_orbits import ABSENT
from grazemap_core.records import NamedTuple, dataclass


@dataclass(frozen=True)
class VariedFactor:
    """The factor of the forces, or of the bias, varies."""

    name: Literal["forcing", "bias"]
    """Which factor."""
    right: float
    """Clearance of the right stop; infinite for an absent one."""
    left: float
    """Clearance of the left stop, likewise."""

    def clearance(self, stop: int) -> float:
        """Return the clearance of a stop."""
        return self.right if stop > 0 else self.left


CurveParameter = VariedStop | VariedFactor


class MovedGaps(NamedTuple):
    """The gaps of the stops as functions of that of one of them, under forces of the factor 1."""

    other: StopGap
    """The gap of the other stop."""
    value: Callable[[Floats], Floats]
    """Returns the values (m,) of the parameter at gaps (m,) of the stop."""
    forces: bool = False
    """Whether the parameter is the factor of the forces: speeds are proportional to it."""


def moved_gaps(oscillator: Oscillator, varied: CurveParameter, stop: int) -> MovedGaps | None:
    """Return the gaps of a stop that the parameter moves; None where it moves the other stop alone.

    Raises
    ------
    ParameterError
        The bias varies, and does not move the contact; the forces vary, and the equilibrium is at the stop.
    """
    place = contact_equilibrium(oscillator)
    if isinstance(varied, VariedFactor):
        return _gaps_of_factor(varied, stop, place)
    offset = stop * place
    if varied.together:
        other = StopGap(2.0 * offset, 1.0)
    elif stop == varied.stop:
        other = ABSENT if varied.other is None else StopGap(varied.other + offset)
    else:
        return None
    return MovedGaps(other, lambda gap: gap + offset)


def _gaps_of_factor(varied: VariedFactor, stop: int, place: float) -> MovedGaps:
    struck, beside = varied.clearance(stop), varied.clearance(-stop)
    if varied.name == "bias":
        if place == 0.0:
            raise ParameterError("bias", "does not move the contact, so the motions do not depend on it")
        moved = ABSENT if np.isinf(beside) else StopGap(struck + beside, -1.0)
        return MovedGaps(moved, lambda gap: (struck - gap) / (stop * place))
    gap, other = struck - stop * place, beside + stop * place
    if gap == 0.0:
        raise ParameterError("clearance", "leaves no gap to the equilibrium, which no force changes")

    def value(gaps: Floats) -> Floats:
        with np.errstate(divide="ignore"):
            return np.asarray(gap / gaps)

    return MovedGaps(ABSENT if np.isinf(other) else StopGap(0.0, other / gap), value, forces=True)
