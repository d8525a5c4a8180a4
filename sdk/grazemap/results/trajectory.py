"""Trajectories with every impact: one, or one from each of many states."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.codec import Document
from grazemap.results.base import Result, counted
from grazemap.results.observables import Observed
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import FloatArray, Impacts, Motion, State, Sticking

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Trajectory(Observed, Result):
    """One trajectory with every impact."""

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    impacts: Impacts
    sticking: Sticking
    undecided: int
    motion: Motion
    final: State | None

    @picture
    def plot(
        self, ax: tuple[Axes, Axes] | Axes | None = None, *, mass: int | None = None, **options: Unpack[PictureOptions]
    ) -> tuple[Axes, Axes]:
        """Draw the time history of the contact, or of one mass, and its phase portrait; return both axes.

        `ax` is both axes, or one for the time history alone.
        """
        return draw(self, ax, options, mass=mass)

    def _summary(self) -> str:
        return f"{counted(self.impacts, 'impact')}, motion {self.motion.label or self.motion.kind}"


class Trajectories(Result):
    """One trajectory from each of many initial states."""

    trajectories: tuple[Trajectory, ...]

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        # the meta of each trajectory has the request with its own state
        records, states = document["trajectories"], meta["request"]["initial"]
        single = (
            Trajectory.from_document(record, {**meta, "request": {**meta["request"], "initial": state}})
            for record, state in zip(records, states, strict=True)
        )
        return {"trajectories": tuple(single)}

    def __len__(self) -> int:
        return len(self.trajectories)

    @picture
    def plot(
        self,
        ax: tuple[Axes, Axes] | Axes | None = None,
        *,
        mass: int | None = None,
        colours: Mapping[str, str] | None = None,
        **options: Unpack[PictureOptions],
    ) -> tuple[Axes, Axes]:
        """Draw the last periods of the contact, or of one mass, in the colours of the motions; return both axes.

        `ax` is both axes, or one for the time history alone. All that was recorded of one of them, with its impacts,
        is drawn by ``trajectories[i].plot()``. `colours` gives colours by label or kind.
        """
        return draw(self, ax, options, mass=mass, colours=colours)

    def _summary(self) -> str:
        found = Counter(path.motion.label or path.motion.kind for path in self.trajectories)
        motions = ", ".join(f"{count} x {name}" for name, count in found.most_common(5))
        return f"{len(self)} trajectories: {motions}{', ...' if len(found) > 5 else ''}"
