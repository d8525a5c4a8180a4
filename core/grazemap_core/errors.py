"""Exceptions of the core.

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
