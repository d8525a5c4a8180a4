"""One request model per process, and the table of them.

A model is validated by the service, parsed by the worker and built by the client; its canonical text
(`canonical.py`) is what a job's id is made from. To add a process, add its model here and to PROCESSES.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from grazemap.models.base import Float, Listable, Positive, Request, invalid
from grazemap.models.oscillator import Oscillator
from grazemap.models.ranges import Grid, Interval

Order = Annotated[int, Field(ge=1, le=200), Listable]
Multiple = Annotated[int, Field(ge=1, le=100), Listable]
Count = Annotated[int, Field(ge=1), Listable]


class ProcessRequest(Request):
    """What the requests of all processes share."""

    oscillator: Oscillator = Oscillator()


class GrazingCurvesRequest(ProcessRequest):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19))."""

    omega: Grid
    max_order: Order = 8


class CodimensionTwoPointsRequest(ProcessRequest):
    """Every codimension-two point of the grazing curve over an interval of omega (equations (42), (45), (57), (58))."""

    omega: Interval
    max_order: Order = 8
    max_multiple: Multiple = 4


class InitialState(Request):
    """Where a trajectory starts; left out: at rest in the middle, forcing phase 0."""

    displacement: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None
    velocity: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None
    phase: Float = 0.0


class TrajectoriesRequest(ProcessRequest):
    """One trajectory, every impact exact."""

    omega: Positive
    clearance: Positive
    initial: InitialState = InitialState()
    periods: Count
    transient_periods: Annotated[int, Field(ge=0), Listable] = 0
    samples_per_period: Annotated[int, Field(ge=1, le=100_000), Listable] = 200

    @model_validator(mode="after")
    def _initial_state_fits(self) -> TrajectoriesRequest:
        count = self.oscillator.size
        for name in ("displacement", "velocity"):
            values = getattr(self.initial, name)
            if values is not None and len(values) != count:
                raise invalid(
                    f"initial.{name} has {len(values)} numbers and the oscillator has {count} masses",
                    "one number per mass",
                    "initial",
                    name,
                )
        if self.initial.displacement is not None and abs(self.initial.displacement[0]) > self.clearance:
            raise invalid(
                "initial.displacement of mass 1 lies outside the stops",
                "|displacement[0]| <= clearance",
                "initial",
                "displacement",
            )
        self._write_out_rest(count)
        return self

    def _write_out_rest(self, count: int) -> None:
        """Put zeros where the initial state was left out, so that the same question is the same text."""
        rest = {name: [0.0] * count for name in ("displacement", "velocity") if getattr(self.initial, name) is None}
        # the model is frozen for others; this is still its validation
        object.__setattr__(self, "initial", self.initial.model_copy(update=rest))


class UnfoldingMapsRequest(ProcessRequest):
    """The motion that each point of a rectangle of (omega, clearance) settles to.

    Trajectories start at rest; where the one of the clearance below or above has ended (a sweep follows a motion for as
    long as it lasts); or, of an ensemble, at random states, and the motion that most of them lead to counts.
    """

    omega: Grid
    clearance: Grid
    policy: Literal["rest", "sweep-up", "sweep-down", "ensemble"] = "rest"
    max_periods: Annotated[int, Field(ge=1, le=1_000_000), Listable] = 1000
    max_period: Annotated[int, Field(ge=1, le=256), Listable] = 32
    # Of the policy "ensemble" only; accepted with any policy, but then not part of the question.
    initial_conditions: Annotated[int, Field(ge=1, le=1000), Listable] = 16
    seed: Annotated[int, Field(ge=0, le=2**53), Listable] = 0

    @model_serializer(mode="wrap")
    def _without_what_is_not_asked(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields: dict[str, Any] = dump(self)
        if self.policy != "ensemble":
            for name in ("initial_conditions", "seed"):
                fields.pop(name, None)
        return fields


PROCESSES: dict[str, type[ProcessRequest]] = {
    "grazing-curves": GrazingCurvesRequest,
    "codimension-two-points": CodimensionTwoPointsRequest,
    "trajectories": TrajectoriesRequest,
    "unfolding-maps": UnfoldingMapsRequest,
}


def parse_request(process: str, body: dict[str, Any]) -> ProcessRequest:
    """Validate a request body. KeyError: no such process; pydantic.ValidationError: bad values."""
    return PROCESSES[process].model_validate(body)
