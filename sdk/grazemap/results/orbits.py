"""Periodic motions with impacts, and their branches over a parameter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import FloatArray, IntArray, State, Sticking, known_fields
from grazemap.wire import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(Result):
    """A periodic motion with impacts; where `converged` is false, why there is none near what was asked for.

    Attributes
    ----------
    omega, clearance : float
    converged : bool
    found_by : {"equations", "simulation"}
        Solved for; or, where mass 1 rests on a stop, followed until it closes, with multipliers of the tangent flow.
    reason : str or None
        Why it has not converged, or is not certified because it was found by simulation.
    period : int
        Forcing periods, as asked for or found.
    stops : ndarray of int, shape (k,)
        +1 A, -1 C, of the impacts in order.
    phases, times, velocities : ndarray of shape (k,)
        omega t, t with the forcing f sin(omega t), and the signed velocity of mass 1 before the impact. Of a motion
        found by simulation its contacts in a period from phase 0 on, those of a complete chatter that were followed.
    sticking : Sticking
        Rests on a stop in a period from phase 0 on; none where it was found by equations.
    residual : float
        Of the equations of impact, relative; of a simulation by how much it does not close, over the clearance.
    kantorovich, radius : float
        Up to 1/2, exactly one orbit lies within the radius (phases in radians, velocities relative): `certified`.
    certified : bool
    multipliers : ndarray of complex, shape (2N,)
        By falling modulus.
    stable, physical, admissible : bool
        All multipliers inside the unit circle; no impact has a velocity of the wrong sign; and no other contact.
    contacts : {"none", "some", "undecided", "not searched"}
        With a stop besides the impacts.
    excess, excess_phase, excess_stop : float, float, int
        How far beyond a stop mass 1 is at the highest turning point between its impacts (negative: inside, minus
        infinity or NaN where it does not turn), when, and which stop; 0 for none.
    start : State
        At phase 0: the `initial` of a trajectory that runs along the orbit.
    motion : Motion
        Its name; `motion.certified` where the orbit is certified and admissible.
    """

    process: ClassVar[str] = "periodic-orbits"

    omega: float
    clearance: float
    converged: bool
    found_by: str
    reason: str | None
    period: int
    stops: IntArray
    phases: FloatArray
    times: FloatArray
    velocities: FloatArray
    sticking: Sticking
    residual: float
    kantorovich: float
    radius: float
    certified: bool
    multipliers: ComplexArray
    stable: bool
    physical: bool
    admissible: bool
    contacts: str
    excess: float
    excess_phase: float
    excess_stop: int
    start: State
    motion: Motion

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        numbers = ("omega", "clearance", "residual", "kantorovich", "radius", "excess", "excess_phase")
        flags = ("converged", "certified", "stable", "physical", "admissible")
        start, rests = document["start"], document["sticking"]
        return {
            **{name: float(floats(document[name])) for name in numbers},
            **{name: bool(document[name]) for name in flags},
            **{name: int(document[name]) for name in ("period", "excess_stop")},
            **{name: floats(document[name]) for name in ("phases", "times", "velocities")},
            "reason": document["reason"],
            "found_by": str(document["found_by"]),
            "sticking": Sticking(floats(rests["start"]), floats(rests["stop_time"]), integers(rests["stop"])),
            "contacts": str(document["contacts"]),
            "stops": integers(document["stops"]),
            "multipliers": _complex(document["multipliers"]),
            "start": State(floats(start["displacement"]), floats(start["velocity"]), float(start["phase"])),
            "motion": Motion.model_validate(document["motion"]),
        }

    @property
    def said(self) -> str:
        """What the orbit is, in a word or two."""
        if not self.converged:
            return "not found"
        if not self.admissible:
            return "no motion: not admissible"
        return "stable" if self.stable else "unstable"

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the multipliers and the unit circle; the orbit itself is a trajectory with ``initial=orbit.start``."""
        from grazemap.plots.orbits import plot_multipliers

        return plot_multipliers(self, ax)

    def _summary(self) -> str:
        if not self.converged:
            return f"not found: {self.reason}"
        return f"{self.motion.label}, {self.said}" + (", by simulation" if self.found_by == "simulation" else "")


