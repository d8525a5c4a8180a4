"""Exceptions of the core, and checks of arguments that raise them.

Kernels return a status; the layer above them raises these exceptions. Every message may reach a user: it says what is
wrong and what would help, and contains no values other than those that the user gave.

    CoreError
    +- ParameterError          a number or a combination of numbers outside the range of the theory
    |  +- SteadyMotionError    the non-impacting steady motion does not exist or is not unique
    +- ConditioningError       the result exists, but double precision would not resolve it
    +- LinearisationError      the trajectory ends early, or grazes a stop: the linearised flow does not exist
    +- RecordSizeError         the events of a trajectory exceed the bytes that a record may have
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER


class CoreError(Exception):
    """Base class of the exceptions of the core."""


class ParameterError(CoreError, ValueError):
    """A parameter lies outside the range that the theory covers.

    Parameters
    ----------
    name : str
        Name of the parameter in the interface.
    message : str
        What is required of the parameter.
    """

    def __init__(self, name: str, message: str) -> None:
        super().__init__(f"{name}: {message}")
        self.name = name
        self.message = message

    def __reduce__(self) -> tuple[type[ParameterError], tuple[str, str]]:
        return type(self), (self.name, self.message)


class SteadyMotionError(ParameterError):
    """There is no unique steady motion without impacts, because of an undamped mode or an exact resonance."""


class ConditioningError(CoreError, ArithmeticError):
    """The decomposition into modes is too ill-conditioned."""


class LinearisationError(CoreError, ArithmeticError):
    """The trajectory ends early, or one of its impacts is a graze, where the flow has no derivative."""


class RecordSizeError(CoreError):
    """The events of a trajectory, or of a list of them, exceed the bytes that a record may have.

    Parameters
    ----------
    events, most_bytes : int
        The maximum number of events, and the bytes from which it follows.
    """

    name: ClassVar[str] = "periods"
    """Name of the parameter in the interface that decides it."""

    def __init__(self, events: int, most_bytes: int) -> None:
        super().__init__(
            f"there are more than {events} impacts, rests and releases, the limit for a result of at most "
            f"{most_bytes} bytes. Remedy: ask for fewer periods or initial states, or a larger clearance."
        )
        self.events = events
        self.most_bytes = most_bytes

    def __reduce__(self) -> tuple[type[RecordSizeError], tuple[int, int]]:
        return type(self), (self.events, self.most_bytes)


def checked_omega(omega: ArrayLike) -> Floats:
    """Return forcing frequencies as a contiguous array of shape (n,).

    Raises
    ------
    ParameterError
        The values are not a list of numbers in the range [SMALLEST_NUMBER, LARGEST_NUMBER].
    """
    values = np.ascontiguousarray(omega, dtype=np.float64)
    if values.ndim != 1:
        raise ParameterError("omega", "must be a list of numbers")
    check_range("omega", values)
    return values


def check_range(name: str, values: Floats, low: float = SMALLEST_NUMBER, high: float = LARGEST_NUMBER) -> None:
    """Raise ParameterError when a number is outside the range [low, high]."""
    if not np.all((values >= low) & (values <= high)):
        raise ParameterError(name, f"every number must lie between {low:g} and {high:g}")


def check_point(omega: float, clearance: float) -> None:
    """Raise ParameterError when a frequency or a clearance is outside the range [SMALLEST_NUMBER, LARGEST_NUMBER]."""
    for name, value in (("omega", omega), ("clearance", clearance)):
        if not SMALLEST_NUMBER <= value <= LARGEST_NUMBER:
            raise ParameterError(name, f"must lie between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}")


def checked_order(name: str, value: int, minimum: int) -> int:
    """Return `value`, or raise ParameterError when it is below `minimum`."""
    if value < minimum:
        raise ParameterError(name, f"must be {minimum} or greater")
    return value
