"""What the requests of all processes share: the oscillator, types of numbers, and what the API's document says."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from grazemap.wire.base import Listable, Request
from grazemap.wire.oscillator import Oscillator

Count = Annotated[int, Field(ge=1), Listable]
MaxPeriods = Annotated[int, Field(ge=1, le=1_000_000), Listable]
LONGEST_PERIOD = 256
MaxPeriod = Annotated[int, Field(ge=1, le=LONGEST_PERIOD), Listable]


@dataclass(frozen=True)
class Operation:
    """What the API's document says of a process.

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


class ProcessRequest(Request):
    """What the requests of all processes share; a class with an `operation` is the request of a process."""

    operation: ClassVar[Operation]

    oscillator: Oscillator = Oscillator()
    """The chain of masses; fields that are left out are those of the paper's example."""

    def unused(self) -> Collection[str]:
        """Return the names of the fields that have no meaning in this request; its canonical text is without them."""
        return ()

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        unused = self.unused()
        return {name: value for name, value in dump(self).items() if name not in unused}
