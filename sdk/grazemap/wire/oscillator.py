"""The mechanical system: a linear structure that moves between two rigid stops, by default a chain of masses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import (
    ConfigDict,
    Discriminator,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    model_serializer,
    model_validator,
)

from grazemap.later import Later
from grazemap.units import OSCILLATOR, Refused, in_si
from grazemap.wire import linear
from grazemap.wire.base import LeftOut, NonEmpty, NonNegative, Positive, Request, invalid
from grazemap.wire.orders import forced_orders
from grazemap.wire.structure import (
    Base,
    Contact,
    ContactRow,
    Forces,
    Forcing,
    Matrices,
    OptionalRow,
    Restitution,
    RestitutionPair,
    restitutions,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = Later("numpy")


def _damping_tag(value: Any) -> str:
    # an array without dimensions is a number, although it has __len__
    several = hasattr(value, "__len__") and getattr(value, "ndim", 1) > 0
    return "[per link]" if several else "[proportional]"


Damping = Annotated[
    Annotated[NonNegative, Tag("[proportional]")] | Annotated[NonEmpty[NonNegative], Tag("[per link]")],
    Discriminator(_damping_tag),
]


_DESCRIPTION = """\
A linear structure whose contact coordinate moves between the right stop (+clearance) and the left (-clearance), and
rebounds from them: a chain of N masses, of which mass 1 hits the stops, unless other fields say so.

