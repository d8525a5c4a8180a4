"""The result of structures."""

from __future__ import annotations

from grazemap.schema.common import OMEGA
from grazemap.schema.fields import Record, ResultSchema, field

_ONE = "if the forces have one harmonic"

GAPS = Record(
    "Gaps",
    "The distances of the stops from the static equilibrium; negative: that of a preloaded stop.",
    (
        field("right", "float", "Of the right stop, null if there is none.", unit="m", null=True),
        field("left", "float", "Of the left stop, null if there is none.", unit="m", null=True),
    ),
)
_AMPLITUDE = field("amplitude", "float", "Amplitude of the contact coordinate.", "omega", "m", null=True)
_PHASE = field(
    "phase",
    "float",
    "Its phase: amplitude sin(harmonic omega t + phase) about the equilibrium.",
    "omega",
    "rad",
    null=True,
)
_SLOPE = field("amplitude_slope", "float", "d amplitude/d omega.", "omega", "m s/rad", null=True)
HARMONIC = Record(
    "HarmonicResponse",
    "The steady motion of the contact coordinate in one harmonic of the forces; null at a resonance without damping.",
    (field("harmonic", "int", "The multiple of omega."), _AMPLITUDE, _PHASE, _SLOPE),
)
STRUCTURES = ResultSchema(
    "Structure",
    "The linear properties of an oscillator: the structure without contact, as the contact coordinate q = h x sees it.",
    (
        field("effective_mass", "float", "1/(h M^-1 h): the mass m_c that an impulse along the stop meets.", unit="kg"),
        field(
            "kappa",
            "float",
            "m_c h M^-1 C M^-1 h: the rate at which damping alone would slow the contact coordinate after an impulse.",
            unit="1/s",
        ),
        field("equilibrium", "float", "Displacements under the bias.", "mass", "m"),
        field("contact_equilibrium", "float", "The contact coordinate there.", unit="m"),
        field("gaps", GAPS, "The distances of the stops from the equilibrium.", when="with clearance", prefix="gap_"),
        field(
            "natural_frequencies",
            "float",
            "Angular frequencies of the structure without damping, increasing; 0 of a free mode.",
            "mode",
            "rad/s",
        ),
        field(
            "damping_ratios",
            "float",
            "Of the damped modes, by increasing frequency; null of a free mode, and of several modes that do not "
            "oscillate where the damping is not diagonal in the modes.",
            "mode",
            null=True,
        ),
        field(
            "contact_weights",
            "float",
            "|h phi_j| of the modes without damping, of unit modal mass; 0: the contact neither sees nor excites it.",
            "mode",
            "1/sqrt(kg)",
            when="where the stiffness matrix is symmetric",
        ),
        OMEGA.in_result(dims=("omega",)),
        _AMPLITUDE.in_result(when=_ONE),
        _PHASE.in_result(when=_ONE),
        _SLOPE.in_result(when=_ONE),
        field("harmonics", HARMONIC, "The steady motion in every harmonic.", "harmonic", variable=None),
        field("time", "float", "Times after the impulse.", "time", "s"),
        field(
            "impulse_response",
            "float",
            "g: the contact coordinate after an impulse that changes its velocity by 1.",
            "time",
            "s",
        ),
    ),
    process="structures",
    rows="omega",
)
