"""The request for basins of attraction: two initial coordinates, and the values of both."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from grazemap.wire.base import CoordinateGrid, Request, invalid
from grazemap.wire.process import Count, InitialState, MaxPeriod, MaxPeriods, Operation, PointRequest


class BasinCoordinate(Request):
    """One of the two initial coordinates: displacement or velocity of a mass, and its values."""

    quantity: Literal["displacement", "velocity"]
    """The quantity of the mass that varies."""
    mass: Count = 1
    """The mass, counted from 1."""
    values: CoordinateGrid
    """Its values: a range, or an increasing list; of mass 1 strictly between the stops."""

    @property
    def varied(self) -> tuple[str, int]:
        """The quantity and the mass."""
        return self.quantity, self.mass

    @property
    def ends(self) -> tuple[float, float]:
        """Its first and last value, without the others, which may be too many."""
        if isinstance(self.values, list):
            return self.values[0], self.values[-1]
        return self.values.start, self.values.stop


class BasinsRequest(PointRequest):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance.

    `initial` holds all other coordinates, and the phase of the forcing; left out, they are 0.
    """

    operation = Operation(
        "basins",
        "submit_basins",
        "Basins of attraction",
        "Compute the motion that every initial state of a rectangle leads to, and the attractors with their shares.",
        {
            "two coexisting motions": {
                "omega": 0.29,
                "clearance": 1.9927,
                "horizontal": {
                    "quantity": "displacement",
                    "mass": 1,
                    "values": {"start": -1.9, "stop": 1.9, "points": 50},
                },
                "vertical": {"quantity": "velocity", "mass": 1, "values": {"start": -1.0, "stop": 1.0, "points": 50}},
            }
        },
    )

    horizontal: BasinCoordinate
    """The initial coordinate along the horizontal axis."""
    vertical: BasinCoordinate
    """The initial coordinate along the vertical axis."""
    initial: InitialState = InitialState()
    """All other coordinates, and the phase of the forcing."""
    max_periods: MaxPeriods = 1000
    """Forcing periods after which a trajectory that has not settled ends; its motion may be chaotic."""
    max_period: MaxPeriod = 32
    """The longest period looked for, in forcing periods."""

    @model_validator(mode="after")
    def _coordinates_fit(self) -> BasinsRequest:
        count = self.oscillator.size
        for name, coordinate in (("horizontal", self.horizontal), ("vertical", self.vertical)):
            if coordinate.mass > count:
                raise invalid(f"{name}.mass is no mass of the oscillator", f"1 to {count}", name, "mass")
            reaches = not max(abs(end) for end in coordinate.ends) < self.clearance
            if coordinate.varied == ("displacement", 1) and reaches:
                detail = f"{name}.values of mass 1 reach the stops"
                raise invalid(detail, "-clearance < values < clearance", name, "values")
        if self.horizontal.varied == self.vertical.varied:
            raise invalid("vertical is the same coordinate as horizontal", "another coordinate", "vertical")
        initial = self.initial.fitted(count, self.clearance, ("initial",))
        # values that the rectangle replaces are not part of the request
        state = {"displacement": list(initial.displacement or ()), "velocity": list(initial.velocity or ())}
        for coordinate in (self.horizontal, self.vertical):
            state[coordinate.quantity][coordinate.mass - 1] = 0.0
        # strictly between the stops, as a start on a stop would depend on rounding
        if not abs(state["displacement"][0]) < self.clearance:
            raise invalid(
                "initial.displacement of mass 1 lies on a stop",
                "|displacement[0]| < clearance",
                "initial",
                "displacement",
            )
        # the model is frozen, but this is still its validation
        object.__setattr__(self, "initial", initial.model_copy(update=state))
        return self
