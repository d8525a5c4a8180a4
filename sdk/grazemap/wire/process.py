"""Parts of the requests of several processes: the oscillator, initial states, types of numbers.

Also the description of a process in the API's document.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Discriminator, Field, Tag

from grazemap.wire.base import Float, Listable, Positive, Request, invalid
from grazemap.wire.oscillator import Oscillator

Count = Annotated[int, Field(ge=1), Listable]
MaxPeriods = Annotated[int, Field(ge=1, le=1_000_000), Listable]
LONGEST_PERIOD = 256
MaxPeriod = Annotated[int, Field(ge=1, le=LONGEST_PERIOD), Listable]


@dataclass(frozen=True)
class Operation:
    """The description of a process in the API's document.

    Attributes
    ----------
    process : str
        Its name, and the last part of its address.
    operation_id, summary, description : str
    examples : dict
        Requests that can be posted as they are, by their names.
    """

    process: str
    operation_id: str
    summary: str
    description: str
    examples: Mapping[str, Mapping[str, Any]]


def first_harmonic(oscillator: Oscillator) -> Oscillator:
    """Return the oscillator, if its forces have the first harmonic alone."""
    if any(one.harmonic != 1 for one in oscillator.harmonics):
        raise invalid(
            "oscillator.forcing has other harmonics than the first, which this process does not cover in this version",
            "forces of harmonic 1; the process structures covers every oscillator",
            "forcing",
        )
    return oscillator


GrazedOscillator = Annotated[Oscillator, AfterValidator(first_harmonic)]


def _covered(oscillator: Oscillator) -> Oscillator:
    """Return the oscillator, if the processes other than structures answer for it in this version."""
    name = oscillator.beyond_the_chain()
    if name is not None:
        raise invalid(
            f"oscillator.{name} is not covered by this process in this version",
            "a chain whose mass 1 hits equal stops, with forces of one frequency and phase; structures, grazing-curves "
            "and codimension-two-points cover others",
            name,
        )
    return oscillator


class ProcessRequest(Request):
    """Base of all requests; a class with an `operation` is the request of a process."""

    operation: ClassVar[Operation]

    oscillator: Annotated[Oscillator, AfterValidator(_covered)] = Oscillator()
    """The chain of masses; fields that are left out are those of the paper's example."""


class PointRequest(ProcessRequest):
    """Base of requests at one point of the plane of omega and clearance."""

    omega: Positive
    """Forcing frequency."""
    clearance: Positive
    """Distance of each stop from the middle."""


class InitialState(Request):
    """The initial state of a trajectory; left out: at rest in the middle, forcing phase 0."""

    displacement: Annotated[list[Float], Field(min_length=1, fail_fast=True), Listable] | None = None
    """Of every mass, N numbers; left out: 0."""
    velocity: Annotated[list[Float], Field(min_length=1, fail_fast=True), Listable] | None = None
    """Of every mass, N numbers; left out: 0."""
    phase: Float = 0.0
    """Of the forcing f sin(omega t + phase) at t = 0, in radians."""

    def fitted(self, count: int, clearance: float, at: tuple[str, ...]) -> InitialState:
        """Return the state with zeros for values that were left out, so that equal requests have the same text.

        `at` is its place in the request. Raises where it does not fit the number of masses or the stops.
        """
        where = ".".join(at)
        for name in ("displacement", "velocity"):
            values = getattr(self, name)
            if values is not None and len(values) != count:
                detail = f"{where}.{name} has {len(values)} numbers and the oscillator has {count} masses"
                raise invalid(detail, "one number per mass", *at, name)
        if self.displacement is not None and abs(self.displacement[0]) > clearance:
            detail = f"{where}.displacement of mass 1 lies outside the stops"
            raise invalid(detail, "|displacement[0]| <= clearance", *at, "displacement")
        rest = {name: [0.0] * count for name in ("displacement", "velocity") if getattr(self, name) is None}
        return self.model_copy(update=rest)


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
]
