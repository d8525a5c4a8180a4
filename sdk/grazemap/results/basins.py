"""Basins of attraction: which motion every initial state of a rectangle leads to; basin fractions along a parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from grazemap.results.base import Result, counted, counted_points
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import BoolArray, ChanceToSettle, FloatArray, IntArray, MotionShare, described
from grazemap.schema.basins import ATTRACTOR, BASIN_ENTROPY, CONTINUED_ATTRACTOR, UNCERTAINTY

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@described(ATTRACTOR, comparable=True)
class Attractor:
    """A motion that initial states lead to."""

    kind: str
    states: int
    share: float
    label: str | None = None
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    mean_position: float | None = None
    mean_velocity: float | None = None
    multiplier: float | None = None
    lyapunov: float | None = None
    verified: bool = False

    @property
    def motion(self) -> MotionShare:
        """The motion and its share, for pictures and legends."""
        return MotionShare(self.label or self.kind, self.kind, *_counts(self), self.states, self.share)


@described(BASIN_ENTROPY, comparable=True)
class BasinEntropy:
    """How mixed the motions are in the boxes of a rectangle of states (Daza et al. 2016), in nats."""

    box: int
    boxes: int
    boundary_boxes: int
    entropy: float
    boundary_entropy: float
    standard_error: float
    fractal: bool

    def __str__(self) -> str:
        if not self.boundary_boxes:
            return "no box on a boundary"
        above = ", above log 2: a fractal boundary" if self.fractal else ""
        return f"basin entropy {self.entropy:.3g}, on the boundary {self.boundary_entropy:.3g}{above}"


@described(UNCERTAINTY)
class Uncertainty:
    """The share of uncertain states by distance, and the exponent of its power law (Grebogi et al. 1983)."""

    distance: IntArray
    share: FloatArray
    exponent: float
    standard_error: float
    boundary_dimension: float

    def __str__(self) -> str:
        if np.isnan(self.exponent):
            return "no uncertainty exponent"
        return f"uncertainty exponent {self.exponent:.3f} ± {self.standard_error:.3f}"


class Basins(Result):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance."""

    horizontal: FloatArray
    vertical: FloatArray
    label: IntArray
    attractors: tuple[Attractor, ...]
    settled_after: IntArray
    lyapunov: FloatArray
    reason: IntArray
    reasons: tuple[str, ...]
    verified: BoolArray | None = None
    sensitive: BoolArray | None = None
    transient_growth: FloatArray | None = None
    basin_entropy: BasinEntropy | None = None
    uncertainty: Uncertainty | None = None
    chance_to_settle: ChanceToSettle | None = None

    @property
    def unresolved(self) -> float:
        """Share of the states whose motion is unresolved."""
        return float((self.label < 0).mean())

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """As `Result.derived`."""
        named = [attractor.label or attractor.kind for attractor in self.attractors]
        every = np.where(self.label < 0, len(named), self.label)
        return {"motion": (every, [*named, "unresolved"]), "attractor_motion": (np.arange(len(named)), named)}

    @picture
    def plot(
        self, ax: Axes | None = None, *, colours: Mapping[str, str] | None = None, **options: Unpack[PictureOptions]
    ) -> Axes:
        """Draw the rectangle, every state in the colour of the motion that it leads to.

        `colours` gives colours by label or kind.
        """
        return draw(self, ax, options, colours=colours)

    def _summary(self) -> str:
        rows, columns = self.label.shape
        said = f"{rows} x {columns} states, {counted(self.attractors, 'attractor')}"
        said += "" if self.sensitive is None else f", {counted_points(self.sensitive, 'sensitive')}"
        said += "".join(f", {one}" for one in (self.basin_entropy, self.uncertainty) if one is not None)
        return said if self.chance_to_settle is None else f"{said}, {self.chance_to_settle}"


@described(CONTINUED_ATTRACTOR, comparable=True)
class ContinuedAttractor:
    """A motion that initial states lead to at several values of a parameter; it has one name at all of them."""

    kind: str
    first: float
    last: float
    found: int
    label: str | None = None
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None


class BasinFractions(Result):
    """The shares of random initial states that lead to each attractor, along one parameter."""

    parameter: FloatArray
    attractors: tuple[ContinuedAttractor, ...]
    states: IntArray
    share: FloatArray
    share_error: FloatArray
    mean_position: FloatArray
    mean_velocity: FloatArray
    multiplier: FloatArray
    lyapunov: FloatArray
    verified: BoolArray
    unresolved: FloatArray
    unresolved_error: FloatArray
    sensitive: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    chance_to_settle: ChanceToSettle | None = None

    @property
    def vary(self) -> str:
        """The name of the parameter that varies."""
        return str(self.meta["request"]["vary"])

    def motions(self) -> tuple[MotionShare, ...]:
        """Return the motion of every attractor, with its states and its share over all values together."""
        names = ((one.label or one.kind, one.kind, *_counts(one)) for one in self.attractors)
        shares = zip(self.states.sum(axis=1).tolist(), self.share.mean(axis=1).tolist(), strict=True)
        return tuple(MotionShare(*name, *share) for name, share in zip(names, shares, strict=True))

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """As `Result.derived`."""
        named = [attractor.label or attractor.kind for attractor in self.attractors]
        return {"attractor_motion": (np.arange(len(named)), named)}

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
        said = f"{counted(self.parameter, 'value')} of {self.vary}, {counted(self.attractors, 'attractor')}"
        return said if self.chance_to_settle is None else f"{said}, {self.chance_to_settle}"


def _counts(one: Attractor | ContinuedAttractor) -> tuple[int | None, int | None, int | None]:
    return one.period, one.impacts_right, one.impacts_left
