"""Records that several results have."""

from __future__ import annotations

from grazemap.schema.fields import Field, Record, deprecated, field

OMEGA = field("omega", "float", "Forcing frequency.", unit="rad/s")
CLEARANCE = field("clearance", "float", "Distance of each stop from the middle.", unit="m")
KINDS = ("periodic", "quasi-periodic", "chaotic", "unresolved")
STOPS = (1, -1)
BIFURCATIONS = ("SN", "PD", "SB", "NS", "GR")

PERIOD = field("period", "int", "The minimum period n of a periodic motion.", unit="forcing periods")
IMPACTS_RIGHT = field(
    "impacts_right",
    "int",
    "Number of impacts on stop A in a period of a periodic motion; -1: the stop is not touched, 0: the contact "
    "rests on it without an impact, -2: infinitely many, in complete chatter.",
)
IMPACTS_LEFT = field("impacts_left", "int", "The same for stop C.")
SYMMETRIC = field("symmetric", "bool", "Whether the motion is its own mirror image, half a period later.")
STICKING = field("sticking", "bool", "Whether the contact rests on a stop at some time in the period.")
_OF_PERIODIC = "of periodic motions"
NAME: tuple[Field, ...] = tuple(
    one.in_result(when=_OF_PERIODIC) for one in (PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC, STICKING)
)

ISOLATED = field("isolated", "bool", "Exactly one solution of the orbit's equations is near (Newton-Kantorovich).")
ADMISSIBLE = field(
    "admissible",
    "bool",
    "Every impact velocity is directed towards its stop, and there is no other contact: the orbit is a motion.",
)
STABLE = field("stable", "bool", "All multipliers are inside the unit circle.")
VERIFIED = field("verified", "bool", "The orbit is isolated, admissible and stable, and its period is the minimum.")
SINCE = "since version 0.3.4"
SENSITIVE = field(
    "sensitive",
    "bool",
    "On its way to a periodic motion the trajectory missed a stop, or hit it, so narrowly that its estimated round-off "
    "error may have decided it: the exact trajectory may lead elsewhere.",
    when=SINCE,
)
TRANSIENT_GROWTH = field(
    "transient_growth",
    "float",
    "Largest logarithm by which a small change of the state has grown between any two times before the orbit captured "
    "the trajectory; counted until the error of the trajectory is as large as its motion.",
    null=True,
    when=SINCE,
)
EVIDENCE = (ISOLATED, ADMISSIBLE, STABLE, VERIFIED)

MOTION = Record(
    "Motion",
    "The motion n-p_r-q_l that a trajectory settles to.",
    (
        field("kind", "str", "The kind of the motion.", values=KINDS),
        *NAME,
        field("label", "str", "The name n-p_r-q_l as plain text.", when=_OF_PERIODIC),
        VERIFIED,
        deprecated("certified", VERIFIED),
        field(
            "reason",
            "str",
            "Why the motion is unresolved, or is not verified.",
            when="of motions that are unresolved or not verified",
        ),
    ),
)
CHANCE_TO_SETTLE = Record(
    "ChanceToSettle",
    "How many of a sample of the chaotic motions settle when they are simulated for ten times as long.",
    (
        field("watched", "int", "Forcing periods after which motions were called chaotic.", unit="forcing periods"),
        field(
            "run_on",
            "int",
            "Forcing periods, from the same start, after which the motions of the sample were named again.",
            unit="forcing periods",
        ),
        field("chaotic", "int", "Number of chaotic motions."),
        field("sampled", "int", "Number of them that were run on; trajectories that ended early do not count."),
        field("settled", "int", "Number of the sampled ones that became periodic."),
        field("chance", "float", "settled/sampled.", null=True),
        field("low", "float", "Lower end of the 95 % interval of the chance (Clopper & Pearson)."),
        field("high", "float", "Upper end of the interval."),
    ),
)
STATE = Record(
    "State",
    "The state at a moment, as `initial` of a trajectory takes it.",
    (
        field("displacement", "float", "Displacement of every mass.", "mass", "m", null=True),
        field("velocity", "float", "Velocity of every mass.", "mass", "m/s", null=True),
        field("phase", "float", "Phase of the forcing, in (-pi/p, pi/p].", unit="rad"),
    ),
)
IMPACTS = Record(
    "Impacts",
    "Every contact of a trajectory with a stop, in order.",
    (
        field("time", "float", "Time from the start of the record.", "impact", "s", coordinate=True),
        field("period", "int", "Forcing periods completed at that time.", "impact", "forcing periods"),
        field("phase_time", "float", "Time since the end of these periods, without their rounding.", "impact", "s"),
        field("stop", "int", "+1: stop A, -1: stop C.", "impact", dtype="int8", values=STOPS),
        field("velocity", "float", "Velocity of the contact coordinate before the impact, signed.", "impact", "m/s"),
        field(
            "kind",
            "str",
            "impact; chatter: infinitely many impacts follow until the next rest; graze: round-off leaves undecided "
            "whether the stop is touched.",
            "impact",
            values=("impact", "chatter", "graze"),
        ),
    ),
)
RESTS = Record(
    "Sticking",
    "The intervals during which the contact rests on a stop.",
    (
        field("start", "float", "Start of the interval.", "interval", "s"),
        field("stop_time", "float", "End of the interval.", "interval", "s"),
        field("stop", "int", "+1: stop A, -1: stop C.", "interval", dtype="int8", values=STOPS),
    ),
)