@dataclass(frozen=True, eq=False)
class Beyond:
    """An orbit of another branch that passes through a special point, next to it.

    Attributes
    ----------
    admissible : bool
        It is a motion.
    request : dict
        Its question, oscillator, omega, clearance and motion: ``client.periodic_orbit(**beyond.request)``, or
        ``client.orbit_branch(**beyond.request, range=...)`` for the branch that it belongs to.
    """

    admissible: bool
    request: dict[str, Any]


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A special point of a branch.

    Attributes
    ----------
    type : {"SN", "PD", "SB", "NS", "GR"}
        Saddle-node, period doubling, symmetry breaking, Neimark-Sacker, graze.
    parameter, clearance, omega, restitution : float
    status : {"converged", "guess"}
    admissible : bool
        The orbit there is a motion; of a graze: the orbits on one side of it are.
    segment : int
        It lies between this point of the branch and the next.
    phases, velocities : ndarray of shape (k,)
        Of its impacts.
    stop, phase, impact : int, float, int, or None
        Of a graze: where, when, and which impact vanishes; None where a further contact appears.
    beyond : tuple of Beyond
        What can be switched to: of a PD or SB the orbit that is born, or the one that this branch ends on; of a GR the
        orbit with an impact more, or less, of symmetric motions on both stops and, second, on one of them.
    """

    type: str
    parameter: float
    clearance: float
    omega: float
    restitution: float
    status: str
    admissible: bool
    segment: int
    phases: FloatArray
    velocities: FloatArray
    stop: int | None = None
    phase: float | None = None
    impact: int | None = None
    beyond: tuple[Beyond, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class OrbitBranch(Result):
    """A branch of periodic motions, m of them with k impacts each, in the order of the branch.

    Attributes
    ----------
    parameter, omega, clearance, restitution : ndarray of shape (m,)
    stops : ndarray of int, shape (k,)
    period : int
    symmetric : bool
        The second half of the period is the mirror image of the first.
    phases, velocities : ndarray of shape (m, k)
        As in `PeriodicOrbit`, but phases change smoothly along the branch; `motion(i)` is a row as a question takes it.
        An impact whose velocity has not its stop's sign is virtual.
    multipliers : ndarray of complex, shape (m, 2N)
    stable, admissible : ndarray of bool, shape (m,)
    excess, residual : ndarray of shape (m,)
    special_points : tuple of SpecialPoint
    ends : tuple of two str
        Why the branch ends before its first point, and behind its last.
    reason : str or None
        Why there are no points at all.
    """

    process: ClassVar[str] = "orbit-branches"

    parameter: FloatArray
    omega: FloatArray
    clearance: FloatArray
    restitution: FloatArray
    stops: IntArray
    period: int
    symmetric: bool
    phases: FloatArray
    velocities: FloatArray
    multipliers: ComplexArray
    stable: NDArray[np.bool_]
    admissible: NDArray[np.bool_]
    excess: FloatArray
    residual: FloatArray
    special_points: tuple[SpecialPoint, ...]
    ends: tuple[str, ...]
    reason: str | None

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        stops = integers(document["stops"])
        rows = ("phases", "velocities")
        numbers = ("parameter", "omega", "clearance", "restitution", "excess", "residual")
        return {
            **{name: floats(document[name]) for name in numbers},
            **{name: floats(document[name]).reshape(-1, len(stops)) for name in rows if len(stops)},
            **{name: np.zeros((0, 0)) for name in rows if not len(stops)},
            **{name: np.asarray(document[name], dtype=np.bool_) for name in ("stable", "admissible")},
            "stops": stops,
            "period": int(document["period"]),
            "symmetric": bool(document["symmetric"]),
            "multipliers": _complex(document["multipliers"]),
            "special_points": tuple(_special(record) for record in document["special_points"]),
            "ends": tuple(str(end) for end in document["ends"]),
            "reason": document["reason"],
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the speeds of the impacts over the parameter: stable solid, unstable dashed, special points marked."""
        from grazemap.plots.orbits import plot_branch

        return plot_branch(self, ax)

    def plot_multipliers(self, ax: Axes | None = None) -> Axes:
        """Draw the multipliers of all orbits and the unit circle, coloured by the parameter."""
        from grazemap.plots.orbits import plot_branch_multipliers

        return plot_branch_multipliers(self, ax)

    def motion(self, index: int) -> dict[str, Any]:
        """Return an orbit of the branch as the `motion` of `periodic_orbit` or `orbit_branch`, at its parameter.

        It is one at omega[index] and clearance[index], with the restitution[index].
        """
        return {
            "period": self.period,
            "stops": self.stops.tolist(),
            "phases": self.phases[index].tolist(),
            "velocities": self.velocities[index].tolist(),
        }

    def _summary(self) -> str:
        if not len(self.parameter):
            return f"no points: {self.reason}"
        types = " ".join(point.type for point in self.special_points)
        return f"{len(self.parameter)} points, {types or 'no special points'}"


def _complex(pairs: Any) -> ComplexArray:
    values = floats(pairs)
    if not values.size:
        return np.zeros(values.shape[:-1] if values.ndim > 1 else (0, 0), dtype=np.complex128)
    joined: ComplexArray = values[..., 0] + 1j * values[..., 1]
    return joined


def _special(record: Any) -> SpecialPoint:
    values = known_fields(SpecialPoint, record)
    beyond = tuple(
        Beyond(admissible=bool(one["admissible"]), request=_plain(one["request"])) for one in values.get("beyond", ())
    )
    arrays = {name: floats(values[name]) for name in ("phases", "velocities")}
    return SpecialPoint(**(values | arrays | {"beyond": beyond}))


def _plain(value: Any) -> Any:
    """Return a question as plain values, whichever way it has travelled."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else value
