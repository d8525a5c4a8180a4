"""The mechanical system: a chain of masses whose first one moves between two symmetric rigid stops."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from grazemap.wire import linear
from grazemap.wire.base import Float, Listable, NonNegative, Positive, Request, invalid


def _damping_tag(value: Any) -> str:
    # an array without dimensions is a number, although it has __len__
    several = hasattr(value, "__len__") and getattr(value, "ndim", 1) > 0
    return "[per link]" if several else "[proportional]"


Damping = Annotated[
    Annotated[NonNegative, Tag("[proportional]")]
    | Annotated[list[NonNegative], Field(min_length=1, fail_fast=True), Listable, Tag("[per link]")],
    Discriminator(_damping_tag),
]


_DESCRIPTION = """\
A chain of N masses. Mass 1 moves between the stops A (+clearance) and C (-clearance), and rebounds from them.

Link i, a spring and a damper, joins mass i to mass i + 1, the last one to the ground. All lists have N numbers; a field
that is left out has its default, also in SI, except that damping has none there.
"""


class Oscillator(Request):
    """A chain of N masses; mass 1 moves between the stops A (+clearance) and C (-clearance), and rebounds from them.

    ``M x'' + C x' + K x = f sin(omega t + phase)`` for ``|x1| < clearance``, and ``v1 -> -restitution v1`` at a
    stop; link i joins mass i to mass i + 1, the last one to ground (equations (1), (3); the impact law (2), (4)
    is on mass 1). The defaults are the paper's example.

    Parameters
    ----------
    units : {"nondimensional", "SI"}
        Numbers are taken as they are in either case; nothing is rescaled.
    masses, stiffnesses : sequence of N floats, each > 0
        kg and N/m in SI.
    damping : float >= 0, or a sequence of N floats >= 0
        One number is gamma of the proportional damping ``C = 2 gamma K`` (seconds in SI). Mode j then has the
        damping ratio ``gamma omega_j``: for a ratio zeta in the first mode give ``zeta/omega_1``. A list has one
        entry per link: zeta_i, each link's coefficient being ``2 zeta_i`` (nondimensional), or the coefficients
        c_i themselves in N s/m (SI).
    forcing : sequence of N floats
        Amplitudes f; N in SI.
    restitution : float in [0, 1]
        Speed of mass 1 after an impact over the speed before it.

    Attributes
    ----------
    size : int
        Number of masses N.
    natural_frequencies : ndarray of float, shape (N,)
        Of the undamped chain without stops, increasing; rad/s in SI.
    damping_ratios : ndarray of float, shape (N,)
        Of each mode; 1 or more: the mode does not oscillate.
    """

    # The docstring is for Python; in the API's document it would be one paragraph.
    model_config = ConfigDict(json_schema_extra={"description": _DESCRIPTION})

    units: Literal["nondimensional", "SI"] = "nondimensional"
    """Units of all numbers; "SI": kg, N/m, N, m, s, rad/s. Nothing is rescaled."""
    masses: Annotated[list[Positive], Field(min_length=1, fail_fast=True), Listable] = [1.0, 10.0, 10.0]
    """N masses; mass 1 hits the stops; kg in SI."""
    stiffnesses: Annotated[list[Positive], Field(min_length=1, fail_fast=True), Listable] = [1.0, 5.0, 5.0]
    """N stiffnesses: link i joins mass i to mass i + 1, the last one to the ground; N/m in SI."""
    damping: Damping = 0.05
    """gamma of C = 2 gamma K (seconds in SI); or one number per link, c_i = 2 zeta_i, in SI c_i itself (N s/m)."""
    forcing: Annotated[list[Float], Field(min_length=1, fail_fast=True), Listable] = [1.0, 0.0, 0.0]
    """Amplitude of the force on each of the N masses; N in SI."""
    restitution: Annotated[float, Field(ge=0, le=1), Listable] = 0.8
    """Speed of mass 1 after an impact over the speed before it."""

    @model_validator(mode="after")
    def _lengths_agree(self) -> Oscillator:
        count = len(self.masses)
        lists = {"stiffnesses": self.stiffnesses, "forcing": self.forcing}
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

    @model_validator(mode="after")
    def _damping_is_said_in_si(self) -> Oscillator:
        if self.units == "SI" and "damping" not in self.model_fields_set:
            raise invalid(
                "damping has no default in SI units",
                "gamma of C = 2 gamma K in seconds, or one coefficient in N s/m per link; 0 for no damping",
                "damping",
            )
        return self

    @property
    def size(self) -> int:
        """Number of masses N."""
        return len(self.masses)

    @property
    def natural_frequencies(self) -> NDArray[np.float64]:
        """The angular frequencies of the undamped chain without stops, increasing, shape (N,); rad/s in SI."""
        return linear.natural_frequencies(self)

    @property
    def damping_ratios(self) -> NDArray[np.float64]:
        """The damping ratio of each mode, shape (N,); 1 or more: the mode does not oscillate.

        With a damping for each link, and several modes that do not oscillate, NaN for these, at the end.
        """
        return linear.damping_ratios(self)
