"""The records and the fields that several results have."""

from __future__ import annotations

from grazemap.results.record import FloatArray, IntArray, Record, TextArray, field

KINDS = ("periodic", "quasi-periodic", "chaotic", "unresolved")
STOPS = (1, -1)
BIFURCATIONS = ("SN", "PD", "SB", "NS", "GR")
PERIODIC_MOTIONS = "of periodic motions"


class Common(Record):
    """Fields that several results have, each varied there."""

    omega: float = field("Forcing frequency.", unit="rad/s")
    clearance: float = field("Distance of each stop from the middle.", unit="m")
    period: int = field("The minimum period n of a periodic motion.", unit="forcing periods")
    impacts_right: int = field(
        "Number of impacts on the right stop in a period of a periodic motion; -1: the stop is not touched, 0: the "
        "contact rests on it without an impact, -2: infinitely many, in complete chatter."
    )
    impacts_left: int = field("The same for the left stop.")
    symmetric: bool = field("Whether the motion is its own mirror image, half a period later.")
    sticking: bool = field("Whether the contact rests on a stop at some time in the period.")
    isolated: bool = field("Exactly one solution of the orbit's equations is near (Newton-Kantorovich).")
    admissible: bool = field(
        "Every impact velocity is directed towards its stop, and there is no other contact: the orbit is a motion."
    )
    stable: bool = field("All multipliers are inside the unit circle.")
    verified: bool = field("The orbit is isolated, admissible and stable, and its period is the minimum.")
    sensitive: bool = field(
        "On its way to a periodic motion the trajectory missed a stop, or hit it, so narrowly that its estimated "
        "round-off error may have decided it: the exact trajectory may lead elsewhere."
    )
    transient_growth: float = field(
        "Largest logarithm by which a small change of the state has grown between any two times before the orbit "
        "captured the trajectory; counted until the error of the trajectory is as large as its motion.",
        null=True,
    )


class Motion(Record):
    """The motion n-p_r-q_l that a trajectory settles to."""

    kind: str = field("The kind of the motion.", values=KINDS)
    period: int | None = field(Common, when=PERIODIC_MOTIONS)
    impacts_right: int | None = field(Common, when=PERIODIC_MOTIONS)
    impacts_left: int | None = field(Common, when=PERIODIC_MOTIONS)
    symmetric: bool | None = field(Common, when=PERIODIC_MOTIONS)
    sticking: bool | None = field(Common, when=PERIODIC_MOTIONS)
    label: str | None = field("The name n-p_r-q_l as plain text.", when=PERIODIC_MOTIONS)
    verified: bool = field(Common)
    reason: str | None = field(
        "Why the motion is unresolved, or is not verified.", when="of motions that are unresolved or not verified"
    )


class Impacts(Record):
    """Every contact of a trajectory with a stop, in order."""

    time: FloatArray = field("Time from the start of the record.", "impact", "s", coordinate=True)
    period: IntArray = field("Forcing periods completed at that time.", "impact", "forcing periods")
    phase_time: FloatArray = field("Time since the end of these periods, without their rounding.", "impact", "s")
    stop: IntArray = field("+1: right stop, -1: left stop.", "impact", dtype="int8", values=STOPS)
    velocity: FloatArray = field("Velocity of the contact coordinate before the impact, signed.", "impact", "m/s")
    kind: TextArray = field(
        "impact; chatter: infinitely many impacts follow until the next rest; graze: round-off leaves undecided "
        "whether the stop is touched.",
        "impact",
        values=("impact", "chatter", "graze"),
    )

    def __len__(self) -> int:
        return len(self.time)


class Sticking(Record):
    """The intervals during which the contact rests on a stop."""

    start: FloatArray = field("Start of the interval.", "interval", "s")
    stop_time: FloatArray = field("End of the interval.", "interval", "s")
    stop: IntArray = field(Impacts, "interval")

    def __len__(self) -> int:
        return len(self.start)


class ChanceToSettle(Record):
    """How many of a sample of the chaotic motions settle when they are simulated for ten times as long."""

    watched: int = field("Forcing periods after which motions were called chaotic.", unit="forcing periods")
    run_on: int = field(
        "Forcing periods, from the same start, after which the motions of the sample were named again.",
        unit="forcing periods",
    )
    chaotic: int = field("Number of chaotic motions.")
    sampled: int = field("Number of chaotic motions in the sample, without trajectories that ended early.")
    settled: int = field("Number of motions in the sample that became periodic.")
    chance: float = field("settled/sampled.", null=True)
    low: float = field("Lower end of the 95 % interval of the chance (Clopper & Pearson).")
    high: float = field("Upper end of the interval.")

    def __str__(self) -> str:
        return f"{self.settled} of {self.sampled} chaotic motions settle within {self.run_on} periods"


CHANCE = field(
    "The chance that a motion that is called chaotic settles within ten times the periods that were watched.",
    variable=None,
)
"""The field of a result with the chance of its chaotic motions to settle."""


class InferredWrong(Record):
    """How many of the inferred points of an adaptive map are wrong, from a random sample of them that was computed."""

    inferred: int = field(
        "Number of points that were inferred to have a motion, or to be chaotic, before the sample was computed."
    )
    sampled: int = field("Number of points in the sample, which are computed points of the map.")
    wrong: int = field("Number of points in the sample that have another motion, or are unresolved or sensitive.")
    low: float = field("Lower end of the 95 % interval of the share of wrong points (Clopper & Pearson).")
    high: float = field("Upper end of the interval.")

    def __str__(self) -> str:
        return f"{self.wrong} of {self.sampled} inferred points in a sample wrong ({self.low:.2%} to {self.high:.2%})"


class State(Record):
    """The state at a moment, as `initial` of a trajectory takes it."""

    displacement: FloatArray = field("Displacement of every mass.", "mass", "m", null=True)
    velocity: FloatArray = field("Velocity of every mass.", "mass", "m/s", null=True)
    phase: float = field("Phase of the forcing, in (-pi/p, pi/p].", unit="rad")


class MotionShare(Record):
    """One motion of an unfolding map and how much of the map it covers."""

    label: str = field("The name n-p_r-q_l as plain text, or the kind of a motion that is not periodic.")
    kind: str = field(Motion)
    period: int | None = field(Common)
    impacts_right: int | None = field(Common)
    impacts_left: int | None = field(Common)
    pixels: int = field("Points of the map with this motion.")
    share: float = field("Fraction of all points of the map.")
    mirror_images: bool = field("Whether the mirror images n-q_r-p_l are counted too.", default=False)
    colour: str | None = field(
        'Its colour in the picture of the map, #RRGGBB; None for one of the "other motions", and without a map.',
        default=None,
    )
