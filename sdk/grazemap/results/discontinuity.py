"""The discontinuity mapping at a grazing point, its errors, and the returns of the motion below grazing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Unpack

from grazemap.results.base import Result, counted
from grazemap.results.common_records import STOPS, Common
from grazemap.results.grazing import XI
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import FloatArray, IntArray, Record, field

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ENTRY, _EACH, _ONWARD = "state_entry", "overshoot", "overshoot return"


class Grazing(Record):
    """The steady motion where it touches the stop; states are (x_1, v_1, ..., x_N, v_N, theta), equation (20)."""

    state: FloatArray = field("The state; theta is the phase of the forcing, in (-pi/p, pi/p].", _ENTRY)
    vector_field: FloatArray = field("Vector field at the state.", _ENTRY)
    acceleration: float = field("Acceleration of the contact coordinate.", unit="m/s^2")
    beta: FloatArray = field(
        "Coefficient in x + beta u + gamma u^2 + ..., u = sqrt(2 overshoot/|acceleration|), equation (27).", _ENTRY
    )
    gamma: FloatArray = field("Coefficient of the same mapping.", _ENTRY)


class NextContact(Record):
    """The next contact of the steady motion after its first impact, slightly below the grazing curve."""

    order: IntArray = field("Returns until that contact; 0: none within the requested ones.", _EACH)
    stop: IntArray = field("Stop of that contact: +1 right, -1 left, 0 none.", _EACH)
    margin: FloatArray = field("Distance of the order from its threshold, relative to the latter.", _EACH, null=True)


class Returns(Record):
    """The motion with stops closer than the steady amplitude by each overshoot, from the map (26) and from simulation.

    Deviations are taken from the grazing point at every return: half periods of the forces, alternately at the two
    stops, where both are grazed at once, else whole ones. The first return is the graze. There are no
    deviations outside the domain of the map, and where the motion is no longer near the graze.
    """

    mapped: FloatArray = field("Deviations by the Poincare map, equation (26).", f"{_ONWARD} {_ENTRY}", null=True)
    simulated: FloatArray = field("Deviations by simulation.", f"{_ONWARD} {_ENTRY}", null=True)
    mapped_overshoot: FloatArray = field(
        "Distance of the contact beyond the stop; positive: there is an impact.", _ONWARD, "m", null=True
    )
    simulated_overshoot: FloatArray = field("The same for the simulation.", _ONWARD, "m", null=True)
    error: FloatArray = field(
        "Maximum difference of the deviations, in units of amplitude, p omega times it, and radians of p omega t.",
        _ONWARD,
        null=True,
    )


class DiscontinuityMapping(Result, process="discontinuity-mappings", rows="overshoot"):
    """The effect of an impact on motions that overshoot a grazing stop, and their later returns.

    The contact is displaced beyond the stop by each overshoot; all else is as in the graze. Errors are maximum entries
    in units of the steady amplitude, p omega times the amplitude, and radians of p omega t.
    """

    omega: float = field(Common)
    clearance: float = field(Common, description="Clearance of the grazing point.")
    stop: int = field("The stop that is grazed: +1 right, -1 left.", values=STOPS)
    grazing: Grazing = field("The motion at the grazing point, and the coefficients of the mapping.", prefix="grazing_")
    overshoot: FloatArray = field("Displacement of the contact beyond the stop.", _EACH, "m")
    largest_overshoot: float = field("End of the domain of the exact mapping.", unit="m")
    state: FloatArray = field("The states that are mapped.", f"{_EACH} {_ENTRY}")
    mapped: FloatArray = field("Their images under the mapping of the requested order.", f"{_EACH} {_ENTRY}")
    displacement: FloatArray = field(
        "Image minus state, to full relative accuracy.", f"{_EACH} {_ENTRY}", variable="displacement"
    )
    size: FloatArray = field("Size of the exact displacement.", _EACH)
    error: FloatArray = field("Error of x + beta u.", _EACH)
    error_of_second_order: FloatArray = field("Error of x + beta u + gamma u^2.", _EACH)
    fitted_order: float = field("Exponent of the overshoot in `error`: 1 in theory.", null=True)
    fitted_order_of_second: float = field("The same for `error_of_second_order`: 3/2 in theory.", null=True)
    jacobian: FloatArray = field(
        "Jacobian of the map from this return to the next one, equation (46).", f"{_ENTRY} state_entry_before"
    )
    jacobian_opposite: FloatArray = field(
        "Jacobian of the map from the next return to the one after it, at the other stop if both are grazed at once.",
        f"{_ENTRY} state_entry_before",
    )
    xi: FloatArray = field(
        XI,
        description="xi_m for m = 1 .. returns of a graze at this stop, equations (33)-(40): an impact "
        "recurs at the first m with (-1)^m stop xi_m < 0, or stop xi_m < 0 after whole periods.",
    )
    first_recurrence: int = field("The first m at which an impact recurs; 0: none.")
    recurrence_stop: int = field("The stop of that impact: +1 right, -1 left, 0 none.")
    next_contact: NextContact = field("The next contact of the steady motion.", prefix="next_")
    margin: float | None = field(
        "Gap of the other stop minus the amplitude toward it.",
        unit="m",
        when="of stops that are not alike, if there is another one",
    )
    returns: Returns = field("The later returns of the motion.", prefix="returns_")

    @picture
    def plot(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the errors of the mapping, and of the returns by the Poincare map, over the overshoot."""
        return draw(self, ax, options)

    def _summary(self) -> str:
        return f"{counted(self.overshoot, 'overshoot')}, {counted(self.returns.error[0, 1:], 'return')}"
