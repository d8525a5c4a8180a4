"""Basins of attraction: which motion every initial state of a rectangle leads to; basin fractions along a parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from grazemap.results.base import Result, counted, counted_points
from grazemap.results.common_records import (
    CHANCE,
    KINDS,
    PERIODIC_MOTIONS,
    ChanceToSettle,
    Common,
    Motion,
    MotionShare,
)
from grazemap.results.diagrams import BifurcationDiagram
from grazemap.results.fields import RecordSchema
from grazemap.results.observables import OBSERVABLES
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, FloatArray, IntArray, Record, field, named_field
from grazemap.results.unfolding import LABEL, UnfoldingMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_PLANE, _ALONG = "vertical horizontal", "attractor parameter"
_MEASURED = "of evenly spaced values"
_ATTRACTOR_MOTION = field("The name of the attractor, or its kind.", "attractor", type="str")


class Attractor(Record):
    """A motion that initial states lead to; those that are not periodic are distinguished by their kind only."""

    kind: str = field(Motion, values=KINDS[:-1])
    label: str | None = field(Motion)
    period: int | None = field(Motion)
    impacts_right: int | None = field(Motion)
    impacts_left: int | None = field(Motion)
    symmetric: bool | None = field(Motion)
    sticking: bool | None = field(Motion)
    mean_position: float | None = field(
        "Mean distance of the contact coordinate from the steady motion at the initial phase of the "
        "forcing, divided by the clearance.",
        when=PERIODIC_MOTIONS,
    )
    mean_velocity: float | None = field(
        "The same for the velocity, over p omega times the clearance.", when=PERIODIC_MOTIONS
    )
    multiplier: float | None = field("Largest modulus of the multipliers over one period.", when=PERIODIC_MOTIONS)
    lyapunov: float | None = field("Largest Lyapunov exponent per forcing period.", when="where it is known")
    verified: bool = field(
        Common, description="Whether a periodic motion is verified for every state that leads to it."
    )
    states: int = field("Initial states that lead to it.")
    share: float = field("Fraction of all initial states.")

    @property
    def motion(self) -> MotionShare:
        """The motion and its share, for pictures and legends."""
        return MotionShare(self.label or self.kind, self.kind, *_counts(self), self.states, self.share)


class BasinEntropy(Record):
    """How mixed the motions are in the boxes of a rectangle of states (Daza et al. 2016), in nats."""

    box: int = field("Number of states along a side of a box.")
    boxes: int = field("Number of boxes that have states whose motion is resolved.")
    boundary_boxes: int = field("Number of boxes with more than one attractor.")
    entropy: float = field("S_b: mean entropy of the attractors in a box.")
    boundary_entropy: float = field("S_bb: the mean over the boundary boxes.", null=True)
    standard_error: float = field("Standard error of S_bb, from the spread of the boxes.", null=True)
    fractal: bool = field(
        "Whether S_bb exceeds log 2 by three standard errors, which smooth boundaries do not. Where it does not, "
        "the boundary may be smooth or fractal; of two attractors it never does."
    )

    def __str__(self) -> str:
        if not self.boundary_boxes:
            return "no box on a boundary"
        verdict = ", above log 2: a fractal boundary" if self.fractal else ""
        return f"basin entropy {self.entropy:.3g}, on the boundary {self.boundary_entropy:.3g}{verdict}"


class Uncertainty(Record):
    """The share of uncertain states by distance, and the exponent of its power law (Grebogi et al. 1983)."""

    distance: IntArray = field("In steps of the rectangle, along either side.", "distance", coordinate=True)
    share: FloatArray = field(
        "Share of the resolved states with a state within the distance that leads to another attractor.", "distance"
    )
    exponent: float = field("alpha: slope of log share over log distance.", null=True)
    standard_error: float = field(
        "Standard error of the slope, from the residuals; the finite rectangle adds a bias of some hundredths.",
        null=True,
    )
    boundary_dimension: float = field("Box dimension of the boundary in the rectangle: 2 - alpha.", null=True)

    def __str__(self) -> str:
        if np.isnan(self.exponent):
            return "no uncertainty exponent"
        return f"uncertainty exponent {self.exponent:.3f} ± {self.standard_error:.3f}"


class Basins(
    Result,
    process="basins",
    derived={
        "motion": field(LABEL, _PLANE),
        "attractor_motion": _ATTRACTOR_MOTION,
    },
):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance."""

    horizontal: FloatArray = field("Values of the first initial coordinate.", "horizontal")
    vertical: FloatArray = field("Values of the second initial coordinate.", "vertical")
    label: IntArray = field("Position in `attractors`; -1 where the motion is unresolved.", _PLANE, dtype="int16")
    attractors: tuple[Attractor, ...] = field(
        "The motions found, the most frequent first.", "attractor", prefix="attractor_"
    )
    settled_after: IntArray = field(
        "Forcing periods after which the trajectory had settled; -1 where the motion is not periodic.",
        _PLANE,
        "forcing periods",
        dtype="int32",
    )
    lyapunov: FloatArray = field("Largest Lyapunov exponent per forcing period.", _PLANE, null=True)
    verified: BoolArray = field(
        Common,
        _PLANE,
        description="The state leads to an orbit that is verified and captures the trajectory, which is not sensitive.",
    )
    sensitive: BoolArray = field(Common, _PLANE)
    transient_growth: FloatArray = field(Common, _PLANE)
    reason: IntArray = field(
        "Why a state is unresolved, or leads to a periodic motion that is not verified.",
        _PLANE,
        dtype="int8",
        index_of="reasons",
    )
    reasons: tuple[str, ...] = field("The reasons.", "reason", variable=None)
    basin_entropy: BasinEntropy | None = field(
        "The entropy of the boxes.", when=f"{_MEASURED}, at least 5 a side", prefix="entropy_"
    )
    uncertainty: Uncertainty | None = field(
        "The uncertainty exponent.", when=f"{_MEASURED}, at least 64 a side", prefix="uncertainty_"
    )
    chance_to_settle: ChanceToSettle | None = field(CHANCE, when="where states lead to chaos")

    @property
    def unresolved(self) -> float:
        """Share of the states whose motion is unresolved."""
        return float((self.label < 0).mean())

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """Return the names of the motions, of every state and of every attractor, as codes and texts."""
        names = [attractor.label or attractor.kind for attractor in self.attractors]
        every = np.where(self.label < 0, len(names), self.label)
        return {"motion": (every, [*names, "unresolved"]), "attractor_motion": (np.arange(len(names)), names)}

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        colours: Mapping[str, str] | None = None,
        hatching: bool = True,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the rectangle, every state in the colour of the motion that it leads to.

        `colours` gives colours by label or kind. `hatching` marks the sensitive states.
        """
        return draw(self, ax, options, colours=colours, hatching=hatching)

    def _summary(self) -> str:
        rows, columns = self.label.shape
        summary = (
            f"{rows} x {columns} states, {counted(self.attractors, 'attractor')}, "
            f"{counted_points(self.sensitive, 'sensitive')}"
        )
        summary += "".join(f", {measure}" for measure in (self.basin_entropy, self.uncertainty) if measure is not None)
        return summary if self.chance_to_settle is None else f"{summary}, {self.chance_to_settle}"


class ContinuedAttractor(Record):
    """A motion that initial states lead to at several values of a parameter; it has one name at all of them."""

    kind: str = field(Attractor)
    label: str | None = field(Attractor)
    period: int | None = field(Attractor)
    impacts_right: int | None = field(Attractor)
    impacts_left: int | None = field(Attractor)
    symmetric: bool | None = field(Attractor)
    sticking: bool | None = field(Attractor)
    first: float = field("The smallest value at which it was found.")
    last: float = field("The largest value at which it was found.")
    found: int = field("Number of values at which it was found.")


class BasinFractions(
    Result,
    process="basin-fractions",
    derived={"attractor_motion": _ATTRACTOR_MOTION},
):
    """The shares of random initial states that lead to each attractor, along one parameter."""

    parameter: FloatArray = field(BifurcationDiagram)
    attractors: tuple[ContinuedAttractor, ...] = field(
        "The motions found, in the order of the values at which they are met, then of their shares there.",
        "attractor",
        prefix="attractor_",
    )
    states: IntArray = field("Initial states that lead to the attractor; 0 where it was not found.", _ALONG)
    share: FloatArray = field(Attractor, _ALONG)
    share_error: FloatArray = field("Binomial standard error of the share.", _ALONG)
    mean_position: FloatArray = field(Attractor, _ALONG, null=True, when="")
    mean_velocity: FloatArray = field(Attractor, _ALONG, null=True, when="")
    multiplier: FloatArray = field(Attractor, _ALONG, null=True, when="")
    lyapunov: FloatArray = field(Attractor, _ALONG, null=True, when="")
    verified: BoolArray = field(Attractor, _ALONG)
    unresolved: FloatArray = field("Share of the states whose motion is unresolved.", "parameter")
    unresolved_error: FloatArray = field("Binomial standard error of that share.", "parameter")
    sensitive: FloatArray = field("Share of the states whose trajectories are sensitive.", "parameter")
    displacement: FloatArray = field("The range of each initial displacement.", "mass end", "m")
    velocity: FloatArray = field("The range of each initial velocity.", "mass end", "m/s")
    chance_to_settle: ChanceToSettle | None = field(CHANCE, when="where states lead to chaos")

    @property
    def vary(self) -> str:
        """The name of the parameter that varies."""
        return str(self.meta["request"]["axis"]["vary"])

    def motions(self) -> tuple[MotionShare, ...]:
        """Return the motion of every attractor, with its states and its share over all values together."""
        names = (
            (attractor.label or attractor.kind, attractor.kind, *_counts(attractor)) for attractor in self.attractors
        )
        shares = zip(self.states.sum(axis=1).tolist(), self.share.mean(axis=1).tolist(), strict=True)
        return tuple(MotionShare(*name, *share) for name, share in zip(names, shares, strict=True))

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """Return the names of the attractors as codes and texts."""
        names = [attractor.label or attractor.kind for attractor in self.attractors]
        return {"attractor_motion": (np.arange(len(names)), names)}

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        motions: int = 12,
        colours: Mapping[str, str] | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the shares over the parameter, as areas on top of each other.

        `motions` is the number of attractors with a colour of their own. `colours` gives colours by label or kind.
        """
        return draw(self, ax, options, motions=motions, colours=colours)

    def _summary(self) -> str:
        summary = f"{counted(self.parameter, 'value')} of {self.vary}, {counted(self.attractors, 'attractor')}"
        return summary if self.chance_to_settle is None else f"{summary}, {self.chance_to_settle}"


def _counts(attractor: Attractor | ContinuedAttractor) -> tuple[int | None, int | None, int | None]:
    return attractor.period, attractor.impacts_right, attractor.impacts_left


TILE_OF_BASINS = RecordSchema(
    "TileOfBasins",
    "The motions that the initial states of a part of the rectangle lead to, before attractors are distinguished. For "
    "basin fractions, the motions at some values of the parameter, for some of the states.",
    (
        *(
            member.varied(index_of="")
            for member in UnfoldingMap.schema
            if member.dims == UnfoldingMap.schema["kind"].dims
            and member.name not in ("computed", "resolved", *OBSERVABLES)
        ),
        *(
            named_field(name, field("As for an attractor.", _PLANE, null=True))
            for name in ("mean_position", "mean_velocity")
        ),
    ),
)
"""The schema of a tile of basins and of basin fractions."""
