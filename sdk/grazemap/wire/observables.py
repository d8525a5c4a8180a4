"""What is read off motions: observables by name, and outputs, which are rows on displacements and velocities."""

from __future__ import annotations

import keyword
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from grazemap.wire.base import LeftOut, Listable, Request, invalid
from grazemap.wire.process import ProcessRequest
from grazemap.wire.structure import OptionalRow

_SIDES = ("", "_right", "_left")
_OF_IMPACTS = ("impact_rate", "peak_impact_speed", "mean_impact_speed", "impulse", "dissipated_power")
OBSERVABLES: tuple[str, ...] = (
    *(name + side for name in _OF_IMPACTS for side in _SIDES),
    "rms_displacement",
    *("peak_displacement" + side for side in _SIDES),
)
MAX_OUTPUTS = 16
_LONGEST_NAME = 64


class OutputRow(Request):
    """An output ``displacement x + velocity x'``: a row on displacements, one on velocities, or both."""

    displacement: OptionalRow = None
    """N numbers; left out: 0. Displacements are those of trajectories, with the static equilibrium of a bias."""
    velocity: OptionalRow = None
    """N numbers; left out: 0."""
    unit: Annotated[str, Field(max_length=32), LeftOut] = ""
    """Unit of the output, for pictures and tables: with a row of stiffnesses in SI, "N"."""


def _in_order(names: list[str]) -> list[str]:
    """Return observables in one order, so that requests that mean the same have the same text."""
    for k, name in enumerate(names):
        if name in names[:k]:
            raise invalid("an observable is named twice", "different names", str(k))
    return sorted(names, key=OBSERVABLES.index)


class ObservedRequest(ProcessRequest):
    """Base of the requests of processes that read quantities off motions."""

    observables: Annotated[
        list[Annotated[Literal[OBSERVABLES], Listable]],  # type: ignore[valid-type]
        Field(max_length=len(OBSERVABLES), fail_fast=True, json_schema_extra={"uniqueItems": True}),
        Listable,
        AfterValidator(_in_order),
        LeftOut,
    ] = []
    """Quantities of the contact that the result has for every motion, by name; _right and _left: of one stop."""
    outputs: Annotated[dict[str, OutputRow], Field(max_length=MAX_OUTPUTS), LeftOut] = {}
    """Outputs by name, each a row on displacements or velocities; the result has rms, mean and peak of each."""

    @field_validator("outputs")
    @classmethod
    def _outputs_fit(cls, outputs: dict[str, OutputRow], validation: ValidationInfo) -> dict[str, OutputRow]:
        """Return outputs in the order of their names, which are identifiers."""
        for name, output in outputs.items():
            if not name.isidentifier() or keyword.iskeyword(name) or len(name) > _LONGEST_NAME:
                detail = "the name of an output is not an identifier"
                raise invalid(detail, f"letters, digits and _, no digit first, at most {_LONGEST_NAME}")
            if not any(output.displacement or ()) and not any(output.velocity or ()):
                raise invalid("an output has no row", "displacement, velocity, or both", name)
            for row in ("displacement", "velocity") if "oscillator" in validation.data else ():
                oscillator = validation.data["oscillator"]
                oscillator.require_each(getattr(output, row), "the row", f"{oscillator.size} numbers", name, row)
        return dict(sorted(outputs.items()))

    @property
    def observed(self) -> bool:
        """Whether anything is read off the motions."""
        return bool(self.observables or self.outputs)
