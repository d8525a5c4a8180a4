"""Initial states, and numbers of periods, of the requests of several processes."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from grazemap.constants import EPSILON
from grazemap.wire.base import Float, Kind, Listable, Request, invalid
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.structure import ClearancePair, Row, as_pair

LONGEST_PERIOD = 256
COORDINATE_ROUNDING = 2.0 * EPSILON
"""Round-off of a contact coordinate, relative to the sum of the moduli of its terms; the core has the same."""
Period = Annotated[int, Field(ge=1, le=LONGEST_PERIOD), Listable]
Seed = Annotated[int, Field(ge=0, le=2**53), Listable]
# Fields of several requests, each with its description.
MaxPeriod = Annotated[Period, Field(description="The maximum period looked for, in forcing periods.")]
MaxPeriods = Annotated[
    int,
    Field(
        ge=1,
        le=1_000_000,
        description="Forcing periods after which a trajectory that has not settled ends; its motion may be chaotic.",
    ),
    Listable,
]
MOST_OTHER_STARTS = 1000
OtherStarts = Annotated[
    int,
    Field(
        ge=0,
        le=MOST_OTHER_STARTS,
        description="Number of random starts that are tried beside the given one, for other stable motions; 0: none.",
    ),
    Listable,
]
Multiple = Annotated[int, Field(ge=1, le=100), Listable]


class InitialState(Request):
    """The initial state of a trajectory; left out: at rest, forcing phase 0."""

    displacement: Row | None = None
    """N numbers; left out: 0, or with a bias or a negative clearance those of the structure at rest."""
    velocity: Row | None = None
    """N numbers; left out: 0."""
    phase: Float = 0.0
    """Of the forcing f sin(omega t + phase) at t = 0, in radians; harmonic k is shifted by k times as much."""

    def fitted(self, oscillator: Oscillator, clearance: float | ClearancePair, at: tuple[str, ...]) -> InitialState:
        """Return the `completed` state. Raises the error of `invalid` also where the contact is outside the stops."""
        state, (right, left) = self.completed(oscillator, clearance, at), as_pair(clearance).reach
        if self.displacement is not None:
            terms = [h * x for h, x in zip(oscillator.contact_row, self.displacement, strict=True)]
            several = sum(h != 0.0 for h in oscillator.contact_row) > 1
            place, rounding = math.fsum(terms), COORDINATE_ROUNDING * sum(map(abs, terms)) if several else 0.0
            if not -left - rounding <= place <= right + rounding:
                raise invalid(
                    f"{'.'.join(at)}.displacement places the contact outside the stops",
                    "-clearance <= contact coordinate <= clearance, of the left and the right stop",
                    *at,
                    "displacement",
                )
        return state

    def completed(self, oscillator: Oscillator, clearance: float | ClearancePair, at: tuple[str, ...]) -> InitialState:
        """Return the state with zeros for values that were left out, so that equal requests have the same text.

        Displacements that were left out stay so with a bias or a negative clearance: 0 is not at rest there. `at` is
        the place of the state in the request. Raises the error of `invalid` where there is not one number per degree of
        freedom.
        """
        for name in ("displacement", "velocity"):
            what = f"{'.'.join(at)}.{name}"
            oscillator.require_each(getattr(self, name), what, "one number per mass", *at, name)
        centred = not any(oscillator.bias or ()) and min(as_pair(clearance).reach) >= 0.0
        names = ("displacement", "velocity") if centred else ("velocity",)
        return self.model_copy(update={name: [0.0] * oscillator.size for name in names if getattr(self, name) is None})


def _states_tag(value: Any) -> str | None:
    if isinstance(value, dict | InitialState):
        return "[one]"
    return "[many]" if isinstance(value, list | tuple) else None


InitialStates = Annotated[
    Annotated[InitialState, Tag("[one]")]
    | Annotated[list[InitialState], Field(min_length=1, max_length=1000, fail_fast=True), Listable, Tag("[many]")],
    Discriminator(
        _states_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a state or a list of states",
        custom_error_context={
            "allowed": "an object with the fields displacement, velocity, phase, or a list of 1 to 1000 of them"
        },
    ),
    Kind("states"),
]
