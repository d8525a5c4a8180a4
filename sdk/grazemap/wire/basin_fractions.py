"""The request for basin fractions: random initial states, and the parameter along which their motions are counted."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from grazemap.wire.base import Float, Kind, Listable, Request, invalid
from grazemap.wire.planes import OneParameterRequest
from grazemap.wire.process import Operation
from grazemap.wire.states import MaxPeriod, MaxPeriods, Seed


class StateRange(Request):
    """The values of an initial coordinate, from the smallest to the largest; both may be equal."""

    start: Float
    """The smallest value."""
    stop: Float
    """The largest value."""

    @model_validator(mode="after")
    def _is_ordered(self) -> StateRange:
        if self.stop < self.start:
            raise invalid("stop must not be less than start", "stop >= start")
        return self


StateRanges = Annotated[list[StateRange], Field(min_length=1, max_length=1000), Listable, Kind("state ranges")]


class BasinFractionsRequest(OneParameterRequest):
    """The shares of random initial states that lead to each attractor, along one parameter.

    `axis` has its values; omega and clearance are given where they do not vary. The same states are used
    at every value: uniform in the ranges of `displacement` and `velocity`, of those with the contact between the stops
    at all values.
    """

    operation = Operation(
        "basin-fractions",
        "submit_basin_fractions",
        "Compute the share of random initial states that leads to each attractor, at every value of one parameter.",
        {
            "along the clearance": {
                "axis": {"vary": "clearance", "values": {"start": 1.5, "stop": 2.0, "points": 26}},
                "omega": 0.29,
                "states": 100,
            },
            "of a plane of initial states": {
                "axis": {"vary": "clearance", "values": {"start": 1.9, "stop": 2.05, "points": 16}},
                "omega": 0.29,
                "states": 100,
                "displacement": [{"start": -1.9, "stop": 1.9}, {"start": -0.5, "stop": 0.5}, {"start": 0, "stop": 0}],
                "velocity": [{"start": -1, "stop": 1}, {"start": 0, "stop": 0}, {"start": 0, "stop": 0}],
            },
        },
        "Menck, Heitzig, Marwan, Kurths, Nature Physics 9 (2013) 89-92; Datseris, Rossi, Wagemakers, Chaos 33 (2023) "
        "073151.",
    )

    states: Annotated[int, Field(ge=1, le=100_000), Listable] = 200
    """Number of initial states."""
    seed: Seed = 0
    """Seed of the random states."""
    displacement: StateRanges | None = None
    """N ranges; left out: the equilibrium plus or minus the smallest half distance of the stops, over max |h|."""
    velocity: StateRanges | None = None
    """N ranges; left out: plus or minus the smallest p omega times that half width."""
    phase: Float = 0.0
    """Phase of the forcing at the start, in radians; harmonic k is shifted by k times as much."""
    max_periods: MaxPeriods = 1000
    max_period: MaxPeriod = 32

    @model_validator(mode="after")
    def _ranges_fit(self) -> BasinFractionsRequest:
        for name in ("displacement", "velocity"):
            self.oscillator.require_each(getattr(self, name), name, "one range per mass", name, entries="ranges")
        if self.displacement is None:
            return self
        right, left = map(min, zip(*(point.clearance.reach for point in self.line.corners()), strict=True))
        terms = zip(self.oscillator.contact_row, self.displacement, strict=True)
        ends = [sorted((h * interval.start, h * interval.stop)) for h, interval in terms]
        if not (sum(low for low, _ in ends) < right and -left < sum(high for _, high in ends)):
            allowed = "-clearance < contact coordinate < clearance, of the left and the right stop"
            raise invalid("displacement places the contact on a stop or beyond it", allowed, "displacement")
        return self
