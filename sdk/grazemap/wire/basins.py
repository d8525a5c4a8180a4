"""The request for basins of attraction: two initial coordinates, and the values of both."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from grazemap.wire.base import CoordinateGrid, Positive, Request, invalid
from grazemap.wire.process import Count, InitialState, MaxPeriod, MaxPeriods, Operation, ProcessRequest
from grazemap.wire.structure import Clearance, as_pair

INSIDE_STOPS = "-clearance < contact coordinate < clearance, of the left and the right stop"


class BasinCoordinate(Request):
    """One of the two initial coordinates: displacement or velocity of a mass, and its values."""

    quantity: Literal["displacement", "velocity"]
    """The quantity of the mass that varies."""
    mass: Count = 1
    """The mass, counted from 1."""
    values: CoordinateGrid
    """Its values: a range, or an increasing list; the contact is strictly between the stops."""

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


class BasinsRequest(ProcessRequest):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance.

    `initial` holds all other coordinates, and the phase of the forcing; left out, they are 0, or with a bias those of
    the static equilibrium.
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

    omega: Positive
    """Forcing frequency."""
    clearance: Clearance
    """Distance of the stops from q = 0: one number, or {"right": .., "left": ..} with None for an absent stop."""
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
        if self.horizontal.varied == self.vertical.varied:
            raise invalid("vertical is the same coordinate as horizontal", "another coordinate", "vertical")
        initial = self.initial.fitted(self.oscillator, self.clearance, ("initial",))
        # values that the rectangle replaces are not part of the request
        state = {"displacement": list(initial.displacement or ()), "velocity": list(initial.velocity or ())}
        for coordinate in (self.horizontal, self.vertical):
            if state[coordinate.quantity]:
                state[coordinate.quantity][coordinate.mass - 1] = 0.0
        self._stays_between_the_stops(state["displacement"])
        # the model is frozen, but this is still its validation
        given = {name: values for name, values in state.items() if values}
        object.__setattr__(self, "initial", initial.model_copy(update=given))
        return self

    def _stays_between_the_stops(self, displacement: list[float]) -> None:
        """Raise where a state of the rectangle has the contact on a stop or beyond it; unknown without displacements.

        Strictly between them, as a start on a stop would depend on rounding.
        """
        if not displacement:
            return
        row, stops = self.oscillator.contact_row, as_pair(self.clearance)
        place = sum(h * x for h, x in zip(row, displacement, strict=True))
        lowest, highest, moved = place, place, None
        for name, coordinate in (("horizontal", self.horizontal), ("vertical", self.vertical)):
            reached = [row[coordinate.mass - 1] * end for end in coordinate.ends]
            if coordinate.quantity == "displacement" and row[coordinate.mass - 1] != 0.0:
                lowest, highest, moved = lowest + min(reached), highest + max(reached), name
        right, left = (float("inf") if one is None else one for one in (stops.right, stops.left))
        if -left < lowest and highest < right:
            return
        if moved is None:
            detail = "initial.displacement places the contact on a stop"
            raise invalid(detail, INSIDE_STOPS, "initial", "displacement")
        detail = f"{moved}.values place the contact on a stop or beyond it"
        raise invalid(detail, INSIDE_STOPS, moved, "values")
