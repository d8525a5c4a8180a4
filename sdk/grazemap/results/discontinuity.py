"""The discontinuity mapping at a grazing point, its errors, and the returns of the motion below grazing."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

from grazemap.codec import Document
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Grazing:
    """The steady motion where it touches the stop; states are (x_1, v_1, ..., x_N, v_N, theta), equation (20).

    Attributes
    ----------
    state, vector_field : ndarray of shape (2N + 1,)
        theta is the phase of the forcing, in (-pi, pi].
    acceleration : float
        Of mass 1: minus or plus omega^2 times the clearance.
    beta, gamma : ndarray of shape (2N + 1,)
        The mapping is x + beta u + gamma u^2 + ..., with u = sqrt(2 overshoot/|acceleration|), equation (27).
    """

    state: FloatArray
    vector_field: FloatArray
    acceleration: float
    beta: FloatArray
    gamma: FloatArray


@dataclass(frozen=True, eq=False)
class NextContact:
    """Where the steady motion hits a stop again after its first impact, by the rule for stops just inside it.

    Attributes
    ----------
    order : ndarray of int, shape (n,)
        Half periods later; 0: not within the returns that were asked for.
    stop : ndarray of int, shape (n,)
        +1 A, -1 C, 0 none.
    margin : ndarray of shape (n,)
        How far the rule is from another answer, relative to its threshold. Where it is of the size of the square root
        of the relative overshoot, the rule decides nothing.
    """

    order: IntArray
    stop: IntArray
    margin: FloatArray


@dataclass(frozen=True, eq=False)
class Returns:
    """The steady motion when the stops stand the overshoot inside its amplitude: by the map (26) and itself.

    Rows: one per overshoot; columns: half periods, the first being the graze. Deviations are from the grazing point of
    the two stops in turn, as if there were no impact there; NaN where the map is beyond its domain or the motion no
    longer near the graze.

    Attributes
    ----------
    mapped, simulated : ndarray of shape (n, returns + 1, 2N + 1)
    mapped_overshoot, simulated_overshoot : ndarray of shape (n, returns + 1)
        How far mass 1 is beyond the stop; an impact where it is positive.
    error : ndarray of shape (n, returns + 1)
        Largest difference of the two deviations in units of clearance, omega times clearance, and radians.
    """

    mapped: FloatArray
    simulated: FloatArray
    mapped_overshoot: FloatArray
    simulated_overshoot: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class DiscontinuityMapping(Result):
    """What an impact does to motions that overshoot a grazing stop, and what the motion does next.

    Mass 1 is taken straight beyond the stop by each overshoot, all else as in the graze. Errors are largest entries in
    units of clearance, omega times clearance, and radians.

    Attributes
    ----------
    omega, clearance : float
        On the grazing curve.
    stop : int
        +1 A, -1 C.
    grazing : Grazing
    overshoot : ndarray of shape (n,)
    largest_overshoot : float
        End of the domain of the exact mapping.
    state, mapped, displacement : ndarray of shape (n, 2N + 1)
        The states, what they are mapped to (by the order that was asked for), and the difference to all its digits.
    size, error, error_of_second_order : ndarray of shape (n,)
        Of the exact displacement; of the leading-order mapping's error; of that with gamma u^2 too.
    fitted_order, fitted_order_of_second : float
        Exponents of the overshoot in both errors; NaN for a single overshoot.
    jacobian, jacobian_opposite : ndarray of shape (2N + 1, 2N + 1)
        Of the half-period map from this stop to the other one, and back: equation (46).
    xi : ndarray of shape (returns,)
        xi_m for m = 1 .. returns, equations (33)-(40): an impact recurs at the first m with (-1)^m stop xi_m < 0.
    first_recurrence, recurrence_stop : int
        That m, and its stop (+1 A, -1 C); 0 if there is none.
    next_contact : NextContact
    returns : Returns
    """

    process: ClassVar[str] = "discontinuity-mappings"

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
    returns: Returns

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        grazing, contact, returns = document["grazing"], document["next_contact"], document["returns"]
        numbers = ("omega", "clearance", "largest_overshoot", "fitted_order", "fitted_order_of_second")
        arrays = ("overshoot", "state", "mapped", "displacement", "size", "error", "error_of_second_order")
        return {
            **{name: float(floats(document[name])) for name in numbers},
            **{name: int(document[name]) for name in ("stop", "first_recurrence", "recurrence_stop")},
            **{name: floats(document[name]) for name in (*arrays, "jacobian", "jacobian_opposite", "xi")},
            "grazing": Grazing(
                **{name: floats(grazing[name]) for name in ("state", "vector_field", "beta", "gamma")},
                acceleration=float(grazing["acceleration"]),
            ),
            "next_contact": NextContact(
                integers(contact["order"]), integers(contact["stop"]), floats(contact["margin"])
            ),
            "returns": Returns(**{field.name: floats(returns[field.name]) for field in fields(Returns)}),
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the error of the mapping, and of the returns of the map made of it, over the overshoot."""
        from grazemap.plots.discontinuity import plot_mapping_error

        return plot_mapping_error(self, ax)

    def _summary(self) -> str:
        return f"{len(self.overshoot)} overshoots, {self.returns.error.shape[1] - 1} returns"
