"""Periodic motions with impacts, and their branches over a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.results.base import Result, counted
from grazemap.results.observables import Observed, quantity_of
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    Motion,
    State,
    Sticking,
    described,
)
from grazemap.results.stretches import Knots, Stretch, knots_of, stretches_of
from grazemap.schema.orbits import BEYOND, SPECIAL_POINT

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class PeriodicOrbit(Observed, Result):
    """A periodic motion with impacts; where `converged` is false, `reason` says why there is none."""

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
    isolated: bool
    admissible: bool
    stable: bool
    verified: bool
    multipliers: ComplexArray
    physical: bool
    contacts: str
    excess: float
    excess_phase: float
    excess_stop: int
    start: State
    motion: Motion
    clearance_right: float | None = None
    clearance_left: float | None = None

    @property
    def oscillator(self) -> dict[str, Any]:
        """The oscillator of the request."""
        oscillator: dict[str, Any] = self.meta["request"]["oscillator"]
        return oscillator

    def statement(self) -> dict[str, Any]:
        """Return the statement of proofs that the orbit exists, and is stable or not, with the numbers of the orbit."""
        if not self.converged or not len(self.stops):
            raise ValueError("a statement on an orbit needs its impacts, and this result has none")
        motion = {"period": self.period, "stops": self.stops.tolist()}
        motion |= {"phases": self.phases.tolist(), "velocities": self.velocities.tolist()}
        place = {"omega": self.omega, "clearance": self.meta["request"]["clearance"]}
        return {"kind": "orbit", **place, "motion": motion, "stable": self.stable}

    @property
    def said(self) -> str:
        """The properties of the orbit in a few words."""
        if not self.converged:
            return "not found"
        if not self.admissible:
            return "no motion: not admissible"
        return "stable" if self.stable else "unstable"

    @picture
    def plot(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the multipliers and the unit circle; the orbit itself is a trajectory with ``initial=orbit.start``."""
        return draw(self, ax, options)

    def _summary(self) -> str:
        if not self.converged:
            return f"not found: {self.reason}"
        return f"{self.motion.label}, {self.said}" + (", by simulation" if self.found_by == "simulation" else "")


@described(BEYOND)
class Beyond:
    """An orbit of another branch that passes through a special point, next to it."""

    admissible: bool
    request: dict[str, Any]


@described(SPECIAL_POINT)
class SpecialPoint:
    """A special point of a branch."""

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
    reason: str | None = None
    stop: int | None = None
    phase: float | None = None
    impact: int | None = None
    clearance_right: float | None = None
    clearance_left: float | None = None
    restitution_right: float | None = None
    restitution_left: float | None = None
    bias: float | None = None
    forcing: float | None = None
    beyond: tuple[Beyond, ...] = ()


class OrbitBranch(Observed, Result):
    """A branch of periodic motions, m of them with k impacts each, in the order of the branch."""

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
    isolated: BoolArray
    admissible: BoolArray
    stable: BoolArray
    verified: BoolArray
    excess: FloatArray
    residual: FloatArray
    special_points: tuple[SpecialPoint, ...]
    ends: tuple[str, ...]
    reason: str | None
    clearance_right: FloatArray | None = None
    clearance_left: FloatArray | None = None
    restitution_right: FloatArray | None = None
    restitution_left: FloatArray | None = None
    bias: FloatArray | None = None
    forcing: FloatArray | None = None

    @picture
    def plot(
        self,
        quantity: str | Axes | None = None,
        ax: Axes | None = None,
        *,
        colour: str | None = None,
        label: str | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the speeds of the impacts over the parameter: stable solid, unstable dashed, special points marked.

        A branch that turns at an SB or a PD has the same motions, or their mirror images, beyond it: they are drawn
        once. `colour` is that of motions, and `label` the name of the branch in the legend, for several on one axes.
        With a `quantity`, an observable such as "dissipated_power" or an output such as "spring_rms", its values are
        drawn instead. Raises ValueError for one that was not asked for.
        """
        if quantity is not None and not isinstance(quantity, str):
            quantity, ax = None, quantity
        shown = None if quantity is None else quantity_of(self, quantity)
        return draw(self, ax, options, quantity=shown, colour=colour, label=label)

    @picture
    def plot_multipliers(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the multipliers of all orbits and the unit circle, coloured by the parameter."""
        return draw(self, ax, options, "plot_multipliers")

    def knots(self) -> Knots:
        """Return the orbits and the special points in one order, and the kind of the orbits between them."""
        return knots_of(self)

    def stretches(self) -> list[Stretch]:
        """Return where the motions of the branch are stable, unstable or not admissible, and at what each part ends.

        A part also ends where the parameter turns. From an SB at which it turns, the branch goes back as its own mirror
        image, and from such a PD as the same motions, some forcing periods later: the parts repeat in reverse.
        """
        return stretches_of(self)

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """As `Result.derived_tables`."""
        return {"stretches": self.stretches()}

    def motion(self, index: int) -> dict[str, Any]:
        """Return an orbit of the branch as the `motion` of `periodic_orbit` or `orbit_branch`, at its parameter.

        Its parameters are omega[index], clearance[index] and restitution[index], or those of each stop, bias[index] and
        forcing[index].
        """
        lists = {"phases": self.phases[index].tolist(), "velocities": self.velocities[index].tolist()}
        return {"period": self.period, "stops": self.stops.tolist(), **lists}

    def _summary(self) -> str:
        if not len(self.parameter):
            return f"no points: {self.reason}"
        types = " ".join(point.type for point in self.special_points)
        return f"{counted(self.parameter, 'point')}, {types or 'no special points'}"
