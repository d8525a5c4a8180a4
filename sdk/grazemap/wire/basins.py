"""The request for basins of attraction: two initial coordinates, and the values of both."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from grazemap.constants import COORDINATE_UNITS
from grazemap.wire.base import Grid, Places, Request, invalid, parts_in_long_form, plain
from grazemap.wire.planes import AXES, ends_of
from grazemap.wire.process import Operation, PointRequest
from grazemap.wire.states import InitialState, MaxPeriod, MaxPeriods
from grazemap.wire.structure import as_pair

_QUANTITIES = tuple(COORDINATE_UNITS)
_COORDINATE = re.compile(rf"({'|'.join(_QUANTITIES)})\[([1-9][0-9]*)\]")


# The JSON schemas of the fields that may be written in place of the name of a coordinate.
_SHORT_COORDINATE = {
    "quantity": {"enum": list(_QUANTITIES), "type": "string", "description": "The quantity of the mass that varies."},
    "mass": {"type": "integer", "minimum": 1, "description": "The mass, counted from 1.", "default": 1},
}


def _known(name: str) -> str:
    if _COORDINATE.fullmatch(name) is None:
        raise invalid("there is no such coordinate", "displacement[i] or velocity[i], with i from 1")
    return name


class BasinCoordinate(Request):
    """One of the two initial coordinates: displacement or velocity of a mass, and its values."""

    vary: Annotated[str, AfterValidator(_known), Field(json_schema_extra={"pattern": f"^{_COORDINATE.pattern}$"})]
    """displacement[i] or velocity[i], of the mass i, counted from 1."""
    values: Grid
    """Its values: a range, or an increasing list; the contact is strictly between the stops."""

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """Take also the short form {"quantity": "displacement", "mass": 1, "values": ..}; mass 1 may be left out."""
        if not isinstance(values, dict) or "vary" in values or "quantity" not in values:
            return values, {}
        others = {name: value for name, value in values.items() if name not in ("quantity", "mass")}
        decided_by = "mass" if values["quantity"] in _QUANTITIES else "quantity"
        mass = repr(plain(values.get("mass", 1)))  # as it is written: "1" is no number
        return others | {"vary": f"{values['quantity']}[{mass}]"}, {("vary",): (decided_by,)}

    @classmethod
    def short_form(cls, coordinate: Mapping[str, Any]) -> dict[str, Any]:
        """Return a coordinate with its quantity and mass in place of `vary`."""
        if "vary" not in coordinate:
            return dict(coordinate)
        quantity, _, mass = coordinate["vary"].removesuffix("]").partition("[")
        return {"quantity": quantity, "mass": int(mass)} | {k: v for k, v in coordinate.items() if k != "vary"}

    @property
    def quantity(self) -> Literal["displacement", "velocity"]:
        """The quantity of the mass that varies."""
        return "displacement" if self.vary.startswith("displacement") else "velocity"

    @property
    def mass(self) -> int:
        """The mass, counted from 1."""
        return int(self.vary[:-1].partition("[")[2])

    @property
    def ends(self) -> tuple[float, float]:
        """Its first and last value, without expanding the range."""
        return ends_of(self.values)


class BasinsRequest(PointRequest):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance.

    `initial` holds all other coordinates, and the phase of the forcing. Left out, velocities and phase are 0, and
    displacements are 0, or with a bias or a negative clearance those of the structure at rest.
    """

    operation = Operation(
        "basins",
        "submit_basins",
        "Compute the motion that every initial state of a rectangle leads to, and the attractors with their shares.",
        {
            "two coexisting motions": {
                "omega": 0.29,
                "clearance": 1.9927,
                "horizontal": {"vary": "displacement[1]", "values": {"start": -1.9, "stop": 1.9, "points": 50}},
                "vertical": {"vary": "velocity[1]", "values": {"start": -1.0, "stop": 1.0, "points": 50}},
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
    max_period: MaxPeriod = 32

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`."""
        return parts_in_long_form(values, dict.fromkeys(AXES, BasinCoordinate))

    @classmethod
    def short_form(cls, body: Mapping[str, Any]) -> dict[str, Any]:
        """As `ProcessRequest.short_form`, of the coordinates."""
        return {**body, **{axis: BasinCoordinate.short_form(body[axis]) for axis in AXES if axis in body}}

    @classmethod
    def write_short_forms(cls, schema: dict[str, Any]) -> None:
        """As `ProcessRequest.write_short_forms`, of the coordinates."""
        schema["$defs"][BasinCoordinate.__name__]["properties"] |= _SHORT_COORDINATE

    @model_validator(mode="after")
    def _coordinates_fit(self) -> BasinsRequest:
        count = self.oscillator.size
        for name, coordinate in (("horizontal", self.horizontal), ("vertical", self.vertical)):
            if coordinate.mass > count:
                raise invalid(f"{coordinate.vary} does not exist", f"1 to {count}", name, "vary")
        if self.horizontal.vary == self.vertical.vary:
            raise invalid("vertical is the same coordinate as horizontal", "another coordinate", "vertical")
        initial = self.initial.completed(self.oscillator, self.clearance, ("initial",))
        # values that the rectangle replaces are not part of the request
        state = {"displacement": list(initial.displacement or ()), "velocity": list(initial.velocity or ())}
        for coordinate in (self.horizontal, self.vertical):
            if state[coordinate.quantity]:
                state[coordinate.quantity][coordinate.mass - 1] = 0.0
        self._stays_between_the_stops(state["displacement"])
        known = {name: values for name, values in state.items() if values}
        self._replace("initial", initial.model_copy(update=known))
        return self

    def _stays_between_the_stops(self, displacement: list[float]) -> None:
        """Raise where a state of the rectangle has the contact on a stop or beyond it; unknown without displacements.

        Strictly between them, as a start on a stop would depend on rounding.
        """
        if not displacement:
            return
        row, (right, left) = self.oscillator.contact_row, as_pair(self.clearance).reach
        place = sum(h * x for h, x in zip(row, displacement, strict=True))
        lowest, highest, moving = place, place, []
        for name, coordinate in (("horizontal", self.horizontal), ("vertical", self.vertical)):
            reached = [row[coordinate.mass - 1] * end for end in coordinate.ends]
            if coordinate.quantity == "displacement" and row[coordinate.mass - 1] != 0.0:
                lowest, highest = lowest + min(reached), highest + max(reached)
                moving.append(name)
        if -left < lowest and highest < right:
            return
        least = f"{-left:g} < " if math.isfinite(left) else ""
        largest = f" < {right:g}" if math.isfinite(right) else ""
        allowed = f"{least}contact coordinate{largest}, between the stops"
        if not moving:
            detail = f"initial.displacement places the contact at {place:g}, on a stop or beyond it"
            raise invalid(detail, allowed, "initial", "displacement")
        fields = " and ".join(f"{name}.values" for name in moving)
        detail = f"{fields} place the contact at {lowest:g} to {highest:g}, on a stop or beyond it"
        raise invalid(detail, allowed, moving[-1], "values")
