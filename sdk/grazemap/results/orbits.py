"""Periodic motions with impacts, and their branches over a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.results.base import Result, counted
from grazemap.results.common_records import Common, Motion, State, Sticking
from grazemap.results.curves import BifurcationCurve, PlaneCurve
from grazemap.results.fields import RequestDocument
from grazemap.results.observables import Observed, quantity_of
from grazemap.results.other_motions import OtherStarts
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, ComplexArray, FloatArray, IntArray, Record, field
from grazemap.results.stretches import Knots, Stretch, knots_of, stretches_of
from grazemap.results.trajectory import Trajectory
from grazemap.wire.planes import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_PHASES = "Phases omega t of the impacts, with the forcing f sin(omega t)."
_VELOCITIES = "Velocities of the contact before each impact, signed."
_EXCESS = "Maximum distance of the contact beyond a stop between the impacts; negative: it stays inside."
_MULTIPLIERS = "Floquet multipliers, by decreasing modulus."
_UNLIKE = "where the stops differ or one is absent"
_GENERAL = "where the stops differ, or one of these varies"
_GRAZES = "of grazes"
CLOSED = "the curve is closed: it comes back to where it began"
"""What `ends` of a closed branch say."""


class PeriodicOrbit(Observed, Result, process="periodic-orbits", rows="impact"):
    """A periodic motion with impacts; where `converged` is false, `reason` says why there is none."""

    omega: float = field(Common)
    clearance: float = field(
        Common, description="Distance of each stop from the middle; null where the stops differ.", null=True
    )
    clearance_right: float | None = field(
        "Distance of the right stop from q = 0; null: absent.", unit="m", when=_UNLIKE, null=True
    )
    clearance_left: float | None = field(
        "Distance of the left stop from q = 0; null: absent.", unit="m", when=_UNLIKE, null=True
    )
    converged: bool = field("Whether an orbit was found.")
    found_by: str = field(
        "equations: solved for by Newton's method; simulation: simulated until it closes, because the contact "
        "rests on a stop.",
        values=("equations", "simulation"),
    )
    reason: str | None = field("Why no orbit was found, or why it is not verified.")
    period: int = field("The period, as requested or found.", unit="forcing periods")
    stops: IntArray = field("Stops of the impacts in order: +1 right, -1 left.", "impact", variable="impact_stops")
    phases: FloatArray = field(_PHASES, "impact", "rad", variable="impact_phases")
    times: FloatArray = field("The times of the impacts, from phase 0 on.", "impact", "s", variable="impact_times")
    velocities: FloatArray = field(_VELOCITIES, "impact", "m/s", variable="impact_velocity")
    sticking: Sticking = field(
        "Rests on a stop in a period from phase 0 on; only of a simulation.",
        prefix="sticking_",
        type=Sticking.schema.varied(stop={"dtype": "int64"}),
    )
    residual: float = field(
        "Relative residual of the equations of the impacts; for a simulation, the distance between the start and "
        "the state a period later, divided by the clearance.",
        null=True,
    )
    kantorovich: float = field("Newton-Kantorovich number; isolated if at most 1/2.", null=True)
    radius: float = field(
        "Radius within which exactly one orbit lies; phases p omega t in radians, velocities relative.", null=True
    )
    isolated: bool = field(Common)
    admissible: bool = field(Common)
    stable: bool = field(Common)
    verified: bool = field(Common)
    multipliers: ComplexArray = field(_MULTIPLIERS, "multiplier", null=True)
    physical: bool = field("Whether every impact velocity is directed towards its stop.")
    contacts: str = field(
        "Number of contacts with a stop other than the impacts.", values=("none", "some", "undecided", "not searched")
    )
    excess: float = field(_EXCESS, unit="m", null=True)
    excess_phase: float = field("Phase of the maximum in `excess`.", unit="rad", null=True)
    excess_stop: int = field("Stop of the maximum in `excess`: +1 right, -1 left, 0 none.")
    start: State = field("The state at phase 0; a trajectory from there follows the orbit.", prefix="start_")
    motion: Motion = field("Its name.", variable="label")
    other_starts: OtherStarts | None = field(Trajectory)

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
        by = ", by simulation" if self.found_by == "simulation" else ""
        summary = f"{self.motion.label}, {self.said}{by}" if self.converged else f"not found: {self.reason}"
        return summary if self.other_starts is None else f"{summary}, {self.other_starts}"


class Beyond(Record):
    """An orbit near a special point, on another branch through this point."""

    admissible: bool = field(Common)
    request: dict[str, Any] = field(
        "Its request: post it unchanged to `/v1/periodic-orbits`, or with an `axis` to `/v1/orbit-branches`.",
        type=RequestDocument("periodic-orbits"),
    )


class SpecialPoint(Record):
    """A special point of a branch."""

    type: str = field(PlaneCurve)
    parameter: float = field("Value of the parameter that varies.", variable=None)
    clearance: float = field(PeriodicOrbit)
    omega: float = field(Common)
    restitution: float = field("Speed after an impact divided by the speed before it.", null=True)
    clearance_right: float | None = field(PeriodicOrbit, when=_GENERAL)
    clearance_left: float | None = field(PeriodicOrbit, when=_GENERAL)
    restitution_right: float | None = field("Restitution of the right stop.", when=_GENERAL)
    restitution_left: float | None = field("Restitution of the left stop.", when=_GENERAL)
    bias: float | None = field("Factor of the bias of the request.", when=_GENERAL)
    forcing: float | None = field("Factor of the forces of the request.", when=_GENERAL)
    status: str = field("Whether it was solved for to round-off (converged).", values=("converged", "guess"))
    reason: str | None = field("Why it was not solved for.", when="of guesses", variable=None)
    admissible: bool = field(
        Common, description="Whether the orbit there is admissible; for a graze, whether the orbits on one side are."
    )
    segment: int = field("The special point lies between this point of the branch and the next.")
    phases: FloatArray = field(_PHASES, "impact", "rad", variable=None)
    velocities: FloatArray = field(_VELOCITIES, "impact", "m/s", variable=None)
    stop: int | None = field("The stop that is grazed: +1 right, -1 left.", when=_GRAZES)
    phase: float | None = field("Forcing phase of the graze.", unit="rad", when=_GRAZES)
    impact: int | None = field(BifurcationCurve)
    beyond: tuple[Beyond, ...] = field(
        "Orbits of other branches: with twice the period at a PD, without the symmetry at an SB, with one impact "
        "more or less at a GR.",
        "beyond",
        variable=None,
    )


class OrbitBranch(
    Observed, Result, process="orbit-branches", rows="point", dimensions="point", outputs="OutputOfBranch"
):
    """A branch of periodic motions over a parameter, in the order of the branch."""

    parameter: FloatArray = field("The parameter that varies.", "point", coordinate=True)
    omega: FloatArray = field(Common, "point")
    clearance: FloatArray = field(SpecialPoint, "point")
    restitution: FloatArray = field(SpecialPoint, "point")
    clearance_right: FloatArray | None = field(SpecialPoint, "point")
    clearance_left: FloatArray | None = field(SpecialPoint, "point")
    restitution_right: FloatArray | None = field(SpecialPoint, "point")
    restitution_left: FloatArray | None = field(SpecialPoint, "point")
    bias: FloatArray | None = field(SpecialPoint, "point")
    forcing: FloatArray | None = field(SpecialPoint, "point")
    stops: IntArray = field("Stops of the impacts in order: +1 right, -1 left.", "impact")
    period: int = field("Period of the orbits.", unit="forcing periods", variable=None)
    symmetric: bool = field("Whether the second half of the period is the mirror image of the first.", variable=None)
    phases: FloatArray = field(_PHASES + " They are continuous along the branch.", "point impact", "rad")
    velocities: FloatArray = field(_VELOCITIES + " Away from the stop: a virtual impact.", "point impact", "m/s")
    multipliers: ComplexArray = field(_MULTIPLIERS, "point multiplier", null=True)
    isolated: BoolArray = field(Common, "point")
    admissible: BoolArray = field(Common, "point")
    stable: BoolArray = field(Common, "point")
    verified: BoolArray = field(Common, "point")
    excess: FloatArray = field(_EXCESS, "point", "m", null=True)
    residual: FloatArray = field("Relative residual of the equations of the impacts.", "point", null=True)
    special_points: tuple[SpecialPoint, ...] = field(
        "The points SN, PD, SB, NS and GR, in the order of the branch.", "special", prefix="special_"
    )
    ends: tuple[str, ...] = field(
        "Why the branch is not followed beyond its first and its last point. Its motions may end before, at a GR.",
        "end",
        variable=None,
    )
    reason: str | None = field("Why there are no points.", variable=None)

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
        once. `colour` is the colour of the motions. `label` is the name of the branch in the legend, for several
        branches on one axes. With a `quantity`, an observable such as "dissipated_power" or an output such as
        "spring_rms", its values are drawn instead. Raises ValueError for a quantity that the request did not ask for.
        """
        if quantity is not None and not isinstance(quantity, str):
            quantity, ax = None, quantity
        shown = None if quantity is None else quantity_of(self, quantity)
        return draw(self, ax, options, quantity=shown, colour=colour, label=label)

    @picture
    def plot_multipliers(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the multipliers of all orbits and the unit circle, coloured by the parameter."""
        return draw(self, ax, options, "plot_multipliers")

    @property
    def closed(self) -> bool:
        """Whether the branch comes back to where it began: its last point is within a step of its first."""
        return set(self.ends) == {CLOSED}

    def knots(self) -> Knots:
        """Return the orbits and the special points in one order, and the kind of the orbits between them."""
        return knots_of(self)

    def stretches(self) -> list[Stretch]:
        """Return where the motions of the branch are stable, unstable or not admissible, and at what each part ends.

        A part also ends where the parameter turns. If it turns at an SB, the branch goes back as its own mirror image;
        if at a PD, as the same motions some forcing periods later. Then the parts repeat in reverse.
        """
        return stretches_of(self)

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """Return the table "stretches"."""
        return {"stretches": self.stretches()}

    def derived_units(self) -> dict[str, str]:
        """Return the unit of the ends of stretches."""
        return dict.fromkeys(("begins", "ends"), unit_of(self.meta["request"]["axis"]["vary"]))

    def motion(self, index: int) -> dict[str, Any]:
        """Return an orbit of the branch as the `motion` of `periodic_orbit` or `orbit_branch`, at its parameter.

        The parameters of the orbit are omega[index], clearance[index] and restitution[index], or the clearance and the
        restitution of each stop, bias[index] and forcing[index].
        """
        lists = {"phases": self.phases[index].tolist(), "velocities": self.velocities[index].tolist()}
        return {"period": self.period, "stops": self.stops.tolist(), **lists}

    def _summary(self) -> str:
        if not len(self.parameter):
            return f"no points: {self.reason}"
        types = " ".join(point.type for point in self.special_points)
        return f"{counted(self.parameter, 'point')}, {types or 'no special points'}"
