"""The records inside results: codimension-two points, impacts, sticking, states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

R = TypeVar("R")
_OF_RECURRENCE = frozenset({"order", "active", "families"})
_OF_RESONANT = frozenset({"multiple", "symmetric", "bifurcation", "unfolding"})
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def known_fields(record_class: type[R], record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a record that its class knows; a newer service may send more."""
    names = {field.name for field in fields(record_class)}  # type: ignore[arg-type]
    return {name: value for name, value in record.items() if name in names}


@dataclass(frozen=True, slots=True)
class Family:
    """One of the paper's families of double grazing motions: case 1 to 4 and n, equation (42)."""

    case: int
    n: int


@dataclass(frozen=True, slots=True)
class Unfolding:
    """What leaves the grazing curve at a resonant point, to leading order in the distance x from it in omega.

    The curve of its bifurcation is b = A(omega) + slope x + quadratic x^2, on one side of the point.

    Attributes
    ----------
    orbits_before, orbits_after : int
        Motions of vanishing impact speed have a clearance below (-1) or above (+1) the grazing curve, at omega just
        below and just above the point.
    curve_omega, curve_clearance : int
        The curve is at smaller (-1) or larger (+1) omega, below (-1) or above (+1) the grazing curve.
    contact : {"transversal", "tangent"}
        Of the curve with the grazing curve.
    slope : float
        0 where they are tangent.
    quadratic : float or None
        None where they are transversal.
    velocity_slope : float
        Impact velocity on the curve over the distance in omega.
    transversality : float
        How simple the point is, relative; 0 would be a degenerate one.
    admissible : bool or None
        Whether the motions near the point touch no stop but at their impacts; None: not decided.
    margin : float or None
        By how much that holds, relative to the size of its terms.
    """

    orbits_before: int
    orbits_after: int
    curve_omega: int
    curve_clearance: int
    contact: str
    slope: float
    quadratic: float | None = None
    velocity_slope: float = float("nan")
    transversality: float = float("nan")
    admissible: bool | None = None
    margin: float | None = None


@dataclass(frozen=True, slots=True)
class CodimensionTwoPoint:
    """One codimension-two point of the grazing curve.

    Attributes
    ----------
    kind : {"recurrence", "resonant"}
        A zero of Phi_12(order T/2), equations (45), (57), (58); or a zero of the periodic sum H(1) or H(-1).
    omega, clearance : float
        Where it lies on the grazing curve.
    order : int or None
        Of a recurrence: after how many half periods of the forcing the graze recurs.
    active : bool or None
        Of a recurrence: no smaller order recurs there already.
    families : tuple of Family
        Of a recurrence: the paper's cases and n with this order.
    multiple : int or None
        Of a resonance: the period of the impacting motion in forcing periods.
    symmetric : bool or None
        Of a resonance: it concerns the motions that are their own mirror image.
    bifurcation : {"SN", "PD", "SB"} or None
        Of a resonance: which curve ends there: saddle-node, period doubling, symmetry breaking.
    residual : float or None
        Modulus of the function at its zero over the sum of its amplitudes.
    status : str or None
        "simple", or "near-double": two zeros too close to tell apart, or a near touch that may be none.
    omega_error : float or None
        How far round-off of the model may have moved omega.
    unfolding : Unfolding or None
        Of a resonance: what leaves the grazing curve; None for a near-double one.
    """

    kind: Literal["recurrence", "resonant"]
    omega: float
    clearance: float
    order: int | None = None
    active: bool | None = None
    families: tuple[Family, ...] = ()
    multiple: int | None = None
    symmetric: bool | None = None
    bifurcation: Literal["SN", "PD", "SB"] | None = None
    residual: float | None = None
    status: str | None = None
    omega_error: float | None = None
    unfolding: Unfolding | None = None

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> CodimensionTwoPoint:
        """Return the point that a record of the result's document describes; what its kind has not is None."""
        foreign = _OF_RESONANT if record["kind"] == "recurrence" else _OF_RECURRENCE
        known = {name: value for name, value in known_fields(cls, record).items() if name not in foreign}
        families = known.pop("families", None) or ()
        unfolding = known.pop("unfolding", None)
        return cls(
            **known,
            families=tuple(Family(**known_fields(Family, family)) for family in families),
            unfolding=None if unfolding is None else Unfolding(**known_fields(Unfolding, unfolding)),
        )


@dataclass(frozen=True, eq=False)
class Impacts:
    """Every contact of a trajectory with a stop, in order.

    Attributes
    ----------
    time : ndarray of shape (impacts,)
        From the start of the recorded part; nondimensional, or s.
    period, phase_time : ndarray of int and ndarray, each of shape (impacts,)
        The same without the rounding of a long time: forcing periods completed, and the time since then.
    stop : ndarray of shape (impacts,)
        +1: stop A (right), -1: stop C (left).
    velocity : ndarray of shape (impacts,)
        Signed velocity of mass 1 before the impact; nondimensional, or m/s.
    kind : ndarray of str, shape (impacts,)
        "impact"; "chatter": infinitely many more follow before mass 1 rests on the stop; "graze": so near a touch at
        zero velocity that round-off hides whether it is one, taken as one that changes nothing.
    """

    time: FloatArray
    period: IntArray
    phase_time: FloatArray
    stop: IntArray
    velocity: FloatArray
    kind: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, eq=False)
class Sticking:
    """The intervals during which mass 1 rests on a stop.

    Attributes
    ----------
    start, stop_time : ndarray of shape (intervals,)
        Begin and end; nondimensional, or s.
    stop : ndarray of shape (intervals,)
        +1: stop A (right), -1: stop C (left).
    """

    start: FloatArray
    stop_time: FloatArray
    stop: IntArray

    def __len__(self) -> int:
        return len(self.start)


@dataclass(frozen=True, eq=False)
class State:
    """A moment of a motion; as the `initial` of another trajectory it is where that one starts.

    Attributes
    ----------
    displacement, velocity : ndarray of shape (N,)
        m and m/s in SI.
    phase : float
        Of the forcing, in (-pi, pi].
    """

    displacement: FloatArray
    velocity: FloatArray
    phase: float


@dataclass(frozen=True, slots=True)
class MotionShare:
    """One motion of an unfolding map and how much of the map it covers.

    Attributes
    ----------
    label : str
        n-p_r-q_l as plain text, or the name of the kind for a motion that is not periodic.
    kind : str
    period, impacts_right, impacts_left : int or None
        None for a motion that is not periodic.
    pixels : int
    share : float
        pixels over all pixels of the map, from 0 to 1.
    """

    label: str
    kind: str
    period: int | None
    impacts_right: int | None
    impacts_left: int | None
    pixels: int
    share: float
