"""The discontinuity mapping at a grazing point, its errors, and the returns of the motion below grazing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Unpack

from grazemap.results.base import Result, counted
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import FloatArray, IntArray, described
from grazemap.schema.discontinuity import GRAZING, NEXT_CONTACT, RETURNS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@described(GRAZING)
class Grazing:
    """The steady motion where it touches the stop; states are (x_1, v_1, ..., x_N, v_N, theta), equation (20)."""

    state: FloatArray
    vector_field: FloatArray
    acceleration: float
    beta: FloatArray
    gamma: FloatArray


@described(NEXT_CONTACT)
class NextContact:
    """The next contact of the steady motion after its first impact, slightly below the grazing curve."""

    order: IntArray
    stop: IntArray
    margin: FloatArray


@described(RETURNS)
class Returns:
    """The motion with the stops closer than the steady amplitude by the overshoot, by the map (26) and by simulation.

    Rows are overshoots and columns returns, the first of which is the graze. Deviations are taken from the grazing
    point at the return, alternately of the two stops if both are grazed at once, as if there were no impact there. They
    are NaN outside the domain of the map, and where the motion is no longer near the graze.
    """

    mapped: FloatArray
    simulated: FloatArray
    mapped_overshoot: FloatArray
    simulated_overshoot: FloatArray
    error: FloatArray


class DiscontinuityMapping(Result):
    """The effect of an impact on motions that overshoot a grazing stop, and their later returns.

    The contact is displaced beyond the stop by each overshoot; all else is as in the graze. Errors are maximum entries
    in units of the steady amplitude, omega times the amplitude, and radians.
    """

    omega: float
    clearance: float
    stop: int
    grazing: Grazing
    overshoot: FloatArray
    largest_overshoot: float
    state: FloatArray
    mapped: FloatArray
    displacement: FloatArray
    size: FloatArray
    error: FloatArray
    error_of_second_order: FloatArray
    fitted_order: float
    fitted_order_of_second: float
    jacobian: FloatArray
    jacobian_opposite: FloatArray
    xi: FloatArray
    first_recurrence: int
    recurrence_stop: int
    next_contact: NextContact
    margin: float | None
    returns: Returns

    @picture
    def plot(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the errors of the mapping, and of the returns by the Poincare map, over the overshoot."""
        return draw(self, ax, options)

    def _summary(self) -> str:
        return f"{counted(self.overshoot, 'overshoot')}, {counted(self.returns.error[0, 1:], 'return')}"
