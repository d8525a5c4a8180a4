"""What the requests of all processes share, and the numbers that several of them take."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from grazemap.wire.base import Listable, Request
from grazemap.wire.oscillator import Oscillator

Count = Annotated[int, Field(ge=1), Listable]
MaxPeriods = Annotated[int, Field(ge=1, le=1_000_000), Listable]
LONGEST_PERIOD = 256
MaxPeriod = Annotated[int, Field(ge=1, le=LONGEST_PERIOD), Listable]


class ProcessRequest(Request):
    """What the requests of all processes share."""

    oscillator: Oscillator = Oscillator()
    """The chain of masses; left out, or any of its fields, the paper's example."""
