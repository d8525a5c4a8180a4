"""The request for a proof: one statement about one oscillator."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from grazemap.wire.base import LeftOut, Listable, Places, Positive, Request, invalid, parts_in_long_form, without_nulls
from grazemap.wire.orbits import OrbitMotion, parameter_value
from grazemap.wire.planes import OF_STOPS, WindowAxis, require_domain
from grazemap.wire.process import (
    NAMED,
    Operation,
    ProcessRequest,
    ShortForms,
    in_one_form,
    in_short_form,
    with_short_forms,
)
from grazemap.wire.states import InitialState
from grazemap.wire.structure import Clearance, StopName, as_pair

# The fields that a statement of a kind has, and those that it may have.
_FIELDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "orbit": (("omega", "clearance", "motion"), ("stable", "radius")),
    "attraction": (("omega", "clearance"), ("initial", "label")),
    "bifurcation": (("omega", "clearance", "motion", "type", "axis"), ()),
    "codimension-two": (("type", "order", "axis"), ("stop",)),
}
_TYPES = {"bifurcation": ("SN", "PD", "SB", "GR"), "codimension-two": ("g", "h", "h_s")}


# the zeros of codimension-two points are over omega
_SHORT_ZERO = ShortForms(("axis",), {}, "omega")


class ProvenAxis(WindowAxis):
    """A parameter that varies in a proof, and the interval of its values."""

    vary: Literal["omega", *OF_STOPS]  # type: ignore[valid-type]
    """clearance and restitution are those of both stops."""

    @model_validator(mode="after")
    def _is_not_negative(self) -> ProvenAxis:
        if self.values.start < 0.0:
            raise invalid("the values are negative", "start >= 0", "values", "start")
        require_domain(self.vary, self.values.stop, "values", "stop")
        return self


class Statement(Request):
    """A statement that is proven or disproven; which fields it has depends on its kind.

    orbit: there is a periodic orbit with the period and the stops of `motion`, and with phases and velocities within
    `radius` of those of `motion` if it has them, admissible and stable (or, if `stable` is false, unstable).
    attraction: the trajectory from `initial` is attracted by a periodic orbit, of this label if one is given.
    bifurcation: within the values of `axis` there is a bifurcation of this type of an orbit, which the certificate
    names. It is looked for on the branch over that parameter of the orbit near `motion`.
    codimension-two: the function g, h or h_s has a zero at `order` times T/2, for an omega within the values of `axis`.
    T is the period of the forces.
    """

    short: ClassVar[ShortForms] = ShortForms(("axis",), {}, "")

    kind: Literal["orbit", "attraction", "bifurcation", "codimension-two"]
    """What is stated."""
    omega: Positive | None = None
    """Forcing frequency; of a bifurcation, that of the orbit from which its branch is followed."""
    clearance: Clearance | None = None
    """Distance of the stops from q = 0, one number or of each; of a bifurcation, that of the orbit."""
    motion: OrbitMotion | None = None
    """Period and stops of the orbit; with phases and velocities, the orbit near them."""
    radius: Annotated[float, Field(gt=0, le=0.1), Listable] | None = None
    """Of an orbit with phases and velocities: how far it may be from them, in radians and relative; left out, 1e-6."""
    stable: bool | None = None
    """Of an orbit: whether all of its multipliers, or not all of them, lie inside the unit circle; left out: all."""
    initial: InitialState | None = None
    """Of an attraction: the initial state; left out, at rest in the static equilibrium."""
    label: Annotated[str, Field(pattern=r"^\d+-(\d+|\(-1\))r-(\d+|\(-1\))l$", max_length=64)] | None = None
    """Of an attraction: the name n-p_r-q_l of the orbit; left out, any."""
    type: Literal["SN", "PD", "SB", "GR", "g", "h", "h_s"] | None = None
    """Type of the bifurcation; of a codimension-two point, the function whose zero it is."""
    axis: ProvenAxis | None = None
    """Of a bifurcation: the parameter, and the interval in which the point lies; of a codimension-two point: omega."""
    order: Annotated[int, Field(ge=1, le=400), Listable] | None = None
    """Of a codimension-two point: the number of times T/2."""
    stop: Annotated[StopName | None, LeftOut] = None
    """Of a codimension-two point: the one stop that is grazed, after whole periods; left out: both at once."""

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`: vary and range may stand instead of an axis."""
        if not isinstance(values, dict):
            return values, {}
        values = without_nulls(values, NAMED)
        kind = str(values.get("kind"))
        needed, _ = _FIELDS.get(kind, (("axis",), ()))
        if "axis" not in needed or values.keys().isdisjoint(NAMED):
            return values, {}
        return in_one_form(values, _SHORT_ZERO if kind == "codimension-two" else cls.short)

    @model_validator(mode="after")
    def _fields_fit(self) -> Statement:
        needed, others = _FIELDS[self.kind]
        allowed = (*needed, *others, "kind")
        for name in type(self).model_fields:
            present = getattr(self, name) is not None
            if name in needed and not present:
                raise invalid(f"{name} is missing in a statement of the kind {self.kind}", f"{', '.join(needed)}", name)
            if present and name not in allowed:
                raise invalid(f"a statement of the kind {self.kind} has no {name}", ", ".join(allowed), name)
        if self.radius is not None and (self.motion is None or self.motion.phases is None):
            raise invalid("radius is given, and motion has no phases and velocities", "both, or neither", "radius")
        types = _TYPES.get(self.kind, ())
        if self.kind == "codimension-two" and self.axis is not None and self.axis.vary != "omega":
            raise invalid("a codimension-two point is looked for over omega", "omega", "axis", "vary")
        if self.type is not None and self.type not in types:
            raise invalid(f"a statement of the kind {self.kind} has no such type", ", ".join(types), "type")
        return self

    def unused(self) -> Collection[str]:
        """Return the names of the fields that its kind lacks."""
        needed, others = _FIELDS[self.kind]
        return [name for name in type(self).model_fields if name not in (*needed, *others, "kind")]


