"""The request for the linear properties of a structure."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Tag

from grazemap.wire.base import Kind, Listable, NonNegative, Positive, PositiveRange, Range
from grazemap.wire.process import Operation, ProcessRequest
from grazemap.wire.structure import Clearance

_MOST_VALUES = 100_000
Frequencies = Annotated[
    Annotated[PositiveRange, Tag("[range]")]
    | Annotated[list[Positive], Field(max_length=_MOST_VALUES, fail_fast=True), Listable, Tag("[list]")],
    Discriminator(lambda value: "[range]" if isinstance(value, dict | Range) else "[list]"),
    Kind("frequencies"),
]


class StructuresRequest(ProcessRequest):
    """The linear properties of an oscillator: what is checked first, and the same for every kind of structure."""

    operation = Operation(
        "structures",
        "submit_structure",
        "Compute natural frequencies, damping ratios, contact weights, the steady response and the impulse response.",
        {
            "default oscillator": {"omega": {"start": 0.2, "stop": 0.4, "points": 5}, "times": [1.0, 2.0]},
            "an impact damper on a shaken base": {
                "oscillator": {
                    "matrices": {
                        "mass": [[10.0, 0.0], [0.0, 1.0]],
                        "damping": {"modal": 0.02},
                        "stiffness": [[12.0, -2.0], [-2.0, 2.0]],
                    },
                    "contact": [2, 1],
                    "base": {"amplitude": 0.1, "stops_move": False, "influence": [1.0, 1.0]},
                },
                "clearance": {"right": 0.5, "left": 0.3},
                "omega": [0.9, 1.0, 1.1],
            },
        },
        'docs/theory.md, "Any linear structure".',
    )

    omega: Frequencies = []
    """Forcing frequencies of the steady response: a range, or a list."""
    times: Annotated[list[NonNegative], Field(max_length=_MOST_VALUES, fail_fast=True), Listable] = []
    """Times of the impulse response."""
    clearance: Clearance | None = None
    """Distance of the stops from q = 0: one number, or {"right": .., "left": ..} with None for an absent stop."""
