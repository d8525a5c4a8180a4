"""Trajectories with every impact: one, or one from each of many states."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.codec import Document
from grazemap.results.base import Result, counted
from grazemap.results.common_records import Impacts, Motion, State, Sticking
from grazemap.results.documents import meta_of_part
from grazemap.results.fields import RecordSchema
from grazemap.results.observables import Observed
from grazemap.results.other_motions import OtherStarts
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import FloatArray, field

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Trajectory(Observed, Result, process="trajectories", rows="time"):
    """One trajectory with every impact."""

    time: FloatArray = field("Times of the samples, from the start of the record.", "time", "s")
    displacement: FloatArray = field("Displacement of every mass.", "mass time", "m", null=True)
    velocity: FloatArray = field(
        "Velocity of every mass; at an impact, the one after it.", "mass time", "m/s", null=True
    )
    impacts: Impacts = field("Every contact with a stop.", prefix="impact_")
    sticking: Sticking = field("The rests on a stop.", prefix="sticking_")
    undecided: int = field("Number of events, since the start of the transient, that round-off leaves undecided.")
    motion: Motion = field("The motion at the end; if it is unresolved, with the reason.", variable=None)
    final: State | None = field(
        "The state at the end of the record, from which another trajectory can continue; null where there is none.",
        prefix="final_",
    )
    other_starts: OtherStarts | None = field(
        "What other starts lead to.", when="where `other_starts` asks for some", variable=None
    )

    @picture
    def plot(
        self, ax: tuple[Axes, Axes] | Axes | None = None, *, mass: int | None = None, **options: Unpack[PictureOptions]
    ) -> tuple[Axes, Axes]:
        """Draw the time history of the contact, or of one mass, and its phase portrait; return both axes.

        `ax` is both axes, or one for the time history alone.
        """
        return draw(self, ax, options, mass=mass)

    def _summary(self) -> str:
        summary = f"{counted(self.impacts, 'impact')}, motion {self.motion.label or self.motion.kind}"
        return summary if self.other_starts is None else f"{summary}, {self.other_starts}"


class Trajectories(Result, process="trajectories"):
    """One trajectory from each of many initial states."""

    trajectories: tuple[Trajectory, ...] = field(
        "The trajectories, in the order of the states.",
        "trajectory",
        type=RecordSchema("TrajectoryRecord", Trajectory.schema.description, Trajectory.schema.fields, Trajectory),
    )

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        # the meta of each trajectory has the request with its own state
        records, states = document["trajectories"], meta["request"]["initial"]
        requests = ({**meta["request"], "initial": state} for state in states)
        single = (
            Trajectory.from_document(record, meta_of_part(Trajectory.schema, record, meta, request=request))
            for record, request in zip(records, requests, strict=True)
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

        `ax` is both axes, or one for the time history alone. ``trajectories[i].plot()`` draws the whole record of one
        trajectory, with its impacts. `colours` gives colours by label or kind.
        """
        return draw(self, ax, options, mass=mass, colours=colours)

    def _summary(self) -> str:
        counts = Counter(path.motion.label or path.motion.kind for path in self.trajectories)
        motions = ", ".join(f"{count} x {name}" for name, count in counts.most_common(5))
        return f"{len(self)} trajectories: {motions}{', ...' if len(counts) > 5 else ''}"