class ProofsRequest(ProcessRequest):
    """The proof, or the disproof, of one statement in ball arithmetic, as a certificate.

    Every number stands for its shortest decimal: 0.05 is 1/20. What is not decided within the time limit is undecided.
    """

    operation = Operation(
        "proofs",
        "submit_proofs",
        "Prove or disprove one statement about an oscillator; the result is a certificate that `grazemap check` "
        "verifies.",
        {
            "the paper's codimension-two point": {
                "statement": {
                    "kind": "codimension-two",
                    "type": "g",
                    "order": 2,
                    "axis": {"vary": "omega", "values": {"start": 0.282, "stop": 0.283}},
                }
            },
            "a stable orbit": {
                "statement": {
                    "kind": "orbit",
                    "omega": 0.29,
                    "clearance": 1.6,
                    "motion": {"period": 1, "stops": [1, 1, -1, -1]},
                }
            },
        },
    )

    statement: Statement
    """What is to be proven."""
    digits: Annotated[int, Field(ge=10, le=200), Listable] = 30
    """Digits of the enclosures."""
    time_limit: Annotated[float, Field(gt=0, le=600), Listable] = 60.0
    """Seconds after which the statement is undecided."""

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`."""
        return parts_in_long_form(values, {"statement": Statement})

    @classmethod
    def short_form(cls, body: Mapping[str, Any]) -> dict[str, Any]:
        """As `ProcessRequest.short_form`, of the statement."""
        return {**body, "statement": in_short_form(body["statement"], Statement.short)}

    @classmethod
    def write_short_forms(cls, schema: dict[str, Any]) -> None:
        """As `ProcessRequest.write_short_forms`, of the statement."""
        statement = schema["$defs"][Statement.__name__]
        statement["properties"] = with_short_forms(statement["properties"], Statement.short, schema)

    @model_validator(mode="after")
    def _statement_fits(self) -> ProofsRequest:
        statement = self.statement
        if statement.motion is not None:
            statement.motion.require_period_of(self.oscillator, "statement", "motion")
            statement.motion.require_stops(as_pair(statement.clearance), "statement", "motion")
        if statement.kind == "codimension-two":
            if statement.stop is None and not self.oscillator.is_symmetric:
                detail = "stop is missing: a bias or even harmonics let the steady motion graze one stop at a time"
                raise invalid(detail, "right or left", "statement", "stop")
            if statement.stop is not None and (statement.order or 0) % 2:
                detail = "order is odd, and one stop is grazed after whole periods"
                raise invalid(detail, "an even number", "statement", "order")
        # a bifurcation has all three
        if statement.axis is not None and statement.omega is not None and statement.clearance is not None:
            parameter_value(statement.axis.vary, statement.omega, self.oscillator, statement.clearance, "statement")
        if statement.kind == "attraction" and statement.clearance is not None:
            state = statement.initial or InitialState()
            fitted = state.fitted(self.oscillator, statement.clearance, ("statement", "initial"))
            self._replace("statement", statement.model_copy(update={"initial": fitted}))
        return self
