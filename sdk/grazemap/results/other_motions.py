"""The other stable motions that a sample of starts leads to, at a point and over a map from rest."""

from __future__ import annotations

from typing import Any

from grazemap.results.common_records import Common, Motion
from grazemap.results.fields import RequestDocument
from grazemap.results.record import Record, field

_NOT_SEEN = "which proves nothing: few states may lead to another"


class OtherMotion(Record):
    """A verified motion that other starts lead to."""

    label: str = field(Motion, when="")
    period: int = field(Common)
    impacts_right: int = field(Common)
    impacts_left: int = field(Common)
    symmetric: bool = field(Common)
    multiplier: float = field("Largest modulus of the multipliers over one period.")
    least_impact_velocity: float = field("Minimum impact speed; null without impacts.", unit="m/s", null=True)
    starts: int = field("Number of starts that lead to it.")
    request: dict[str, Any] = field(
        "The request that shows it, from one of these starts: post it unchanged to `/v1/trajectories`.",
        type=RequestDocument("trajectories"),
    )


class OtherStarts(Record):
    """What other starts at the same point lead to."""

    starts: int = field("Number of other starts; 0 where the motion from the given one is not known.")
    settled: int = field("Number of them that lead to a verified motion, the given one or another.")
    motions: tuple[OtherMotion, ...] = field(
        "The other motions, those that most starts lead to first; mirror images count once.", "other_motion"
    )

    def __str__(self) -> str:
        if not self.starts:
            return "other starts not compared: the motion is not known"
        if not self.motions:
            return f"no other motion from {self.starts} other starts, {_NOT_SEEN}"
        return f"from other starts also {listed([(other.label, other.starts) for other in self.motions], self.starts)}"


class MotionElsewhere(Record):
    """A verified motion that other starts lead to at points of a map."""

    label: str = field(OtherMotion)
    points: int = field("Number of points of the sample at which it was seen.")
    horizontal: float = field("Value of the horizontal parameter at the first of these points.")
    vertical: float = field("Value of the vertical parameter there.")
    from_rest: str = field("The label of the motion from rest there, or its kind.")
    starts: int = field(OtherMotion, description="Number of starts that lead to it there.")
    request: dict[str, Any] = field(OtherMotion, type=RequestDocument("trajectories"))


class OtherStartsOfMap(Record):
    """What other starts lead to at a random sample of the points of a map from rest."""

    starts: int = field("Number of other starts at every point of the sample.")
    points: int = field("Number of points in the sample whose motion from rest is known.")
    with_others: int = field("Number of these points at which other motions were seen.")
    motions: tuple[MotionElsewhere, ...] = field(
        "The other motions by label, those seen at most points first; mirror images count once.", "other_motion"
    )

    def __str__(self) -> str:
        if not self.with_others:
            return f"from rest; {self.starts} other starts at each of {self.points} points led to the same motions"
        motions = ", ".join(motion.label for motion in self.motions[:_MOST])
        more = ", .." if len(self.motions) > _MOST else ""
        return f"other stable motions at {self.with_others} of {self.points} sampled points: {motions}{more}"


_MOST = 5


def listed(counts: list[tuple[str, int]], starts: int) -> str:
    """Return labels with the number of starts that lead to each, of so many in all."""
    parts = [f"{label} ({count} of {starts})" for label, count in counts[:_MOST]]
    return ", ".join([*parts, ".."] if len(counts) > _MOST else parts)