Link i of the chain, a spring and a damper, joins mass i to mass i + 1, the last one to the ground. All lists have N
numbers; a field that is left out has its default, also in SI, except that damping has none there.
"""


class Oscillator(Request):
    """A linear structure between a right stop (+clearance) and a left stop (-clearance); by default a chain of masses.

    ``M x'' + C x' + K x = f sin(omega t + phase)`` for ``|x1| < clearance``, and ``v1 -> -restitution v1`` at a
    stop; link i joins mass i to mass i + 1, the last one to ground (equations (1), (3); the impact law (2), (4)
    is on mass 1). The defaults are the paper's example. With `matrices` the structure is any other; `contact` says
    what hits the stops.

    Parameters
    ----------
    units : {"nondimensional", "SI"}
        Numbers are taken as they are in either case; nothing is rescaled. In SI they may be texts with a unit, as
        "250 g", "12 N/mm", "0.1 N s/mm", "2 kN" or "0.2 mm".
    masses, stiffnesses : sequence of N floats, each > 0
        kg and N/m in SI.
    damping : float >= 0, or a sequence of N floats >= 0
        One number is gamma of the proportional damping ``C = 2 gamma K`` (seconds in SI). Mode j then has the
        damping ratio ``gamma omega_j``: for a ratio zeta in the first mode give ``zeta/omega_1``. A list has one
        entry per link: zeta_i, each link's coefficient being ``2 zeta_i`` (nondimensional), or the coefficients
        c_i themselves in N s/m (SI).
    matrices : Matrices or mapping, optional
        Mass, damping and stiffness matrix instead of masses, stiffnesses and damping; see `from_matrices`.
    contact : int, pair of int, or {"row": sequence of N floats}
        The contact coordinate: the displacement of a mass, counted from 1; that of one mass minus that of another;
        or any row of displacements.
    forcing : sequence of N floats, Forcing, or a sequence of Forcing
        Amplitudes f (N in SI), or harmonics with phases and a law. Left out: 1 on mass 1 of a chain, or 0 with `base`.
    restitution : float in [0, 1], or {"right": float, "left": float}
        Speed after an impact over the speed before it, of both stops or of each.
    base : Base or mapping, optional
        A ground that moves.
    bias : sequence of N floats, optional
        Static forces. "At rest" is then the static equilibrium.
    """

    if not TYPE_CHECKING:  # which knows the arguments by the fields

        def __init__(self, **fields: Any) -> None:
            refused: list[Refused] = []
            units = fields.get("units", "nondimensional")
            converted = in_si({OSCILLATOR: fields}, units, refused)[OSCILLATOR]
            if refused:
                errors = [
                    {"type": invalid(detail, allowed), "loc": tuple(pointer.split("/")[2:]), "input": None}
                    for pointer, detail, allowed in refused
                ]
                raise ValidationError.from_exception_data(type(self).__name__, errors, hide_input=True)
            super().__init__(**converted)

        # Texts with a unit are for Python: pydantic does not call this for the oscillator in a body.
        __init__.__pydantic_base_init__ = True

    # The docstring is for Python; in the API's document it would be one paragraph.
    model_config = ConfigDict(json_schema_extra={"description": _DESCRIPTION})

    units: Literal["nondimensional", "SI"] = "nondimensional"
    """Units of all numbers; "SI": kg, N/m, N, m, s, rad/s. Nothing is rescaled."""
    masses: NonEmpty[Positive] = [1.0, 10.0, 10.0]
    """N masses; mass 1 hits the stops; kg in SI."""
    stiffnesses: NonEmpty[Positive] = [1.0, 5.0, 5.0]
    """N stiffnesses: link i joins mass i to mass i + 1, the last one to the ground; N/m in SI."""
    damping: Damping = 0.05
    """gamma of C = 2 gamma K (seconds in SI); or one number per link, c_i = 2 zeta_i, in SI c_i itself (N s/m)."""
    matrices: Annotated[Matrices | None, LeftOut] = None
    """Mass, damping and stiffness matrix, instead of masses, stiffnesses and damping."""
    contact: Contact = 1
    """What moves between the stops: mass i, counted from 1; [i, j]: x_i - x_j; {"row": [..N]}: any row of x."""
    forcing: Forces = [1.0, 0.0, 0.0]
    """Amplitude of the force on each mass (N in SI), or harmonics; left out: 1 on mass 1 of a chain, 0 with a base."""
    restitution: Restitution = 0.8
    """Speed after an impact over the speed before it, of both stops or of each."""
    base: Annotated[Base | None, LeftOut] = None
    """A ground that moves."""
    bias: OptionalRow = None
    """Static force on each of the N masses."""

    @classmethod
    def from_matrices(cls, *, mass: Any, damping: Any, stiffness: Any, **fields: Any) -> Self:
        """Return an oscillator with these matrices, N x N each, and other fields by their names.

        `damping` may also be {"modal": ratios} or {"rayleigh": [alpha, beta]}. Raises pydantic.ValidationError.
        """
        matrices: Any = {"mass": mass, "damping": damping, "stiffness": stiffness}
        return cls(matrices=matrices, **fields)

    @model_validator(mode="wrap")
    @classmethod
    def _forcing_has_a_default(cls, values: Any, validated: ModelWrapValidatorHandler[Self]) -> Self:
        """Write the forces of an oscillator for which they are left out, where that is allowed."""
        if not isinstance(values, dict) or "forcing" in values:
            return validated(values)
        oscillator = validated(cls._with_forcing(values))
        oscillator.model_fields_set.discard("forcing")
        return oscillator

    @staticmethod
    def _with_forcing(values: dict[str, Any]) -> dict[str, Any]:
        moved = values.get("base") is not None
        of_mass = values.get("masses", [None] * 3)
        matrices = values.get("matrices")
        if matrices is not None:
            of_mass = (
                matrices.mass
                if isinstance(matrices, Matrices)
                else matrices.get("mass")
                if isinstance(matrices, dict)
                else 0
            )
        if not hasattr(of_mass, "__len__") or len(of_mass) == 0 or (matrices is not None and not moved):
            return values
        return values | {"forcing": [0.0 if moved else 1.0] + [0.0] * (len(of_mass) - 1)}

    @model_validator(mode="after")
    def _is_one_structure(self) -> Self:
        if self.matrices is None:
            count = len(self.masses)
            lists = {"stiffnesses": self.stiffnesses}
            if isinstance(self.damping, list):
                lists["damping"] = self.damping
            for name, values in lists.items():
                if len(values) != count:
                    raise invalid(
                        f"{name} has {len(values)} numbers and masses has {count}",
                        "masses, stiffnesses, forcing and a list of dampings of one length",
                        name,
                    )
            return self
        for name in ("masses", "stiffnesses", "damping"):
            if name in self.model_fields_set:
                raise invalid(
                    f"{name} is given, and so are matrices", f"matrices, or a chain without them: not {name}", name
                )
        if "forcing" not in self.model_fields_set and self.base is None:
            raise invalid("forcing has no default where there are matrices", "forcing, or a base that moves", "forcing")
        if self.base is not None and self.base.influence is None:
            detail = "base.influence has no default where there are matrices"
            raise invalid(detail, "by how much a unit displacement of the ground moves each coordinate", "base")
        return self

    @model_validator(mode="after")
    def _rows_fit(self) -> Self:
        count = self.size
        of = "masses has" if self.matrices is None else "the matrices have"
        rows: list[tuple[list[float], tuple[str, ...]]] = []
        if isinstance(self.forcing, list) and not isinstance(self.forcing[0], Forcing):
            rows.append((self.forcing, ("forcing",)))
        for i, force in enumerate(self.harmonics):
            at: tuple[str, ...] = ("forcing", str(i)) if isinstance(self.forcing, list) else ("forcing",)
            rows.append((force.amplitude, (*at, "amplitude")))
            if force.phase is not None:
                rows.append((force.phase, (*at, "phase")))
        if self.base is not None and self.base.influence is not None:
            rows.append((self.base.influence, ("base", "influence")))
        if self.bias is not None:
            rows.append((self.bias, ("bias",)))
        if isinstance(self.contact, ContactRow):
            rows.append((self.contact.row, ("contact", "row")))
        for values, where in rows:
            if len(values) != count:
                detail = f"{'.'.join(where)} has {len(values)} numbers and {of} {count}"
                raise invalid(detail, "one number for each mass", *where)
        return self

    @model_validator(mode="after")
    def _contact_is_one(self) -> Self:
        contact, count = self.contact, self.size
        if isinstance(contact, ContactRow):
            if not any(contact.row):
                raise invalid("contact.row is a row of zeros", "at least one number that is not 0", "contact", "row")
            return self
        named = [contact] if isinstance(contact, int) else contact
        if max(named) > count:
            raise invalid(f"contact names mass {max(named)} and there are {count}", f"1 to {count}", "contact")
        if len(set(named)) < len(named):
            raise invalid("contact is between a mass and itself", "two different masses", "contact")
        return self

    @model_validator(mode="after")
    def _is_covered(self) -> Self:
        """Refuse matrices with motions that the theory does not cover."""
        if self.matrices is None:
            return self
        if (name := linear.growing(self)) is not None:
            raise invalid("a free motion grows", "matrices whose free motions do not grow", "matrices", name)
        stiffness = linear.matrices(self)[2]
        free = linear.free_modes(stiffness)
        if not len(free.directions):
            return self
        if not np.array_equal(stiffness, stiffness.T):
            detail = "stiffness has a free mode and is not symmetric, which this version does not cover"
            raise invalid(detail, "a structure that is held, or a symmetric matrix", "matrices", "stiffness")
        if free.have_part_of(self.contact_row):
            detail = "contact sees a free mode of the structure, which this version does not cover"
            raise invalid(detail, "a contact within the structure, or a structure that is held", "contact")
        if self.bias is not None and free.have_part_of(self.bias):
            detail = "bias pushes along a free mode, so there is no equilibrium"
            raise invalid(detail, "forces that balance along every free mode, or a structure that is held", "bias")
        if linear.are_damped(free, self):
            detail = "damping acts on a free mode and is not diagonal in the modes, which this version does not cover"
            raise invalid(detail, "dampers within the structure, or modal or Rayleigh damping", "matrices", "damping")
        return self

    @model_validator(mode="after")
    def _damping_is_said_in_si(self) -> Self:
        if self.units == "SI" and self.matrices is None and "damping" not in self.model_fields_set:
            raise invalid(
                "damping has no default in SI units",
                "gamma of C = 2 gamma K in seconds, or one coefficient in N s/m per link; 0 for no damping",
                "damping",
            )
        return self

    @model_serializer(mode="wrap")
    def _normal(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the fields in their simplest form, so that oscillators that mean the same have the same text."""
        fields: dict[str, Any] = dump(self)
        for name in () if self.matrices is None else ("masses", "stiffnesses", "damping"):
            fields.pop(name, None)
        simplest: dict[str, Any] = {
            "contact": _simplest_contact(self.contact_row),
            "forcing": _simplest_forcing(self),
            "restitution": _simplest_restitution(self.restitution),
        }
        if self.base is not None:
            influence = [1.0] * self.size if self.base.influence is None else self.base.influence
            simplest["base"] = {**self.base.model_dump(), "influence": influence}
        fields |= {name: value for name, value in simplest.items() if name in fields}
        if fields.get("contact") == 1:
            del fields["contact"]
        return fields

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Yield the fields that are shown: of matrices not those of a chain, and nothing that is not there."""
        chain = () if self.matrices is None else ("masses", "stiffnesses", "damping")
        yield from (pair for pair in super().__repr_args__() if pair[0] not in chain and pair[1] is not None)

    @property
    def size(self) -> int:
        """Number of degrees of freedom N."""
        return len(self.masses) if self.matrices is None else len(self.matrices.mass)

    def require_each(
        self, values: list[Any] | None, what: str, allowed: str, *at: str, entries: str = "numbers"
    ) -> None:
        """Refuse a list without one entry for each degree of freedom; `at` is its place in the request."""
        if values is not None and len(values) != self.size:
            detail = f"{what} has {len(values)} {entries} and the oscillator has {self.size} degrees of freedom"
            raise invalid(detail, allowed, *at)

    @property
    def harmonics(self) -> list[Forcing]:
        """The harmonics of the forces, where they are not a list of amplitudes."""
        forcing = self.forcing
        return [forcing] if isinstance(forcing, Forcing) else [force for force in forcing if isinstance(force, Forcing)]

    @property
    def orders(self) -> list[int]:
        """The harmonics in which the forces are not 0, increasing; that of a moving base is 1."""
        return forced_orders(self)

    @property
    def common_divisor(self) -> int:
        """The greatest common divisor p of `orders`, 1 without forces: phases repeat after ``2 pi/p``."""
        return math.gcd(*self.orders) or 1

    def forcing_period(self, omega: Any) -> Any:
        """Return the period T = ``2 pi/(p omega)`` of the forces at a frequency, or at each of an array."""
        return 2.0 * math.pi / (self.common_divisor * omega)

    @property
    def is_symmetric(self) -> bool:
        """Whether the steady motion grazes two equal stops at once, as it does with forces in one harmonic.

        There is no bias, and the forces change their sign after half of their period: all their harmonics have the same
        power of 2 as a factor.
        """
        return not any(self.bias or ()) and len({order & -order for order in self.orders}) < 2

    @property
    def contact_row(self) -> list[float]:
        """The row h of the contact coordinate ``q = h x``, N numbers."""
        if isinstance(self.contact, ContactRow):
            return self.contact.row
        row = [0.0] * self.size
        first, *second = [self.contact] if isinstance(self.contact, int) else self.contact
        row[first - 1] = 1.0
        for other in second:
            row[other - 1] = -1.0
        return row

    @property
    def amplitudes(self) -> list[float]:
        """Amplitudes of forces of one frequency and phase. Raises TypeError where they are others."""
        plain = _simplest_forcing(self)
        if any(isinstance(value, dict) for value in plain):
            raise TypeError("the forces are not of one frequency and phase")
        return plain

    def beyond_the_chain(self) -> str | None:
        """Return the field for which this is no chain with mass 1 between equal stops and forces of one phase."""
        if self.matrices is not None:
            return "matrices"
        if _simplest_contact(self.contact_row) != 1:
            return "contact"
        if any(isinstance(value, dict) for value in _simplest_forcing(self)):
            return "forcing"
        if isinstance(_simplest_restitution(self.restitution), dict):
            return "restitution"
        if self.base is not None:
            return "base"
        return "bias" if any(self.bias or ()) else None

    @property
    def natural_frequencies(self) -> NDArray[np.float64]:
        """The angular frequencies of the undamped structure without stops, increasing, shape (N,); rad/s in SI."""
        return linear.natural_frequencies(self)

    @property
    def damping_ratios(self) -> NDArray[np.float64]:
        """The damping ratio of each mode, shape (N,); 1 or more: the mode does not oscillate.

        With a damping for each link, and several modes that do not oscillate, NaN for these, at the end.
        """
        return linear.damping_ratios(self)


def _simplest_contact(row: list[float]) -> int | list[int] | dict[str, list[float]]:
    """Return a contact row as a mass or a pair of masses where it is one."""
    ones, others = [i for i, value in enumerate(row) if value == 1.0], [i for i, value in enumerate(row) if value]
    if len(others) == 1 and ones == others:
        return ones[0] + 1
    if len(others) == 2 and len(ones) == 1:
        (other,) = set(others) - set(ones)
        if row[other] == -1.0:
            return [ones[0] + 1, other + 1]
    return {"row": row}


def _simplest_forcing(oscillator: Oscillator) -> list[Any]:
    """Return the amplitudes of one plain harmonic, or a list of harmonics."""
    described: list[dict[str, Any]] = [force.model_dump(exclude_defaults=True) for force in oscillator.harmonics]
    described = described or [{"amplitude": oscillator.forcing}]
    return described[0]["amplitude"] if len(described) == 1 and len(described[0]) == 1 else described


def _simplest_restitution(restitution: float | RestitutionPair) -> float | dict[str, float]:
    """Return one number for two stops of equal restitution."""
    right, left = restitutions(restitution)
    return right if right == left else {"right": right, "left": left}
